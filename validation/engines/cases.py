"""Runs cases with the program turbid, whose path is in the environment variable TURBID, and writes tables."""
import csv
import os
import subprocess
from pathlib import Path

HERE = Path(__file__).resolve().parent
ENGINES = HERE.parents[1] / "ffi/engines"


def numbers(values):
    """A list in TOML, to the last digit."""
    return "[" + ", ".join(repr(float(x)) for x in values) + "]"


def run(directory, text):
    """Runs a case in a directory; the output is in `out` there."""
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "case.toml").write_text(text)
    command = [os.environ.get("TURBID", "turbid"), "run", "case.toml", "--out", "out", "--overwrite", "--quiet", "--allow-engine"]
    return subprocess.run(command, cwd=directory, capture_output=True, text=True)


def paths(directory):
    """Rows of particle_series.csv as dictionaries of numbers, by particle."""
    found = {}
    with open(directory / "out/particle_series.csv") as file:
        for row in csv.DictReader(file):
            row = {name.split(" ")[0]: float(value) for name, value in row.items()}
            found.setdefault(int(row["id"]), []).append(row)
    return found


def write(name, columns, rows):
    """Writes a table beside this file."""
    with open(HERE / name, "w", newline="") as file:
        shown = [[f"{x:.9g}" if isinstance(x, float) else x for x in row] for row in rows]
        csv.writer(file, lineterminator="\n").writerows([columns, *shown])
