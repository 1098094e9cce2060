"""A DEM in Python moves the particles, and Turbid is its fluid: spheres with linear springs settle on a floor.

``python examples/python/own_dem.py`` prints the heights of the spheres; ``--short`` ends before they have come to rest.
"""

import argparse

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
    """Spheres that repel each other and the floor by springs with dashpots, without friction."""

    def __init__(self, masses, radii, moments, gravity, size):
        self.masses, self.radii, self.moments = masses[:, None], radii, moments
        self.gravity, self.size = gravity, size

    def forces(self, position, velocity):
        """Contact forces (N), shape (n, 3)."""
        depth = self.radii - position[:, 2]
        force = np.zeros_like(position)
        force[:, 2] = np.where(depth > 0, np.maximum(0.0, STIFFNESS * depth - DAMPING * velocity[:, 2]), 0.0)
        branch = position[:, None] - position[None]
        branch[..., :2] -= self.size[:2] * np.round(branch[..., :2] / self.size[:2])
        distance = np.linalg.norm(branch, axis=-1)
        np.fill_diagonal(distance, np.inf)
        depth = self.radii[:, None] + self.radii[None] - distance
        normal = branch / distance[..., None]
        approach = -np.einsum("ijk,ijk->ij", normal, velocity[:, None] - velocity[None])
        push = np.where(depth > 0, np.maximum(0.0, STIFFNESS * depth + DAMPING * approach), 0.0)
        return force + np.einsum("ij,ijk->ik", push, normal)

    def __call__(self, particles, loads, time_step):
        """Moves the particles by a time step (s) under loads that are constant in it, semi-implicitly."""
        dt = time_step / SUBSTEPS
        for _ in range(SUBSTEPS):
            force = self.forces(particles.position, particles.velocity) + loads.force
            particles.velocity += dt * (force / self.masses + self.gravity)
            particles.position += dt * particles.velocity
            particles.angular_velocity += dt * loads.torque / self.moments


def main(short=False):
    """Returns the simulation at its end."""
    simulation = turbid.Simulation(CASE, threads=1, engine="caller")
    of_case = (simulation.masses, simulation.radii, simulation.moments, simulation.gravity, simulation.size)
    simulation = turbid.Simulation(CASE, threads=1, engine=LinearSprings(*of_case))

    def show(simulation):
        print(f"{simulation.time:.4f} s: heights", *np.round(1e3 * simulation.positions[:, 2], 4), "mm")

    simulation.run(0.02 if short else None, callback=show, every=96)
    return simulation


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--short", action="store_true", help="ends before the spheres have come to rest")
    main(**vars(parser.parse_args()))
