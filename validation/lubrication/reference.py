#!/usr/bin/env python3
"""Exact forces and torques on spheres that slide and turn in a narrow gap, in the box of each row of rows.txt: exact.csv.

    python3 reference.py > exact.csv          needs numpy; a minute

Stokes flow in bispherical coordinates, m = 1 (Dean and O'Neill 1963, O'Neill 1964): p = mu Q cos f, u = (x p / mu + h) / 2 with harmonic
Q and h, whose coefficients follow from no slip and from div u = 0 on both surfaces, by least squares. Agrees with the tables
of Goldman, Cox and Brenner (1967) in all digits, and with Jeffrey and Onishi (1984).

Images in the box, to leading order. At a wall a sphere acts from afar by the moment m = int z f_x dA of its forces about its foot, and feels
the shear that all others and the upper wall cause (m of the sphere in this shear included). A pair acts like the dipole
int x f dA, and feels the gradient of the velocity in a cubic lattice of dipoles. By the reciprocal theorem m and the dipole also give the
forces and torques that a shear or a gradient causes.
"""
import numpy as np
from numpy.polynomial.legendre import leggauss
from pathlib import Path

PI = np.pi


def legendre(count, x):
    """P_n and its first three derivatives."""
    p = np.zeros((4, count, len(x)))
    p[0, 0], p[0, 1], p[1, 1] = 1, x, 1
    for n in range(1, count - 1):
        p[0, n + 1] = ((2 * n + 1) * x * p[0, n] - n * p[0, n - 1]) / (n + 1)
        for d in (1, 2, 3):
            p[d, n + 1] = p[d, n - 1] + (2 * n + 1) * p[d - 1, n]
    return p


class Gap:
    """Two unit spheres, or one and a wall, at a gap."""

    def __init__(self, gap, wall):
        self.wall = wall
        self.top = np.arccosh(1 + (gap if wall else 0.5 * gap))
        self.low = 0.0 if wall else self.top
        self.c = np.sinh(self.top)
        self.count = int(16 / self.top) + 24
        self.mu, self.weights = leggauss(int(1.25 * self.count) + 6)
        self.surfaces = [self.fields(xi) for xi in (self.top, -self.low)]
        rows = []
        for f in self.surfaces:
            scale = np.sqrt(f["q"] * self.weights)[:, None]
            rows += [f[k] * scale for k in "ABC"] + [f["D"] * scale * self.c / f["q"][:, None]]
        self.matrix = np.vstack(rows)
        self.size = np.linalg.norm(self.matrix, axis=0)
        self.size[self.size == 0] = 1
        self.svd = np.linalg.svd(self.matrix / self.size, full_matrices=False)

    def harmonics(self, xi):
        """Values and derivatives by r and z of all harmonic functions on a surface."""
        mu, c = self.mu, self.c
        sine, p, q = np.sqrt(1 - mu * mu), legendre(self.count, self.mu), np.cosh(xi) - self.mu
        root, h = np.sqrt(q), c / q
        z_xi, z_eta = c * (1 - np.cosh(xi) * mu) / q**2, -c * np.sinh(xi) * sine / q**2
        r_xi, r_eta = z_eta, -z_xi
        found = {}
        for m in (0, 1, 2):
            n = np.arange(m, self.count)
            norm = np.maximum(n, 1.0)[:, None] ** -m
            y = sine**m * p[m, m:] * norm
            y_eta = ((m * sine ** (m - 1) * mu * p[m, m:] if m else 0) - sine ** (m + 1) * p[m + 1, m:]) * norm
            for sign in (1, -1):
                e = np.exp((n + 0.5) * (sign * xi - (self.top if sign > 0 else self.low)))[:, None]
                f = root * e * y
                f_xi = np.sinh(xi) / (2 * root) * e * y + root * sign * (n[:, None] + 0.5) * e * y
                f_eta = sine / (2 * root) * e * y + root * e * y_eta
                value = f, (r_xi * f_xi + r_eta * f_eta) / h**2, (z_xi * f_xi + z_eta * f_eta) / h**2
                found.setdefault(m, []).append(value)
        return found, c * np.sinh(xi) / q, c * sine / q, q, h, sine

    def fields(self, xi):
        """u = (A cos f, B sin f, C cos f), its divergence D, p and gradients, of all unknowns on a surface."""
        of, z, r, q, h, sine = self.harmonics(xi)
        names = "A B C D p Ar Az Br Bz Cr Cz".split()
        columns = {name: [] for name in names}

        def add(**given):
            for name in names:
                columns[name].append(given.get(name, 0 * given["D"]))

        for f, fr, fz in of[0]:
            add(D=fr, A=f / 2, B=-f / 2, Ar=fr / 2, Az=fz / 2, Br=-fr / 2, Bz=-fz / 2)
        for f, fr, fz in of[2]:
            add(D=fr + 2 * f / r, A=f / 2, B=f / 2, Ar=fr / 2, Az=fz / 2, Br=fr / 2, Bz=fz / 2)
        for f, fr, fz in of[1]:
            add(D=2 * fz, C=f, Cr=fr, Cz=fz)
        for f, fr, fz in of[1]:
            a = dict(A=r * f / 2, Ar=(f + r * fr) / 2, Az=r * fz / 2)
            add(D=3 * f + r * fr + z * fz, p=f, C=z * f / 2, Cr=z * fr / 2, Cz=(f + z * fz) / 2, **a)
        fields = {name: np.vstack(column).T for name, column in columns.items()}
        centre = 0.0 if xi == 0 else self.c / np.tanh(xi)
        return fields | dict(z=z, r=r, q=q, h=h, sine=sine, centre=centre)

    def solve(self, k, motion):
        """Force and torque on each sphere and the moments z f_x and x f_z, as sphere k has the velocity "U" (1, 0, 0), "W" of a unit
        spin about y or "E" (z, 0, 0) on its surface."""
        right = []
        for n, f in enumerate(self.surfaces):
            z, to_centre = f["z"], f["z"] - f["centre"]
            along = {"U": 1 + 0 * z, "W": to_centre, "E": z}[motion]
            velocity = [along, -along, -f["r"] if motion == "W" else 0 * z]
            scale = np.sqrt(f["q"] * self.weights) * (n == k)
            right += [part * scale for part in velocity] + [0 * z]
        right = np.concatenate(right)
        u, s, v = self.svd
        keep = s > 1e-13 * s[0]
        x = v[keep].T @ ((u[:, keep].T @ right) / s[keep])
        error = np.linalg.norm(self.matrix / self.size @ x - right) / np.linalg.norm(right)
        assert error < 1e-5, error
        found = []
        for f in self.surfaces[: 1 if self.wall else 2]:
            g = {name: f[name] @ (x / self.size) for name in "A B C p Ar Az Br Bz Cr Cz".split()}
            r, to_centre = f["r"], f["z"] - f["centre"]
            f_r = (2 * g["Ar"] - g["p"]) * r + (g["Az"] + g["Cr"]) * to_centre
            f_f = (g["Br"] - (g["B"] + g["A"]) / r) * r + (g["Bz"] - g["C"] / r) * to_centre
            f_z = (g["Az"] + g["Cr"]) * r + (2 * g["Cz"] - g["p"]) * to_centre
            area = PI * r * f["h"] / f["sine"] * self.weights
            force, moments = np.sum(area * (f_r - f_f)), [np.sum(area * to_centre * (f_r - f_f)), np.sum(area * r * f_z)]
            found.append(np.array([force, moments[0] - moments[1], moments[0] + f["centre"] * force, moments[1]]))
        return found


