#!/usr/bin/env python3
"""Volume and principal moments of the clump of ten spheres of bodies.toml: exact along lines in z, a million of them. Plain Python 3.

Prints the row of reference.csv.
"""

import math

SPHERES = [
    (0.52, 0.48, 0.56, 0.75), (0.91, -0.76, -0.04, 0.8), (0.32, 0.65, -0.49, 0.88), (-0.55, 0.07, 0.09, 0.69),
    (-0.61, -0.36, 0.52, 0.51), (-0.74, 0.48, -0.46, 0.81), (-0.81, -0.81, 0.47, 0.75), (-0.61, 0.78, 0.47, 0.58),
    (1.0, 0.06, 0.22, 0.62), (0.95, 0.31, 0.59, 0.58),
]
LINES = 1000


def moments():
    """Integrals of 1, x, y, z, xx, yy, zz, xy, yz, zx over the union."""
    low = [min(s[a] - s[3] for s in SPHERES) for a in range(2)]
    high = [max(s[a] + s[3] for s in SPHERES) for a in range(2)]
    dx, dy = ((high[a] - low[a]) / LINES for a in range(2))
    sums = [0.0] * 10
    for i in range(LINES):
        x = low[0] + (i + 0.5) * dx
        near = [(y, z, r * r - (x - a) ** 2) for a, y, z, r in SPHERES if abs(x - a) < r]
        for j in range(LINES):
            y = low[1] + (j + 0.5) * dy
            ends = []
            for b, z, square in near:
                rest = square - (y - b) ** 2
                if rest > 0:
                    half = math.sqrt(rest)
                    ends.append((z - half, z + half))
            if not ends:
                continue
            ends.sort()
            done = -1e9
            for begin, end in ends:
                begin = max(begin, done)
                if begin >= end:
                    continue
                done = end
                length, first, second = end - begin, (end**2 - begin**2) / 2, (end**3 - begin**3) / 3
                terms = (length, x * length, y * length, first, x * x * length, y * y * length, second,
                         x * y * length, y * first, x * first)
                for n, term in enumerate(terms):
                    sums[n] += term
    return [s * dx * dy for s in sums]


def eigenvalues(a):
    """Of a symmetric matrix, by Jacobi's rotations."""
    for _ in range(100):
        p, q = max(((0, 1), (0, 2), (1, 2)), key=lambda pq: abs(a[pq[0]][pq[1]]))
        if abs(a[p][q]) < 1e-15:
            break
        t = 0.5 * math.atan2(2 * a[p][q], a[q][q] - a[p][p])
        c, s = math.cos(t), math.sin(t)
        for k in range(3):
            a[k][p], a[k][q] = c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]
        for k in range(3):
            a[p][k], a[q][k] = c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]
    return sorted(a[k][k] for k in range(3))


v, x, y, z, xx, yy, zz, xy, yz, zx = moments()
x, y, z = x / v, y / v, z / v
xx, yy, zz, xy, yz, zx = xx / v - x * x, yy / v - y * y, zz / v - z * z, xy / v - x * y, yz / v - y * z, zx / v - z * x
low, middle, high = eigenvalues([[yy + zz, -xy, -zx], [-xy, xx + zz, -yz], [-zx, -yz, xx + yy]])
print(f"clump of ten spheres,{v:.7g},{low:.7g},{middle:.7g},{high:.7g}")
