#!/usr/bin/env python3
"""Time of the stage `dem` with 100 000 spheres that lie in a box, with LIGGGHTS or LAMMPS in one process and in two.

    python3 validation/engines/parallel.py target/release/turbid           # half an hour on two quiet cores

The program needs the feature mpi, and liggghts. LAMMPS settles 10 000 spheres first, ten copies of which are the bed. Processes take turns.
"""
import argparse
import json
import math
import os
import statistics
import subprocess
import sys

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
sys.path.insert(0, os.path.join(ROOT, "validation/dry_speed"))

import run as dry_speed

COPIES = (5, 2)
# Copies of spheres at rest overlap by what their weight presses them together.
APART = 1.0006
BOX = [20 * 1.2 * dry_speed.DIAMETER, 20 * 1.2 * dry_speed.DIAMETER, 31 * dry_speed.DIAMETER]


def bed(path):
    """Writes the case, unless it is there."""
    if os.path.exists(path + ".toml"):
        return
    spheres = dry_speed.child(lambda: dry_speed.settled(BOX, 150000))
    copies = [
        [s[0] % BOX[0] + i * BOX[0], s[1] % BOX[1] + j * BOX[1], s[2]] for i in range(COPIES[0]) for j in range(COPIES[1]) for s in spheres
    ]
    size = [BOX[0] * COPIES[0], BOX[1] * COPIES[1], BOX[2]]
    size = [math.ceil(edge * APART / dry_speed.CELL) * dry_speed.CELL for edge in size]
    dry_speed.write_case(path, [[c * APART for c in s] + [0.0] * 3 for s in copies], size, True)


def measured(program, path, engine, processes, steps):
    """Time (s) of the stage `dem` in a step, and the largest part of it that a rank spends on messages of Turbid."""
    command = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n", str(processes), program, "bench", path + ".toml"]
    command += ["--set", f"dem.engine={engine}", "--set", f"dem.{engine}.process=own", "--set", "particles.0.overlaps=refuse"]
    command += ["--steps", str(steps), "--warm-up", str(steps), "--json"]
    environment = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout)
    time = report["stages_over_ranks"]["dem"]["max"]
    return time, max(rank["exchange"]["seconds"] / time for rank in report["by_rank"])


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("program", nargs="?", default=os.path.join(ROOT, "target/release/turbid"))
    options.add_argument("--pairs", type=int, default=3)
    options.add_argument("--steps", type=int, default=80)
    options.add_argument("--engines", default="liggghts,lammps")
    options.add_argument("--out", default=os.path.join(ROOT, "out/validation/engines"))
    options = options.parse_args()
    os.makedirs(options.out, exist_ok=True)
    path = os.path.join(options.out, "bed-1e5")
    bed(path)
    for engine in options.engines.split(","):
        ratios = []
        for _ in range(options.pairs):
            (one, _), (two, share) = (measured(options.program, path, engine, n, options.steps) for n in (1, 2))
            ratios.append(one / two)
            print(f"{engine}: {one:.4f} s, in two processes {two:.4f} s, ratio {ratios[-1]:.2f}, messages {100 * share:.1f} %", flush=True)
        print(f"{engine}: median ratio {statistics.median(ratios):.2f}", flush=True)


main()
