#!/usr/bin/env python3
"""Oblique impacts of an elastic sphere on a half-space of the same material: local angles of incidence and rebound of Maw, Barber and Fawcett (1976).

The contact of Hertz, Cattaneo and Mindlin is that of a row of independent springs (Popov and Hess 2015, Method of Dimensionality Reduction; Lyashenko and
Popov 2015, Sci. Rep. 5, 8479, doi:10.1038/srep08479, who find the curves of Maw et al. with it): spring x is pressed by u_z - x^2 / R, with the stiffnesses E* dx along and 4 G* dx
across the normal, sticks below mu times its own normal force and slips there. Units: the mass, E*, R and the normal speed are 1.

psi = 2 (1 - nu) / (mu (2 - nu)) v_t / v_n at the point of contact; psi_2 has the sign of psi_1 where the surface still moves forward. Usage: maw.py [springs [steps]]
"""
import sys

NU = 0.3
RATIO = 2 * (1 - NU) / (2 - NU)         # 4 G* / E* of two bodies of one material


def rebound(psi, springs, steps):
    """psi_2 of psi_1; it does not depend on mu."""
    depth = (15 / 16) ** 0.4
    dt = 2.943 * depth / steps
    widest = 1.01 * depth**0.5
    squares = [((k + 0.5) / springs * widest) ** 2 for k in range(springs)]
    dx = 2 * widest / springs           # both sides
    # The tangential deflection over mu / RATIO, so that it slips at the normal one.
    z, vz, vx = 0.0, 1.0, psi
    u = [0.0] * springs
    while True:
        z += vz * dt
        if z <= 0:
            return vx
        normal = across = 0.0
        step = vx * dt
        for k, square in enumerate(squares):
            p = z - square
            if p <= 0.0:
                u[k] = 0.0
                continue
            q = u[k] + step
            q = p if q > p else -p if q < -p else q
            u[k] = q
            normal += p
            across += q
        vz -= dt * normal * dx
        vx -= dt * 3.5 * RATIO * across * dx


if __name__ == "__main__":
    springs, steps = (int(word) for word in (sys.argv[1:] + ["400", "4000"][len(sys.argv) - 1 :]))
    print("psi_1,psi_2")
    for k in range(1, 21):
        print(f"{0.3 * k:.1f},{rebound(0.3 * k, springs, steps):.4f}", flush=True)
