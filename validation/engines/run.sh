#!/bin/sh
# Cross-check of the engines: polyhedra.csv, inertia.csv and spheres.csv, their tables, and the figures. Three minutes on one core.
# Exit code 3 if one of the limits of README.md is missed; the results are written all the same.
#
# TURBID   the program, built with the feature `liggghts` if LIGGGHTS is to take part (default: target/release/turbid)
# OUT      directory that keeps the runs (default: out/validation/engines in the repository)
#
# Needs Debian's packages yade and liblammps0. Without LAMMPS spheres.py leaves it out.
set -u

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${OUT:-$root/out/validation/engines}
TURBID=${TURBID:-$root/target/release/turbid}
export TURBID
mkdir -p "$out"

code=0
# Debian's own Python, which has YADE, numpy, scipy and matplotlib.
/usr/bin/python3 "$here/polyhedra.py" "$out/polyhedra" || code=$?
/usr/bin/python3 "$here/spheres.py" "$out/spheres" || code=$?
/usr/bin/python3 "$here/figures.py" || code=$?
exit "$code"
