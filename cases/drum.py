#!/usr/bin/env python3
"""Writes a drum with lifters along its wall as text STL, in millimetres: a closed surface, its axis is y, its middle the origin.

Usage: drum.py [--diameter 60] [--length 24] [--lifters 6] [--height 5] [--output drum.stl]

The committed `drum.stl` is the output of `drum.py` without arguments. Plain Python 3, nothing to install.
"""

import argparse
import math


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--diameter", type=float, default=60)
    parser.add_argument("--length", type=float, default=24)
    parser.add_argument("--lifters", type=int, default=6)
    parser.add_argument("--height", type=float, default=5, help="of a lifter")
    parser.add_argument("--output", default="drum.stl")
    options = parser.parse_args()

    # Angles (degrees) and radii of a lifter, which narrows inwards, and of the wall up to the next one.
    radius, spacing = options.diameter / 2, 360 / options.lifters
    profile = []
    for lifter in range(options.lifters):
        middle = lifter * spacing
        profile += [(middle - 5, radius), (middle - 3, radius - options.height), (middle + 3, radius - options.height)]
        strips = max(1, round((spacing - 10) / 5))
        profile += [(middle + 5 + (spacing - 10) * strip / strips, radius) for strip in range(strips)]

    ends = [-options.length / 2, options.length / 2]

    def corner(number, end):
        angle, reach = profile[number % len(profile)]
        return (reach * math.cos(math.radians(angle)), ends[end], reach * math.sin(math.radians(angle)))

    triangles = []
    for number in range(len(profile)):
        a, b, c, d = corner(number, 0), corner(number + 1, 0), corner(number + 1, 1), corner(number, 1)
        triangles += [(a, b, c), (a, c, d), ((0.0, ends[0], 0.0), b, a), ((0.0, ends[1], 0.0), d, c)]

    with open(options.output, "w", encoding="ascii") as file:
        file.write("solid drum, millimetres\n")
        for triangle in triangles:
            corners = "".join("  vertex {:.6f} {:.6f} {:.6f}\n".format(*at) for at in triangle)
            file.write(f"facet normal 0 0 0\n outer loop\n{corners} endloop\nendfacet\n")
        file.write("endsolid drum\n")


if __name__ == "__main__":
    main()
