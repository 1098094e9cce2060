#!/usr/bin/env python3
"""Draws polyhedra.png and spheres.png from the tables beside this file. Needs matplotlib."""
import csv
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

HERE = Path(__file__).resolve().parent


def table(name):
    with open(HERE / name) as file:
        return list(csv.DictReader(file))


def polyhedra():
    rows = table("polyhedra.csv")
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4), sharey=True, constrained_layout=True)
    for axis, quantity in zip(axes, ("volume", "centroid")):
        for pair, marker in (("Turbid - YADE", "o"), ("YADE - Qhull", "x")):
            values = [max(float(row[f"{quantity}, {pair} (-)"]), 1e-17) for row in rows]
            axis.semilogy(range(len(rows)), values, marker, markersize=3, label=pair)
        if quantity == "volume":
            placed = [max(float(row["volume, YADE placed at once (-)"]), 1e-17) for row in rows]
            axis.semilogy(range(len(rows)), placed, ".", color="0.7", markersize=3, label="YADE placed at once - Qhull")
        axis.axhline(1e-6, color="k", linewidth=0.8, label="tolerance")
        axis.set(title=quantity, xlabel="pair (100 of cubes, 100 of irregular polyhedra)")
        axis.legend(fontsize=8)
    axes[0].set_ylabel("relative difference")
    figure.savefig(HERE / "polyhedra.png", dpi=110)


def spheres():
    rows = table("spheres.csv")
    engines = list(dict.fromkeys(row["engine"] for row in rows))
    quantities = list(dict.fromkeys(row["quantity"] for row in rows))[::-1]
    figure, axis = pyplot.subplots(figsize=(9, 7), constrained_layout=True)
    for n, engine in enumerate(engines):
        own = [row for row in rows if row["engine"] == engine]
        off = [max(abs(float(row["deviation from theory"])), 1e-15) for row in own]
        axis.semilogx(off, [quantities.index(row["quantity"]) + 0.12 * (n - 2) for row in own], "o", markersize=4, label=engine)
    limits = {row["quantity"]: float(row["tolerance"]) for row in rows}
    axis.semilogx([min(limits[q], 1) for q in quantities], range(len(quantities)), "k|", markersize=12, label="tolerance (1: none)")
    axis.set_yticks(range(len(quantities)), quantities, fontsize=8)
    axis.set_xlabel("deviation from theory")
    axis.legend(fontsize=8)
    figure.savefig(HERE / "spheres.png", dpi=110)


polyhedra()
spheres()
