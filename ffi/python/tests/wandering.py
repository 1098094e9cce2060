"""Spheres that a DEM in several processes moves, which drive Turbid on their communicator; alone without MPI.

    mpirun -n 3 python wandering.py CASE.json STEPS

The DEM has slabs of its own: a process moves the spheres in its slab, so that they go from one to another as they settle. Prints the
positions and velocities of all in hexadecimal digits, and how often a process got a sphere.
"""

import json
import sys

import numpy as np

import turbid

with open(sys.argv[1]) as file:
    case = json.load(file)
if sys.argv[3:] == ["alone"]:
    comm, rank, ranks = None, 0, 1
else:
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
    rank, ranks = comm.rank, comm.size
simulation = turbid.Simulation(case, engine="caller", comm=comm)
slab = simulation.size[2] / ranks


def all_of(rows: np.ndarray) -> np.ndarray:
    """The rows of all processes, ascending by id."""
    rows = rows if comm is None else np.concatenate(comm.allgather(rows))
    return rows[np.argsort(rows["id"])]


def mine(states: np.ndarray) -> np.ndarray:
    """Those in the slab of this process."""
    place = np.minimum((states["position"][:, 2] // slab).astype(int), ranks - 1)
    return states[place == rank]


states = mine(all_of(np.asarray(simulation.particles)))
simulation.particles = states
moves = 0
for _ in range(int(sys.argv[2])):
    simulation.step()
    mass, dt = simulation.masses, simulation.time_step
    states["velocity"] += dt * (simulation.loads["force"] / mass[:, None] + simulation.gravity)
    states["position"] += dt * states["velocity"]
    whole = all_of(states)
    whole["position"][:, 2] %= simulation.size[2]
    before, states = states["id"], mine(whole)
    moves += int((~np.isin(states["id"], before)).sum())
    simulation.particles = states
(x, y, z), (u, v, w) = simulation.block
fields = simulation.fields()
assert fields.pressure.shape == (u - x, v - y, w - z)
speed = float(fields.velocity.astype(float).sum()) if comm is None else comm.allreduce(float(fields.velocity.astype(float).sum()))
total = moves if comm is None else comm.allreduce(moves)
if rank == 0:
    print([number.hex() for number in np.concatenate([whole["position"], whole["velocity"]]).ravel().tolist()])
    print(f"{speed:.9e}", simulation.state_hash)
    print("moves", total)
else:
    simulation.state_hash
