#!/usr/bin/env python3
"""Cost of walls from meshes: pairs of `turbid bench` in turn, and the median of their ratios.

dry     a bed of 1e4 spheres in a round vessel: 1e4 facets over a pipe and a floor, time of a step
fluid   flow through a pipe of 512 facets over flow in a periodic box as long, time of a step per open cell
"""
import argparse
import json
import math
import os
import statistics
import subprocess
import tempfile

DIAMETER, RADIUS, HEIGHT = 1e-3, 12.5e-3, 60e-3
DRY = """[domain]
size = [0.026, 0.026, 0.062]
periodic = [false, false, false]
[dry]
time_step = 1.5e-5
{walls}
[[particles]]
shape = {{ sphere = {{ diameter = {diameter} }} }}
density = 2500
file = "spheres.csv"
[contact]
law = "hertz"
friction = "mindlin"
youngs_modulus = 1e6
poisson_ratio = 0.25
restitution = 0.5
friction_static = 0.5
friction_kinetic = 0.5
[driving]
gravity = 9.81
[run]
end = {{ steps = 1000000 }}
"""
VESSEL = """[[walls]]
name = "vessel"
mesh = {{ file = "{file}", position = [0.013, 0.013, 0.001] }}
"""
ROUND = """[[walls]]
name = "vessel"
pipe = { point = [0.013, 0.013, 0], axis = [0, 0, 1], diameter = 0.025 }
[[walls]]
name = "floor"
plane = { point = [0, 0, 0.001], normal = [0, 0, 1] }
"""
FLUID = """[domain]
size = [{length}, 0.0128, 0.0128]
periodic = [true, true, true]
[fluid]
density = 1000
viscosity = 1e-6
precision = "{precision}"
[lattice]
cell_size = 1e-4
relaxation_time = 0.8
{walls}
[driving]
body_acceleration = [1e-3, 0, 0]
[run]
end = {{ steps = 1000000 }}
"""
# Part of the box in the pipe.
OPEN = math.pi * 0.0063 ** 2 / 0.0128 ** 2
PIPE = """[[walls]]
name = "pipe"
mesh = { file = "pipe.stl", position = [0, 0.0064, 0.0064], orientation = { axis = [0, 1, 0], angle = 90 }, side = "inside" }
"""


def revolution(path, rings, strips):
    """Writes rings of (radius, height) about z as text STL; those of radius 0 are tips."""
    at = lambda ring, k: (ring[0] * math.cos(2 * math.pi * k / strips), ring[0] * math.sin(2 * math.pi * k / strips), ring[1])
    with open(path, "w", encoding="ascii") as file:
        file.write("solid revolution\n")
        for low, high in zip(rings, rings[1:]):
            for k in range(strips):
                a, b, c, d = at(low, k), at(low, k + 1), at(high, k + 1), at(high, k)
                for corners in ([(a, b, c)] if low[0] > 0 else []) + ([(a, c, d)] if high[0] > 0 else []):
                    text = "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in corners)
                    file.write(f"facet normal 0 0 0\nouter loop\n{text}endloop\nendfacet\n")
        file.write("endsolid\n")


def spheres(path):
    """Writes a loose grid of 1e4 spheres in the vessel."""
    pitch, rows = 1.06 * DIAMETER, []
    most, layer = int(RADIUS / pitch), 0
    while len(rows) < 10000:
        for i in range(-most, most + 1):
            for j in range(-most, most + 1):
                if math.hypot(i, j) * pitch < RADIUS - 0.6 * DIAMETER:
                    shift = [0.02 * DIAMETER * math.sin(len(rows) * n) for n in (1, 2, 3)]
                    rows.append([0.013 + i * pitch + shift[0], 0.013 + j * pitch + shift[1], 0.001 + (layer + 0.6) * pitch + shift[2]])
        layer += 1
    with open(path, "w", encoding="ascii") as file:
        file.write("x,y,z\n")
        file.writelines("{:.9e},{:.9e},{:.9e}\n".format(*row) for row in rows[:10000])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turbid", default="target/release/turbid")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--settle", type=int, default=4000, help="steps of the bed before those that are timed")
    parser.add_argument("--only", choices=["dry", "fluid"])
    options = parser.parse_args()
    turbid = os.path.abspath(options.turbid)

    def seconds(case, steps, warm_up, threads):
        """Median time of a step (s)."""
        command = [turbid, "bench", case, "--json", "--steps", str(steps), "--warm-up", str(warm_up), "--threads", str(threads)]
        found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        return found["cells"] / (found["mlups"] * 1e6)

    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        write = lambda name, text: open(name, "w", encoding="ascii").write(text)
        pairs = []
        if options.only != "fluid":
            spheres("spheres.csv")
            heights = [HEIGHT * n / 20 for n in range(21)]
            # 20 rings of 244 strips, and the floor: 10 004 facets.
            revolution("vessel.stl", [(0, 0)] + [(RADIUS, height) for height in heights], 244)
            write("dry_mesh.toml", DRY.format(walls=VESSEL.format(file="vessel.stl"), diameter=DIAMETER))
            write("dry_round.toml", DRY.format(walls=ROUND, diameter=DIAMETER))
            pairs.append(("dry, 1e4 facets", "dry_mesh.toml", "dry_round.toml", 100, options.settle, 1))
        if options.only != "dry":
            ends = [-0.001, 0.0138]
            revolution("pipe.stl", [(0, ends[0]), (0.0063, ends[0]), (0.0063, ends[1]), (0, ends[1])], 128)
            for precision in ("f32", "f64"):
                for name, walls in (("mesh", PIPE), ("open", "")):
                    write(f"fluid_{precision}_{name}.toml", FLUID.format(walls=walls, precision=precision, length=0.0128))
                pairs.append((f"fluid, {precision}", f"fluid_{precision}_mesh.toml", f"fluid_{precision}_open.toml", 20, 20, 2))
        for name, mesh, base, steps, warm_up, threads in pairs:
            ratios, times = [], []
            for n in range(options.rounds):
                # Each is first in turn.
                order = (mesh, base) if n % 2 == 0 else (base, mesh)
                took = {case: seconds(case, steps, warm_up, threads) for case in order}
                ratios.append(took[mesh] / took[base])
                times.append(took[base])
            ratio = statistics.median(ratios)
            spread = f"{min(ratios):.3f} to {max(ratios):.3f} in {len(ratios)} pairs; {1e3 * statistics.median(times):.2f} ms without"
            if name.startswith("fluid"):
                print(f"{name}: speed per open cell {OPEN / ratio:.3f} of fluid alone, step {ratio:.3f} times as long ({spread})")
            else:
                print(f"{name}: step {ratio:.3f} times as long ({spread})")


if __name__ == "__main__":
    main()
