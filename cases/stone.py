#!/usr/bin/env python3
"""Writes an irregular convex stone as text STL, in millimetres, with the volume of a sphere of 1 mm diameter.

Usage: stone.py [--seed 1] [--facets 18] [--output stone.stl]

A stone is what random planes leave of space: like a crushed grain, it has flat faces with several corners each.
The committed `stone.stl` is the output of `stone.py` without arguments. Plain Python 3, nothing to install.
"""

import argparse
import itertools
import math
import random


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def spread_normals(count, rng):
    """Unit vectors, no two close together: each is the loneliest of ten."""
    found = []
    while len(found) < count:
        trials = []
        for _ in range(10):
            v = [rng.gauss(0, 1) for _ in range(3)]
            length = math.sqrt(dot(v, v))
            trials.append(tuple(x / length for x in v))
        found.append(min(trials, key=lambda v: max((dot(v, u) for u in found), default=0)))
    return found


def stone(seed, planes):
    """Faces as lists of corners, counter-clockwise seen from outside."""
    rng = random.Random(seed)
    axes = (1.0, rng.uniform(0.75, 0.9), rng.uniform(0.6, 0.75))
    normals = spread_normals(planes, rng)
    # Tangent to an ellipsoid, moved in or out a little.
    offsets = [math.sqrt(sum((a * x) ** 2 for a, x in zip(axes, n))) * rng.uniform(0.85, 1.15) for n in normals]
    corners = [[] for _ in normals]
    for i, j, k in itertools.combinations(range(planes), 3):
        jk, ki, ij = cross(normals[j], normals[k]), cross(normals[k], normals[i]), cross(normals[i], normals[j])
        det = dot(normals[i], jk)
        if abs(det) < 1e-9:
            continue
        corner = tuple((offsets[i] * jk[a] + offsets[j] * ki[a] + offsets[k] * ij[a]) / det for a in range(3))
        if all(dot(n, corner) <= d + 1e-9 for n, d in zip(normals, offsets)):
            for plane in (i, j, k):
                corners[plane].append(corner)
    faces = []
    for normal, face in zip(normals, corners):
        if len(face) < 3:
            continue  # cut off by the others
        middle = tuple(sum(c[a] for c in face) / len(face) for a in range(3))
        first = tuple(face[0][a] - middle[a] for a in range(3))
        second = cross(normal, first)

        def angle(corner):
            d = tuple(corner[a] - middle[a] for a in range(3))
            return math.atan2(dot(d, second) * math.sqrt(dot(first, first) / dot(second, second)), dot(d, first))

        faces.append(sorted(face, key=angle))
    return faces


def triangles(faces):
    for face in faces:
        for b, c in zip(face[1:], face[2:]):
            yield face[0], b, c


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--facets", type=int, default=18, help="number of planes, some of which may be cut off (default 18)")
    parser.add_argument("--output", default="stone.stl")
    options = parser.parse_args()

    faces = stone(options.seed, options.facets)
    volume = sum(dot(a, cross(b, c)) for a, b, c in triangles(faces)) / 6
    scale = (math.pi / 6 / volume) ** (1 / 3)
    name = f"stone, millimetres, volume of a sphere of 1 mm diameter, stone.py --seed {options.seed} --facets {options.facets}"
    with open(options.output, "w", encoding="ascii") as file:
        file.write(f"solid {name}\n")
        for triangle in triangles(faces):
            a, b, c = triangle
            normal = cross([b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)])
            length = math.sqrt(dot(normal, normal))
            file.write("facet normal {:.6f} {:.6f} {:.6f}\n outer loop\n".format(*(x / length for x in normal)))
            for corner in triangle:
                file.write("  vertex {:.8f} {:.8f} {:.8f}\n".format(*(x * scale for x in corner)))
            file.write(" endloop\nendfacet\n")
        file.write("endsolid stone\n")
    print(f"{options.output}: {len(faces)} faces, {len(list(triangles(faces)))} triangles")


if __name__ == "__main__":
    main()
