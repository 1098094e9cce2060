#!/bin/sh
# Cross-check of the engines, and of programs that drive Turbid: ENGINE.csv and ENGINE.png, and drivers.txt. Ten minutes on one core.
# Exit code 3 if a check misses its tolerance; the results are written all the same.
#
# ENGINES  those to take: lammps yade python, and with a program that has it liggghts (default: the first three)
# TURBID   the program (default: target/release/turbid)
# DRIVER   ffi/c/examples/settling, if it has been built; PYTHON, a Python that has the package turbid
# OUT      directory that keeps the runs (default: out/validation/engines in the repository)
#
# Needs Debian's packages yade and liblammps0.
set -u

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
out=${OUT:-$root/out/validation/engines}
turbid=${TURBID:-$root/target/release/turbid}
mkdir -p "$out"

code=0
for engine in ${ENGINES:-lammps yade python}; do
    "$turbid" crosscheck --engine "$engine" --out "$out/$engine" > "$out/$engine.txt" || code=$?
    tail -n 1 "$out/$engine.txt"
    for kind in csv png; do
        cp "$out/$engine/crosscheck.$kind" "$here/$engine.$kind" || code=$?
    done
done

# Velocity at 5 t* and cost of a step, by the native engine and by a DEM in C and in Python.
case=$root/cases/hindered_settling.toml
{
    if [ -n "${DRIVER:-}" ]; then
        echo "native: $("$DRIVER" 0.02321 "$case" native)" || code=$?
        echo "C:      $("$DRIVER" 0.02321 "$case")" || code=$?
    fi
    if [ -n "${PYTHON:-}" ]; then
        "$PYTHON" "$root/examples/python/own_dem.py" --case "$case" --time 0.02321 || code=$?
    fi
} > "$out/drivers.txt"
if [ -s "$out/drivers.txt" ]; then
    cp "$out/drivers.txt" "$here"
fi
exit "$code"
