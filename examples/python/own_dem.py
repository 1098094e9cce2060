"""A DEM in Python moves the particles, and Turbid is its fluid: spheres with linear springs settle on a floor.

``python examples/python/own_dem.py`` prints the heights of the spheres; ``--short`` ends before they have come to rest.
``--case cases/hindered_settling.toml --time 0.0232`` drives the fluid of a case of spheres instead, and prints their mean velocity at the
end and the cost of a step, for the native engine of the case and for the DEM here.
"""

import argparse
import time
import tomllib
from pathlib import Path

import numpy as np

import turbid

SUBSTEPS = 20
STIFFNESS = 50.0  # of a contact, N/m
DAMPING = 5e-3  # of a contact, N s/m

CASE = {
    "domain": {"size": [4e-3, 4e-3, 6e-3], "periodic": [True, True, False]},
    "fluid": {"density": 1000.0, "viscosity": 1e-5},
    "lattice": {"cells_per_diameter": 4, "relaxation_time": 0.6},
    "particles": [
        {
            "shape": {"sphere": {"diameter": 1e-3}},
            "density": 2500.0,
            "list": [[2e-3, 2e-3, 4e-3], [2.2e-3, 2e-3, 1.5e-3], [2e-3, 2.2e-3, 2.8e-3]],
        }
    ],
    "run": {"end": {"time": 0.25}},
}


class LinearSprings:
    """Spheres that repel each other and the floor by springs with dashpots, without friction; all pairs are tested."""

    def __init__(self, simulation, floor=True):
        self.masses, self.radii, self.moments = simulation.masses[:, None], simulation.radii, simulation.moments
        self.gravity, self.size, self.floor, self.seconds = simulation.gravity, simulation.size, floor, 0.0

    def forces(self, position, velocity):
        """Contact forces (N), shape (n, 3)."""
        force, periodic = np.zeros_like(position), 3
        if self.floor:
            depth, periodic = self.radii - position[:, 2], 2
            force[:, 2] = np.where(depth > 0, np.maximum(0.0, STIFFNESS * depth - DAMPING * velocity[:, 2]), 0.0)
        branch = position[:, None] - position[None]
        edges = self.size[:periodic]
        branch[..., :periodic] -= edges * np.round(branch[..., :periodic] / edges)
        distance = np.linalg.norm(branch, axis=-1)
        np.fill_diagonal(distance, np.inf)
        depth = self.radii[:, None] + self.radii[None] - distance
        normal = branch / distance[..., None]
        approach = -np.einsum("ijk,ijk->ij", normal, velocity[:, None] - velocity[None])
        push = np.where(depth > 0, np.maximum(0.0, STIFFNESS * depth + DAMPING * approach), 0.0)
        return force + np.einsum("ij,ijk->ik", push, normal)

    def __call__(self, particles, loads, time_step):
        """Moves the particles by a time step (s) under loads that are constant in it, semi-implicitly."""
        dt, start = time_step / SUBSTEPS, time.perf_counter()
        for _ in range(SUBSTEPS):
            force = self.forces(particles.position, particles.velocity) + loads.force
            particles.velocity += dt * (force / self.masses + self.gravity)
            particles.position += dt * particles.velocity
            particles.angular_velocity += dt * loads.torque / self.moments
        self.seconds += time.perf_counter() - start


def compare(path, end):
    """Mean velocities (m/s) of the spheres of a case, periodic in all directions, at time `end` (s): native engine, DEM here."""
    case, means = tomllib.loads(Path(path).read_text()), []
    for name, engine in (("native engine", None), ("this DEM", LinearSprings(turbid.Simulation(case, engine="caller"), floor=False))):
        simulation, start = turbid.Simulation(case, engine=engine), time.perf_counter()
        simulation.run(end)
        cost = 1e3 * (time.perf_counter() - start) / simulation.steps
        means.append(simulation.velocities[:, 2].mean())
        dem = 1e3 * engine.seconds / simulation.steps if engine else 0.0
        print(f"{name}: {means[-1]:.6e} m/s after {simulation.steps} steps of {cost:.1f} ms, {dem:.1f} of them in Python")
    return means


def main(short=False):
    """Returns the simulation at its end."""
    of_case = turbid.Simulation(CASE, threads=1, engine="caller")
    simulation = turbid.Simulation(CASE, threads=1, engine=LinearSprings(of_case))

    def show(simulation):
        print(f"{simulation.time:.4f} s: heights", *np.round(1e3 * simulation.positions[:, 2], 4), "mm")

    simulation.run(0.02 if short else None, callback=show, every=96)
    return simulation


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="ends before the spheres have come to rest")
    parser.add_argument("--case", help="case of spheres in a periodic box, to compare with the native engine")
    parser.add_argument("--time", type=float, help="end of the case (s)")
    arguments = parser.parse_args()
    if arguments.case:
        compare(arguments.case, arguments.time)
    else:
        main(arguments.short)