def across_and_along(k, height, place):
    """Velocity at a point force between two plates less that above one, of one wave number: across the wave, and along it."""
    c, s = np.cosh, np.sinh
    across = s(k * place) * s(k * (height - place)) / (k * s(k * height)) - (1 - np.exp(-2 * k * place)) / (2 * k)

    def normal(z):  # Solutions for the normal velocity and their derivatives by k z.
        x = k * z
        rows = [c(x), s(x), x * c(x), x * s(x)], [s(x), c(x), c(x) + x * s(x), s(x) + x * c(x)]
        return np.array(rows + ([c(x), s(x), 2 * s(x) + x * c(x), 2 * c(x) + x * s(x)], [s(x), c(x), 3 * c(x) + x * s(x), 3 * s(x) + x * c(x)]))

    still, none = normal(0)[:2], np.zeros((2, 4))
    matrix = np.block([[still, none], [none, still], [normal(place), -normal(place - height)]])
    found = np.linalg.solve(matrix, np.array([0, 0, 0, 0, 0, 0, 1 / k, 0]))
    alone = (1 - np.exp(-2 * k * place) * (1 - 2 * k * place + 2 * (k * place) ** 2)) / (4 * k)
    return across, normal(place)[1] @ found[:4] - alone


def shear_of_images(length, height, place):
    """Shear at a sphere by a unit moment of each other one of a square lattice, and by the plate above all, where they act at this place
    above the wall: with the Green's function of Blake (1971) for one wall, by waves for what the other one adds."""
    step = 2 * PI / length
    count = int(16 / height / step) + 1
    total = -place * place / height
    for i in range(-count, count + 1):
        for j in range(-count, count + 1):
            k = step * np.hypot(i, j)
            if 0 < k * height <= 16:
                across, along = across_and_along(k, height, place)
                total += (i * i * along + j * j * across) / (i * i + j * j)
    x, y = length * np.array(np.meshgrid(*2 * [np.arange(-200, 201)])).reshape(2, -1)
    r = np.hypot(x, y)
    x, r = [part[(r > 0) & (r < 200 * length)] for part in (x, r)]
    away = np.sqrt(r * r + 4 * place * place)
    blake = 1 / r + x * x / r**3 - 1 / away - x * x / away**3 - 2 * place**2 * (1 / away**3 - 3 * x * x / away**5)
    further = 12 * PI * place**2 / (200 * length**3)
    return (total / length**2 + (np.sum(blake) + further) / (8 * PI)) / place**2


