#!/usr/bin/env python3
"""Dry spheres: Turbid against LAMMPS (`gran/hertz/history`) from the same positions and velocities, on one core, in turn."""
import argparse
import ctypes
import json
import math
import os
import random
import subprocess
import time

os.environ.setdefault("OMPI_MCA_ess_singleton_isolated", "1")
ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
DIAMETER, DENSITY, MODULUS, POISSON, FRICTION, RESTITUTION = 1e-3, 2500.0, 5e6, 0.25, 0.3, 0.9
SPEED, GRAVITY, CELL = 0.3, 9.81, 0.25 * DIAMETER
MASS, E_STAR = DENSITY * math.pi / 6 * DIAMETER ** 3, MODULUS / 2 / (1 - POISSON ** 2)
# A 50th of an impact at SPEED, deepest at DEEPEST; the damping that takes the energy of RESTITUTION from it, to first order.
STEP = 2.87 * ((MASS / 2) ** 2 / (DIAMETER / 4 * E_STAR ** 2 * SPEED)) ** 0.2 / 50
DEEPEST = (15 / 16 * MASS / 2 * SPEED ** 2 / E_STAR / math.sqrt(DIAMETER / 4)) ** 0.4
DAMPING = (1 - RESTITUTION ** 2) * SPEED / (4 * 0.46 * math.sqrt(DIAMETER / 4) * DEEPEST ** 1.5)

def lattice(edges, spacing, seed):
    """Spheres on a cubic lattice, shifted and set in motion at random, with the size of the box (m)."""
    draw = random.Random(seed)
    shift = 0.4 * (spacing - DIAMETER)
    places = [[i, j, k] for k in range(edges[2]) for j in range(edges[1]) for i in range(edges[0])]
    draw.shuffle(places)
    at = lambda place: [(c + 0.5) * spacing + draw.uniform(-shift, shift) for c in place]
    return [at(place) + [draw.gauss(0.0, 0.1) for _ in range(3)] for place in places], [n * spacing for n in edges]

class Lammps:
    """Positions and velocities of spheres in a box; walls and gravity if it is a bed."""

    def __init__(self, spheres, size, is_bed):
        self.library = ctypes.CDLL("liblammps.so.0")
        for name in ("lammps_open_no_mpi", "lammps_extract_atom"):
            getattr(self.library, name).restype = ctypes.c_void_p
        arguments = (ctypes.c_char_p * 5)(b"lammps", b"-log", b"none", b"-screen", b"none")
        self.lammps, n = ctypes.c_void_p(self.library.lammps_open_no_mpi(5, arguments, None)), len(spheres)
        law = f"{4 / 3 * E_STAR!r} {2 * MODULUS / (2 - POISSON) / (1 + POISSON)!r} {DAMPING!r} NULL {FRICTION} 1"
        edges = " ".join(f"0 {edge!r}" for edge in size)
        # `sort` is LAMMPS's own choice: atoms near each other lie near each other in memory.
        self.command("units si", "atom_style sphere", "newton off", "boundary p p f" if is_bed else "boundary p p p",
                     "comm_modify vel yes", f"region box block {edges} units box", "create_box 1 box")
        ids, types = ((ctypes.c_int * n)(*numbers) for numbers in (range(1, n + 1), [1] * n))
        x, v = ((ctypes.c_double * (3 * n))(*(c for s in spheres for c in s[at:at + 3])) for at in (0, 3))
        made = self.library.lammps_create_atoms(self.lammps, n, ids, types, x, v, None, 0)
        assert made == n, f"LAMMPS made {made} atoms of {n}"
        self.command(f"set group all diameter {DIAMETER} density {DENSITY}", f"neighbor {0.1 * DIAMETER} bin",
                     "neigh_modify delay 0 every 1 check yes", f"pair_style gran/hertz/history {law}", "pair_coeff * *",
                     "fix motion all nve/sphere", f"timestep {STEP!r}", "thermo 1000000000")
        if is_bed:
            self.command(f"fix weight all gravity {GRAVITY} vector 0 0 -1",
                         f"fix floor all wall/gran hertz/history {law} zplane 0 {size[2]!r}")
        self.count = n
        self.command("run 0 post no")

    def command(self, *lines):
        for line in lines:
            self.library.lammps_command(self.lammps, line.encode())

    def run(self, steps):
        start = time.perf_counter()
        self.command(f"run {steps} pre no post no")
        return (time.perf_counter() - start) / steps * 1e3

    def spheres(self):
        """Positions and velocities in the order of the ids, which is not that of LAMMPS's memory."""
        atom = lambda name: self.library.lammps_extract_atom(self.lammps, name)
        x, v = ((ctypes.c_double * (3 * self.count)).from_address(ctypes.c_void_p.from_address(atom(name)).value)
                for name in (b"x", b"v"))
        ids = (ctypes.c_int * self.count).from_address(atom(b"id"))
        return [x[3 * k:3 * k + 3] + v[3 * k:3 * k + 3] for _, k in sorted((tag, k) for k, tag in enumerate(ids))]

