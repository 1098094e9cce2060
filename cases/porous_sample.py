#!/usr/bin/env python3
"""Writes a porous sample of round grains, some of which overlap, as text OBJ in millimetres: a closed surface for each grain.

Usage: porous_sample.py [--seed 1] [--grains 16] [--output porous_sample.obj]

The committed `porous_sample.obj` is the output of `porous_sample.py` without arguments. Plain Python 3, nothing to install.
"""

import argparse
import math
import random

# Edges of the sample, along x, y and z, and least distance of two centres over the sum of the radii.
SIZE = (3.0, 3.0, 3.0)
NEAREST = 0.85


def icosphere():
    """Corners of an icosahedron whose facets are halved once, on the unit sphere, and its facets."""
    golden = 0.5 * (1 + math.sqrt(5))
    corners = []
    for a in (-1, 1):
        for b in (-golden, golden):
            corners += [(0, a, b), (a, b, 0), (b, 0, a)]
    edge = 2.0 + 1e-9
    near = lambda i, j: math.dist(corners[i], corners[j]) < edge
    facets = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near(i, j) and near(j, k) and near(k, i)
    ]
    middles = {}

    def middle(i, j):
        pair = (min(i, j), max(i, j))
        if pair not in middles:
            middles[pair] = len(corners)
            corners.append(tuple(0.5 * (a + b) for a, b in zip(corners[i], corners[j])))
        return middles[pair]

    finer = []
    for i, j, k in facets:
        a, b, c = middle(i, j), middle(j, k), middle(k, i)
        finer += [(i, a, c), (j, b, a), (k, c, b), (a, b, c)]
    corners = [tuple(x / math.hypot(*corner) for x in corner) for corner in corners]

    def outwards(facet):
        a, b, c = (corners[n] for n in facet)
        u, v = [[q - p for p, q in zip(a, other)] for other in (b, c)]
        normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        inwards = sum(n * p for n, p in zip(normal, a)) < 0
        return (facet[0], facet[2], facet[1]) if inwards else facet

    return corners, [outwards(facet) for facet in finer]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--grains", type=int, default=16)
    parser.add_argument("--output", default="porous_sample.obj")
    given = parser.parse_args()
    rng = random.Random(given.seed)
    grains = []
    while len(grains) < given.grains:
        radius = rng.uniform(0.45, 0.7)
        centre = [rng.uniform(0.6 * radius, edge - 0.6 * radius) for edge in SIZE]
        if all(math.dist(centre, other) > NEAREST * (radius + r) for other, r in grains):
            grains.append((centre, radius))
    corners, facets = icosphere()
    with open(given.output, "w", encoding="ascii") as file:
        file.write(f"# {given.grains} grains, millimetres, written by porous_sample.py\n")
        for n, (centre, radius) in enumerate(grains):
            file.write(f"o grain{n}\n")
            for corner in corners:
                file.write("v " + " ".join(f"{c + radius * x:.4f}" for c, x in zip(centre, corner)) + "\n")
            for facet in facets:
                file.write("f " + " ".join(str(n * len(corners) + i + 1) for i in facet) + "\n")


if __name__ == "__main__":
    main()
