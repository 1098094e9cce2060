#!/usr/bin/env python3
"""Writes a plate with square holes as text STL, in millimetres: a closed surface, its middle the origin, z upwards.

Usage: distributor_plate.py [--edge 6.4] [--thickness 0.4] [--holes 6] [--hole 0.5] [--output distributor_plate.stl]

The committed `distributor_plate.stl` is the output of `distributor_plate.py` without arguments. Plain Python 3, nothing to install.
"""

import argparse


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edge", type=float, default=6.4)
    parser.add_argument("--thickness", type=float, default=0.4)
    parser.add_argument("--holes", type=int, default=6, help="along each edge")
    parser.add_argument("--hole", type=float, default=0.5, help="edge of a hole")
    parser.add_argument("--output", default="distributor_plate.stl")
    options = parser.parse_args()

    # Lines of a grid; fields with two odd indices are holes.
    spacing, count = options.edge / options.holes, 2 * options.holes + 1
    lines = [-options.edge / 2]
    for hole in range(options.holes):
        middle = (hole + 0.5) * spacing - options.edge / 2
        lines += [middle - options.hole / 2, middle + options.hole / 2]
    lines.append(options.edge / 2)
    low, high = -options.thickness / 2, options.thickness / 2

    def is_solid(i, j):
        return 0 <= i < count and 0 <= j < count and not (i % 2 and j % 2)

    triangles = []

    def rectangle(a, b, c, d):
        triangles.extend([(a, b, c), (a, c, d)])

    for i in range(count):
        for j in range(count):
            if not is_solid(i, j):
                continue
            (x0, x1), (y0, y1) = lines[i : i + 2], lines[j : j + 2]
            rectangle((x0, y0, high), (x1, y0, high), (x1, y1, high), (x0, y1, high))
            rectangle((x0, y0, low), (x0, y1, low), (x1, y1, low), (x1, y0, low))
            if not is_solid(i - 1, j):
                rectangle((x0, y0, low), (x0, y0, high), (x0, y1, high), (x0, y1, low))
            if not is_solid(i + 1, j):
                rectangle((x1, y0, low), (x1, y1, low), (x1, y1, high), (x1, y0, high))
            if not is_solid(i, j - 1):
                rectangle((x0, y0, low), (x1, y0, low), (x1, y0, high), (x0, y0, high))
            if not is_solid(i, j + 1):
                rectangle((x0, y1, low), (x0, y1, high), (x1, y1, high), (x1, y1, low))

    with open(options.output, "w", encoding="ascii") as file:
        file.write("solid plate, millimetres\n")
        for triangle in triangles:
            corners = "".join("  vertex {:.5g} {:.5g} {:.5g}\n".format(*at) for at in triangle)
            file.write(f"facet normal 0 0 0\n outer loop\n{corners} endloop\nendfacet\n")
        file.write("endsolid plate\n")


if __name__ == "__main__":
    main()
