#!/usr/bin/env python3
"""Writes the positions of `dense.toml`: 39 hard spheres at a volume fraction of 0.551 in a periodic cube, disordered.

Soft spheres at random places are pushed apart until none overlap; then each is moved at random, 5000 times on average, without overlap
(Metropolis et al. 1953), so that they lie as in a fluid of hard spheres, which does not have the time to crystallise.

    validation/random_array/dense.py            prints the list (m)
"""

import random

# The diameter is a little more than 1, so that digits that are not written make no overlap.
COUNT, EDGE, SWEEPS, LEAST = 39, 40 / 12, 5000, 1.0002
random.seed(1)


def apart(a, b):
    return [d - EDGE * round(d / EDGE) for d in (p - q for p, q in zip(a, b))]


def square(a, b):
    return sum(d * d for d in apart(a, b))


def push_apart(places):
    """One step of steepest descent of the overlaps; returns the largest."""
    moves, worst = [[0.0] * 3 for _ in places], 0.0
    for i in range(COUNT):
        for j in range(i):
            line = apart(places[i], places[j])
            distance = sum(d * d for d in line) ** 0.5
            if distance < LEAST + 5e-4:
                worst = max(worst, LEAST - distance)
                for axis in range(3):
                    step = 0.3 * (LEAST + 5e-4 - distance) * line[axis] / distance
                    moves[i][axis] += step
                    moves[j][axis] -= step
    for place, move in zip(places, moves):
        for axis in range(3):
            place[axis] = (place[axis] + move[axis]) % EDGE
    return worst


places = [[EDGE * random.random() for _ in range(3)] for _ in range(COUNT)]
while push_apart(places) > 0.0:
    pass
for _ in range(SWEEPS * COUNT):
    i = random.randrange(COUNT)
    moved = [(p + random.uniform(-0.06, 0.06)) % EDGE for p in places[i]]
    if all(j == i or square(moved, places[j]) >= LEAST * LEAST for j in range(COUNT)):
        places[i] = moved
for place in places:
    print("    [" + ", ".join(f"{1.2e-3 * p:.7e}" for p in place) + "],")