def write_case(path, spheres, size, is_bed):
    """A case of Turbid with the spheres in a table beside it."""
    with open(path + ".csv", "w") as table:
        table.write("x,y,z,vx,vy,vz\n")
        for s in spheres:
            table.write(",".join(map(repr, [x % edge for x, edge in zip(s, size)] + s[3:])) + "\n")
    with open(path + ".toml", "w") as case:
        case.write(f"""domain = {{ size = {size}, periodic = [true, true, {"false" if is_bed else "true"}] }}
dry = {{ time_step = {STEP!r} }}
driving = {{ gravity = {GRAVITY if is_bed else 0.0} }}
run = {{ end = {{ steps = 1000000 }}, threads = 1 }}
output = {{ directory = "{path}.out" }}
[contact]
law = "hertz"
youngs_modulus = {MODULUS}
poisson_ratio = {POISSON}
restitution = {RESTITUTION}
friction_static = {FRICTION}
friction_kinetic = {FRICTION}
[[particles]]
shape = {{ sphere = {{ diameter = {DIAMETER} }} }}
density = {DENSITY}
file = "{os.path.basename(path)}.csv"
{'overlaps = "relax"' if is_bed else ""}
""")

def turbid(program, case, steps, warm_up):
    command = [program, "bench", case, "--steps", str(steps), "--warm-up", str(warm_up), "--json"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return report["cells"] / report["mlups"] / 1e3, report["contacts"]

def child(work):
    """What `work` returns, from a process of its own: LAMMPS is one to a process."""
    read, write = os.pipe()
    if os.fork() == 0:
        with os.fdopen(write, "w") as pipe:
            json.dump(work(), pipe)
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        return json.loads(pipe.read())

def settled(size, steps=60000):
    """Spheres that lie in a box of 24 x 24 x 31 diameters."""
    spheres, _ = lattice([20, 20, 25], 1.2 * DIAMETER, 3)
    lammps = Lammps(spheres, size, True)
    lammps.command(f"fix drag all viscous {MASS / 0.01!r}")
    lammps.run(steps)
    return lammps.spheres()

def start(name):
    """Spheres, size of the box, steps to be timed, and before: a bed without overlaps, as Turbid wants it, sinks together again."""
    spacing = DIAMETER * (math.pi / 6 / 0.3) ** (1 / 3)
    if name == "bed-1e4":
        size = [20 * 1.2 * DIAMETER, 20 * 1.2 * DIAMETER, 31 * DIAMETER]
        return child(lambda: settled(size)), size, (500, 8000)
    edge = {"gas-1e4": 22, "gas-1e5": 46}[name]
    spheres, size = lattice([edge] * 3, spacing, 1)
    size = [math.ceil(length / CELL) * CELL for length in size]
    return spheres, size, (500, 500) if edge < 30 else (100, 100)

def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("programs", nargs="*", default=[os.path.join(ROOT, "target/release/turbid")])
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--cases", default="gas-1e4,gas-1e5,bed-1e4")
    options.add_argument("--out", default=os.path.join(ROOT, "out/validation/dry_speed"))
    options = options.parse_args()
    os.makedirs(options.out, exist_ok=True)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    best = lambda times: f"{min(times):.3f} ({sorted(times)[len(times) // 2]:.3f})"
    print("Time of a step (ms), best and (median); load", os.getloadavg()[0])
    print("| case | spheres | contacts | LAMMPS |" + "".join(f" {program} |" for program in options.programs), "speed over LAMMPS |")
    print("|---" * (5 + len(options.programs)) + "|")
    for name in options.cases.split(","):
        path = os.path.join(options.out, name)
        spheres, size, (steps, before) = start(name)
        write_case(path, spheres, size, name.startswith("bed"))

        def timed():
            lammps = Lammps(spheres, size, name.startswith("bed"))
            lammps.run(before)
            return [lammps.run(steps) for _ in range(5)]
        times = [[] for _ in range(1 + len(options.programs))]
        for _ in range(options.rounds):
            times[0] += child(timed)
            for program, mine in zip(options.programs, times[1:]):
                time_of_step, contacts = turbid(program, path + ".toml", steps, before)
                mine.append(time_of_step)
        speeds = ", ".join(f"{min(times[0]) / min(mine):.2f}" for mine in times[1:])
        print(f"| {name} | {len(spheres)} | {contacts} |", " | ".join(map(best, times)), f"| {speeds} |", flush=True)

if __name__ == "__main__":
    main()