def gradient_of_images():
    """du_i/dx_l = K_iljk D_jk / (mu L^3) by dipoles D_jk = int f_j x_k dA in all other cells of a cubic lattice."""
    smooth, grid = 0.01, 2 * PI * np.arange(-14, 15)
    k = np.array(np.meshgrid(grid, grid, grid)).reshape(3, -1).T
    square = (k**2).sum(1)
    k, square = k[square > 0], square[square > 0]
    n, weight, one = k / np.sqrt(square)[:, None], np.exp(-smooth * square), np.eye(3)
    lattice = np.einsum("ij,p,pl,pk->iljk", one, weight, n, n) - np.einsum("p,pi,pj,pk,pl->iljk", weight, n, n, n, n)
    pairs = np.einsum("il,jk->iljk", one, one) + np.einsum("ij,lk->iljk", one, one) + np.einsum("ik,lj->iljk", one, one)
    return lattice - (np.einsum("ij,lk->iljk", one, one) / 3 - pairs / 15) * (4 * PI * smooth) ** -1.5


def at_wall(gap, length):
    """Force and torque of shear and spin in a box of this edge, between plates."""
    solved = Gap(gap, True)
    moved, turned, strained = [solved.solve(0, motion)[0] for motion in "UWE"]
    images, feet = shear_of_images(length, length, moved[2] / moved[0]), np.array([moved[2], turned[2]])
    resistance = -np.array([[moved[0], turned[0]], [moved[1], turned[1]]])
    resistance -= np.outer(feet, feet) * images / (1 + images * (4 / 3 * PI - strained[2]))
    return [resistance[0, 0] / 6 / PI, -resistance[1, 0] / 8 / PI, -resistance[0, 1] / 6 / PI, resistance[1, 1] / 8 / PI, np.nan]


def of_pair(gap, length, axis):
    """Force and torque of shear and spin, torque of roll of two spheres on which the fluid exerts no net force."""
    solved = Gap(gap, False)
    raw = {(k, motion): np.array(solved.solve(k, motion)) for k in (0, 1) for motion in "UW"}
    shear, spin = raw[0, "U"] - raw[1, "U"], raw[0, "W"] + raw[1, "W"]
    roll, along = raw[0, "W"] - raw[1, "W"], raw[0, "U"] + raw[1, "U"]
    roll = roll - along * roll[0, 0] / along[0, 0]
    across = np.cross(axis, [1, 0, 0])
    across /= np.linalg.norm(across)
    dipoles = [
        -np.outer(across, axis) * both[:, 2].sum() - np.outer(axis, across) * both[:, 3].sum() for both in (shear, spin)
    ]
    images = np.einsum("ail,iljk,bjk->ab", dipoles, gradient_of_images(), dipoles) / length**3
    force, torque = -(shear[0, 0] - shear[1, 0]) - images[0, 0], shear[:, 1].sum() + images[0, 1]
    return [
        force / 12 / PI, torque / 16 / PI, torque / 12 / PI, (-spin[:, 1].sum() - images[1, 1]) / 16 / PI, -roll[0, 1] / 8 / PI,
    ]  # fmt: skip


def main():
    print("# Computed by reference.py: forces over 6 pi mu a U, torques over 8 pi mu a^2 U, of a spin U = a w.")
    print("with,n,gap,room,oblique,shear_force,shear_torque,spin_force,spin_torque,roll_torque")
    done = set()
    for line in Path(__file__).with_name("rows.txt").read_text().splitlines():
        row = dict(pair.split("=") for pair in line.split()) if not line.startswith("#") else {}
        if row.get("motion", "squeeze") == "squeeze" or "stretch" in row:
            continue
        lists = [row.get(key, default).split(",") for key, default in (("with", "1"), ("n", "12"), ("gap", "1"), ("room", "4"), ("oblique", "0"))]
        for key in (tuple(values) for values in np.array(np.meshgrid(*lists, indexing="ij")).reshape(5, -1).T):
            if key in done:
                continue
            done.add(key)
            n, gap, room = map(float, key[1:4])
            length, gap = 2 * round(room * n) / n, 2 * gap / n
            axis = np.array([0.48, -0.6, 0.64] if key[4] == "1" else [0, 0, 1.0])
            values = at_wall(gap, length) if key[0] == "wall" else of_pair(gap, length, axis)
            print(",".join(key) + "," + ",".join(f"{value:.5f}" for value in values))


main()
