#!/bin/sh
# Force on spheres and spheroids held at a small gap while they move, with and without lubrication: result.csv and, as a table, result.md. Half
# an hour on two cores.
#
# OUT    directory for the two (default: this one)
# JOBS   runs at a time, each on one core (default: the number of cores)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
out=${OUT:-$here}
jobs=${JOBS:-$(getconf _NPROCESSORS_ONLN)}
cd "$here/../.."
cargo test --release --quiet --no-run --test lubrication
parts=$(mktemp -d)
trap 'rm -rf "$parts"' EXIT
mkdir -p "$out"

# Lists of what is computed, the longest first; the number decides the place in the table.
tables() {
    cat <<'LISTS'
03 n=20 tau=1.0 gap=1,0.5,0.25,0.1 room=5 oblique=1
01 n=12 tau=0.53 gap=1,0.5,0.25,0.1 room=4 oblique=1
07 n=20 tau=1.0 gap=1,0.5,0.25,0.1 room=5 with=wall
06 n=12 tau=0.65,1.0 gap=1,0.5,0.25,0.1 room=5 with=wall place=1,2
08 n=8,12,20 tau=1.0 gap=1,0.5,0.25,0.1 room=5 with=wall motion=shear
02 n=12 tau=0.65,1.0 gap=1,0.5,0.25,0.1 room=5 oblique=0,1 place=1,2
10 solids=homogenised n=12 tau=0.53,0.65,0.8,1.0 gap=1,0.5,0.25,0.1 room=4 oblique=1
10b solids=homogenised n=12 tau=0.53,0.8 gap=1,0.5,0.25,0.1 room=4 place=2
10c solids=homogenised n=16 tau=0.65 gap=1,0.5,0.25,0.1 room=4 oblique=1
10d solids=homogenised n=20 tau=1.0 gap=1,0.5,0.25,0.1 room=4 oblique=1
11 solids=homogenised n=8,12 tau=0.53,0.65,0.8,1.0 gap=1,0.5,0.25,0.1 room=5 with=wall
11b solids=homogenised n=20 tau=1.0 gap=1,0.5,0.25,0.1 room=4 with=wall
00 n=8 tau=0.53,1.0 gap=1,0.5,0.25,0.1 room=5 oblique=1
05 n=8 tau=0.53,1.0 gap=1,0.5,0.25,0.1 room=5 with=wall
09 solids=homogenised n=8 tau=0.53,0.65,0.8,1.0 gap=1,0.5,0.25,0.1 room=5 oblique=1
04 n=12 tau=1.0 gap=1,0.5,0.25,0.1 room=4 motion=shear,spin,roll
12 solids=homogenised n=12 tau=1.0 gap=1,0.5,0.25,0.1 room=4 motion=shear,spin,roll
13 stretch=2 tilt=0,90 n=12 tau=1.0 gap=1,0.5,0.25,0.1 room=3 with=wall
14 stretch=0.5 tilt=0,45 n=12 tau=1.0 gap=1,0.5,0.25,0.1 room=3 with=wall
15 stretch=2 tilt=0,90 n=12 tau=1.0 gap=0.5,0.25,0.1 room=3 oblique=1
16 stretch=2 tilt=0,90 n=24 tau=1.0 gap=1.5,0.75 room=2 with=wall
17 stretch=0.5 n=24 tau=1.0 gap=1.5,0.75 room=2 with=wall
18 stretch=2 tilt=0,90 n=8 tau=1.0 gap=0.5,0.25 room=2 with=wall
19 stretch=0.5 n=8 tau=1.0 gap=0.5,0.25 room=2 with=wall
LISTS
}

export parts
# shellcheck disable=SC2016
tables | xargs -P "$jobs" -L 1 sh -c '
    part=$1
    shift
    cargo test --release --quiet --test lubrication -- "$@" | tail -n +2 > "$parts/$part" && mv "$parts/$part" "$parts/$part.csv"' table

{
    echo "# Force and torque on a held body by the lattice and with lubrication (full), over 6 pi mu a U and 8 pi mu a^2 U; see README.md"
    echo "solids,with,motion,tau,n,gap,oblique,place,room,stretch,tilt,force,torque,full_force,full_torque,exact,resolved_error,full_error,steps"
    cat "$parts"/*.csv
} > "$out/result.csv.part"
awk -F, -f "$here/result.awk" "$out/result.csv.part" > "$out/result.md.part"
mv "$out/result.csv.part" "$out/result.csv"
mv "$out/result.md.part" "$out/result.md"
cat "$out/result.md"
