#!/usr/bin/env python3
"""Cost of walls from meshes: pairs of `turbid bench` in turn, and the median of their ratios.

dry     a bed of 1e4 spheres in a square vessel: 1e4 facets over five planes, time of a step
fluid   flow through a pipe of 512 facets over flow in a periodic box as long, time of a step per open cell
"""
import argparse
import json
import math
import os
import statistics
import subprocess
import tempfile

DIAMETER, HALF, HEIGHT = 1e-3, 11.5e-3, 60e-3
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
mesh = { file = "vessel.stl", position = [0.013, 0.013, 0.001] }
"""
PLANES = "".join(
    f'[[walls]]\nname = "{name}"\nplane = {{ point = {point}, normal = {normal} }}\n'
    for name, point, normal in [
        ("floor", [0, 0, 0.001], [0, 0, 1]),
        ("left", [0.013 - HALF, 0, 0], [1, 0, 0]),
        ("right", [0.013 + HALF, 0, 0], [-1, 0, 0]),
        ("front", [0, 0.013 - HALF, 0], [0, 1, 0]),
        ("back", [0, 0.013 + HALF, 0], [0, -1, 0]),
    ]
)
FLUID = """[domain]
size = [{length}, 0.0128, 0.0128]
periodic = [true, true, true]
[fluid]
density = 1000
viscosity = 1e-6
precision = "{precision}"
[lattice]
cells_per_diameter = {resolution}
relaxation_time = 0.8
{walls}
[[particles]]
shape = {{ sphere = {{ diameter = 8e-4 }} }}
density = 1000
list = [{{ position = [0, 0.0064, 0.0064] }}]
[driving]
body_acceleration = [1e-6, 0, 0]
[run]
end = {{ steps = 1000000 }}
"""
# Part of the box in the pipe.
OPEN = math.pi * 0.0063 ** 2 / 0.0128 ** 2
PIPE = """[[walls]]
name = "pipe"
mesh = { file = "pipe.stl", position = [0, 0.0064, 0.0064], orientation = { axis = [0, 1, 0], angle = 90 }, side = "inside" }
"""


def stl(path, facets):
    """Writes facets of three corners as text STL."""
    with open(path, "w", encoding="ascii") as file:
        file.write("solid wall\n")
        for corners in facets:
            text = "".join("vertex {:.9g} {:.9g} {:.9g}\n".format(*corner) for corner in corners)
            file.write(f"facet normal 0 0 0\nouter loop\n{text}endloop\nendfacet\n")
        file.write("endsolid\n")


def revolution(rings, strips):
    """Facets through rings of (radius, height) about z; those of radius 0 are tips."""
    at = lambda ring, k: (ring[0] * math.cos(2 * math.pi * k / strips), ring[0] * math.sin(2 * math.pi * k / strips), ring[1])
    for low, high in zip(rings, rings[1:]):
        for k in range(strips):
            a, b, c, d = at(low, k), at(low, k + 1), at(high, k + 1), at(high, k)
            yield from ([(a, b, c)] if low[0] > 0 else []) + ([(a, c, d)] if high[0] > 0 else [])


def rectangle(corner, one, other, parts):
    """Facets of a rectangle, of this number of parts along its edges from a corner."""
    at = lambda i, j: tuple(corner[n] + one[n] * i / parts[0] + other[n] * j / parts[1] for n in range(3))
    for i in range(parts[0]):
        for j in range(parts[1]):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            yield from ((a, b, c), (a, c, d))


def vessel(across, up):
    """Facets of the floor and the sides of the vessel."""
    x, y, z = (2 * HALF, 0, 0), (0, 2 * HALF, 0), (0, 0, HEIGHT)
    low = (-HALF, -HALF, 0)
    yield from rectangle(low, x, y, (across, across))
    for corner, along in [(low, x), (low, y), ((-HALF, HALF, 0), x), ((HALF, -HALF, 0), y)]:
        yield from rectangle(corner, along, z, (across, up))


def spheres(path):
    """Writes a loose grid of 1e4 spheres in the vessel."""
    pitch, rows = 1.06 * DIAMETER, []
    most, layer = int((HALF - 0.6 * DIAMETER) / pitch), 0
    while len(rows) < 10000:
        for i in range(-most, most + 1):
            for j in range(-most, most + 1):
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
    parser.add_argument("--finer", type=int, default=1, help="factor on the 126 cells across the pipe, which is made shorter by the same factor")
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
            # 22 parts across and 52 up: 10 120 facets.
            stl("vessel.stl", vessel(22, 52))
            write("dry_mesh.toml", DRY.format(walls=VESSEL, diameter=DIAMETER))
            write("dry_planes.toml", DRY.format(walls=PLANES, diameter=DIAMETER))
            pairs.append(("dry, 1e4 facets", "dry_mesh.toml", "dry_planes.toml", 100, options.settle, 1))
        if options.only != "dry":
            ends = [-0.001, 0.0138]
            stl("pipe.stl", revolution([(0, ends[0]), (0.0063, ends[0]), (0.0063, ends[1]), (0, ends[1])], 128))
            for precision in ("f32", "f64"):
                for name, walls in (("mesh", PIPE), ("open", "")):
                    text = FLUID.format(walls=walls, precision=precision, length=0.0128 / options.finer, resolution=8 * options.finer)
                    write(f"fluid_{precision}_{name}.toml", text)
                pairs.append((f"fluid, {precision}", f"fluid_{precision}_mesh.toml", f"fluid_{precision}_open.toml", 20, 150, 2))
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
