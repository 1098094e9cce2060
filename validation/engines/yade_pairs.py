"""Pairs of polyhedra, measured by YADE.

Debian's `yade` is a module of Debian's Python; it takes all cores unless it is told otherwise before it is imported.
"""
import os
import sys

import numpy as np
from pairs import EDGE
from scipy.spatial.transform import Rotation

os.environ["OMP_NUM_THREADS"] = "1"
sys.path.insert(0, "/usr/lib/x86_64-linux-gnu/yade-double/py")
from yade import *  # noqa: E402, F403
from yade import log, polyhedra_utils  # noqa: E402
from yade.minieigenHP import Quaternion, Vector3  # noqa: E402

log.setLevel("Polyhedra_support.cpp", log.ERROR)
FINE = 10  # steps of YADE in one of Turbid


def solid(points, density, scale):
    """A body of YADE, all lengths multiplied by `scale`."""
    material = PolyhedraMat(density=density, young=1.0, poisson=0.25, frictionAngle=0.0)
    return polyhedra_utils.polyhedra(material, v=[Vector3(*(scale * point)) for point in points])


class Yade:
    """A pair of bodies in YADE, which measures their overlap wherever they are put; lengths are multiplied by `scale` for it."""

    def __init__(self, shapes, turns, scale=1 / EDGE):
        O.reset()
        self.scale = scale
        for points, turn in zip(shapes, turns):
            body = solid(points, 1.0, scale)
            x, y, z, w = turn.as_quat()
            body.state.ori = Quaternion(w, x, y, z) * body.state.ori
            O.bodies.append(body)
        O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Polyhedra_Aabb()], verletDist=0), InteractionLoop(
            [Ig2_Polyhedra_Polyhedra_PolyhedraGeom()], [Ip2_PolyhedraMat_PolyhedraMat_PolyhedraPhys()],
            [Law2_PolyhedraGeom_PolyhedraPhys_Volumetric()])]

    def measure(self, *positions):
        """Volume, centroid and normal; no volume where they are apart."""
        for body, position in zip(O.bodies, positions):
            body.state.pos = Vector3(*(self.scale * position))
        O.step()
        real = [i for i in O.interactions if i.isReal and i.phys.normalForce.norm() > 0]
        if not real:
            return 0.0, np.zeros(3), np.zeros(3)
        geometry = real[0].geom
        return geometry.penetrationVolume / self.scale ** 3, np.array(geometry.contactPoint) / self.scale, np.array(geometry.normal)


def approached(points, turns, path, scale=1 / EDGE):
    """Measurements of YADE at the positions but the last, reached in small steps from each to the next."""
    yade, measured = Yade(points, turns, scale), []
    for before, now in zip([path[0], *path[:-2]], path[:-1]):
        for part in range(1, FINE + 1):
            seen = yade.measure(*(before + (now - before) * (part / FINE)))
        measured.append(seen)
    return measured


def rebound(points, aside):
    """Energy after over that before: a body falls on an equal one, shifted by `aside` edges, without damping and friction."""
    Yade([points, points], [Rotation.identity()] * 2)
    for body, z, v in zip(O.bodies, (0.0, 1.001), (0.0, -1.0)):
        body.mat.young, body.state.pos, body.state.vel = 1e3, Vector3(aside[0], aside[1], z) * (z > 0), Vector3(0, 0, v)
    O.engines += [NewtonIntegrator(damping=0, exactAsphericalRot=True)]
    O.dt = 2e-5

    def energy():
        return sum(b.state.mass * b.state.vel.squaredNorm() + sum(
            j * j / i for j, i in zip(b.state.ori.conjugate() * b.state.angMom, b.state.inertia)) for b in O.bodies)
    before = energy()
    for _ in range(10000):
        O.step()
    return energy() / before
