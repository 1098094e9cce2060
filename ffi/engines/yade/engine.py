"""YADE moves spheres or convex polyhedra for Turbid.

Spheres have Hertz's law with damping and Mindlin's friction; polyhedra YADE's volumetric law, a force in proportion to the volume
of the overlap, with friction and without damping. Works with Debian 12's package `yade`, and Debian's own Python: /usr/bin/python3.
"""
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import protocol  # noqa: E402

os.environ["OMP_NUM_THREADS"] = "1"
sys.path.insert(0, "/usr/lib/x86_64-linux-gnu/yade-double/py")
from yade import *  # noqa: E402, F403
from yade import log, polyhedra_utils, utils  # noqa: E402
from yade.minieigenHP import Quaternion, Vector3  # noqa: E402

# It warns in every step about polyhedra that are near each other.
log.setLevel("Polyhedra_support.cpp", log.ERROR)


def polyhedron(template, material, unit):
    vertices = template["shape"]["vertices"]
    return polyhedra_utils.polyhedra(material, v=[unit * Vector3(*vertex) for vertex in vertices])


class Yade:
    hello = {"name": "YADE 2023.02a", "shapes": ["sphere", "polyhedron"], "walls": ["plane"],
             "orientations": True, "contacts": True, "overlaps": True}

    def set_up(self, case, bodies):
        box, contact = case["box"], case["contact"]
        if len(set(box["periodic"])) > 1:
            raise protocol.Refusal("YADE has boxes that are periodic in all directions or in none")
        templates = [case["templates"][body[1]] for body in bodies]
        kinds = {template["shape"]["kind"] for template in templates}
        if len(kinds) > 1:
            raise protocol.Refusal("this engine has spheres or polyhedra, not both in one case")
        self.spheres = kinds == {"sphere"}
        grown = contact["enlargement"] if contact else 0.0
        if grown > 0 and not self.spheres:
            raise protocol.Refusal("YADE's polyhedra cannot be grown: set contact.enlargement = 0")
        # YADE's polyhedra have absolute limits, below which it finds no overlap: they have lengths of order 1, `unit` of them in a metre.
        self.size = min(template["inertia"][0] / template["mass"] for template in templates) ** 0.5
        self.unit = 1.0 if self.spheres else 1 / self.size
        if box["periodic"][0]:
            O.periodic = True
            O.cell.setBox(*(self.unit * edge for edge in box["size"]))
        self.gravity, self.loads = self.unit * Vector3(*case["gravity"]), [(Vector3.Zero, Vector3.Zero)] * len(bodies)
        materials = self.materials(contact, templates)
        self.ids, self.index, self.turns = [body[0] for body in bodies], {}, []
        for n, (body, template) in enumerate(zip(bodies, templates)):
            material = materials[template["material"]]
            if self.spheres:
                made = utils.sphere(Vector3.Zero, template["shape"]["radius"] + grown, material=material)
                made.state.inertia = Vector3(*template["inertia"])
            else:
                made = polyhedron(template, material, self.unit)
                # YADE orders the principal axes in its own way.
                made.state.inertia *= template["mass"] / made.state.mass
            turn = made.state.ori
            x, y, z, w = body[5:9]
            made.state.mass = template["mass"]
            made.state.pos, made.state.ori = self.unit * Vector3(*body[2:5]), Quaternion(w, x, y, z) * turn
            made.state.vel, made.state.angVel = self.unit * Vector3(*body[9:12]), Vector3(*body[12:15])
            made.state.angMom = self.turned(made, made.state.angVel, lambda v, i: v * i)
            self.index[O.bodies.append(made)] = n
            self.turns.append(turn)
        self.walls = {}
        for n, wall in enumerate(case["walls"]):
            normal, point = wall["surface"]["normal"], wall["surface"]["point"]
            axis = max(range(3), key=lambda i: abs(normal[i]))
            if abs(normal[axis]) < 1 - 1e-9:
                raise protocol.Refusal(f"the wall {wall['name']}: YADE has planes across x, y or z")
            made = utils.wall(self.unit * Vector3(*point), axis, sense=1 if normal[axis] > 0 else -1,
                              material=materials[wall["material"]])
            made.state.vel = self.unit * Vector3(*wall["velocity"])
            self.walls[O.bodies.append(made)] = n
        self.engines(contact)

    def materials(self, contact, templates):
        """A material of YADE for each of the case; of polyhedra the stiffness is that of a volume (N/m^3)."""
        if not contact:
            contact = {"materials": [{"youngs_modulus": 1.0, "poisson_ratio": 0.25}] * (
                1 + max(template["material"] for template in templates))}
        made = []
        for n, material in enumerate(contact["materials"]):
            young, poisson = material["youngs_modulus"], material["poisson_ratio"]
            if self.spheres:
                made.append(FrictMat(young=young, poisson=poisson, frictionAngle=0.0))
            else:
                pair = contact["pairs"][n * len(contact["materials"]) + n] if "pairs" in contact else {"friction_kinetic": 0.0}
                friction = math.atan(pair["friction_kinetic"])
                made.append(PolyhedraMat(young=young / self.size / self.unit ** 2, poisson=poisson, frictionAngle=friction))
            O.materials.append(made[-1])
        return made

    def engines(self, contact):
        if self.spheres:
            bounds, walls = [Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], Ig2_Wall_Sphere_ScGeom()
            geometries, law = [Ig2_Sphere_Sphere_ScGeom(), walls], Law2_ScGeom_MindlinPhys_Mindlin()
            values = {"en": [], "es": [], "frictAngle": []}
            count = len(contact["materials"]) if contact else 0
            for a in range(count):
                for b in range(a, count):
                    pair = contact["pairs"][a * count + b]
                    friction = pair["friction_kinetic"] if pair["friction_static"] > 0 else 0.0
                    for name, value in (("en", pair["restitution"]), ("es", pair["restitution"]),
                                        ("frictAngle", math.atan(friction))):
                        values[name].append((a, b, value))
            physics = Ip2_FrictMat_FrictMat_MindlinPhys(
                **{name: MatchMaker(matches=tuple(matches)) for name, matches in values.items()})
        else:
            bounds, walls = [Bo1_Polyhedra_Aabb(), Bo1_Wall_Aabb()], Ig2_Wall_Polyhedra_PolyhedraGeom()
            geometries, law = [Ig2_Polyhedra_Polyhedra_PolyhedraGeom(), walls], Law2_PolyhedraGeom_PolyhedraPhys_Volumetric()
            physics = Ip2_PolyhedraMat_PolyhedraMat_PolyhedraPhys()
        reach = 0.1 * min(b.shape.radius if self.spheres else b.state.inertia[0] ** 0.5 / b.state.mass ** 0.5
                          for b in map(O.bodies.__getitem__, self.index))
        loop = [InsertionSortCollider(bounds, verletDist=reach), InteractionLoop(geometries, [physics], [law])]
        O.engines = [ForceResetter(), *(loop if contact else []),
                     NewtonIntegrator(damping=0, exactAsphericalRot=True)]

    @staticmethod
    def turned(body, vector, change):
        """A vector of the world, changed by component in the principal axes by the moments of inertia."""
        local = body.state.ori.conjugate() * vector
        return body.state.ori * Vector3(*(change(v, i) for v, i in zip(local, body.state.inertia)))

    def advance(self, step, substeps, loads):
        O.dt, half = step, 0.5 * step
        for body, n in self.index.items():
            state, (force, torque) = O.bodies[body].state, self.loads[n]
            new = self.unit * Vector3(*loads[n][1:4]) + state.mass * self.gravity, self.unit ** 2 * Vector3(*loads[n][4:])
            # Velocities are those of half a step before, and so they depend on the loads.
            state.vel += (force - new[0]) * half / state.mass
            self.push(O.bodies[body], (torque - new[1]) * half)
            O.forces.setPermF(body, new[0])
            O.forces.setPermT(body, new[1])
            self.loads[n] = new
        for _ in range(substeps):
            O.step()
        states = []
        for body, n in self.index.items():
            made = O.bodies[body]
            state, (force, torque) = made.state, self.loads[n]
            total = O.forces.f(body), O.forces.t(body)
            velocity = state.vel + total[0] * half / state.mass
            momentum = self.turned(made, state.angVel, lambda v, i: v * i) if self.spheres else state.angMom
            spin = self.turned(made, momentum + total[1] * half, lambda v, i: v / i)
            turn = state.ori * self.turns[n].conjugate()
            turn.normalize()
            states.append((self.ids[n], *(state.pos / self.unit), turn[0], turn[1], turn[2], turn[3], *(velocity / self.unit), *spin,
                           *((total[0] - force) / self.unit), *((total[1] - torque) / self.unit ** 2)))
        return states

    def push(self, body, impulse):
        """Adds an angular momentum (kg m^2/s)."""
        state = body.state
        if not self.spheres:
            state.angMom += impulse
            state.angVel = self.turned(body, state.angMom, lambda v, i: v / i)
        else:
            state.angVel += self.turned(body, impulse, lambda v, i: v / i)

    def contacts(self):
        found = []
        for contact in O.interactions:
            if not contact.isReal:
                continue
            force = (contact.phys.normalForce + contact.phys.shearForce) / self.unit
            if force.norm() == 0:
                continue
            overlap = (0, 0, 0, 0)
            if not self.spheres:
                overlap = contact.geom.penetrationVolume / self.unit ** 3, *(contact.geom.contactPoint / self.unit)
            # On the second body.
            first, second = (self.ids[self.index[k]] if k in self.index else protocol.WALL - self.walls[k]
                             for k in (contact.id1, contact.id2))
            found.append((first, second, *-force, *overlap) if first < second else (second, first, *force, *overlap))
        return found


protocol.serve(Yade())
