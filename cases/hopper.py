#!/usr/bin/env python3
"""Writes a conical hopper as text STL, in millimetres: an open sheet, the outlet at z = 0 on the axis.

Usage: hopper.py [--outlet 18] [--diameter 50] [--angle 30] [--height 70] [--strips 32] [--output hopper.stl]

The committed `hopper.stl` is the output of `hopper.py` without arguments. Plain Python 3, nothing to install.
"""

import argparse
import math


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--outlet", type=float, default=18, help="diameter of the outlet")
    parser.add_argument("--diameter", type=float, default=50, help="diameter of the cylinder above the cone")
    parser.add_argument("--angle", type=float, default=30, help="angle of the cone from the vertical, degrees; 90 is a flat bottom")
    parser.add_argument("--height", type=float, default=70, help="height of all of it")
    parser.add_argument("--strips", type=int, default=32, help="facets round it")
    parser.add_argument("--output", default="hopper.stl")
    options = parser.parse_args()

    narrow, wide = options.outlet / 2, options.diameter / 2
    neck = (wide - narrow) / math.tan(math.radians(options.angle)) if options.angle < 90 else 0.0
    profile = [(narrow, 0.0), (wide, neck), (wide, options.height)]

    def corner(level, strip):
        radius, z = profile[level]
        turn = 2 * math.pi * strip / options.strips
        return "  vertex {:.6f} {:.6f} {:.6f}\n".format(radius * math.cos(turn), radius * math.sin(turn), z)

    with open(options.output, "w", encoding="ascii") as file:
        file.write("solid hopper, millimetres\n")
        for level in range(2):
            for strip in range(options.strips):
                after = (strip + 1) % options.strips
                a, b, c, d = (level, strip), (level + 1, strip), (level + 1, after), (level, after)
                for triangle in ((a, b, c), (a, c, d)):
                    corners = "".join(corner(*place) for place in triangle)
                    file.write(f"facet normal 0 0 0\n outer loop\n{corners} endloop\nendfacet\n")
        file.write("endsolid hopper\n")


if __name__ == "__main__":
    main()
