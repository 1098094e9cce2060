#!/bin/sh
# Drag on a body in a periodic cube, held and moving, with both couplings: result.csv and, as tables, result.md. An hour
# on two cores, of which the other bodies with 32 cells take most.
#
# OUT    directory for the two (default: this one)
# JOBS   runs at a time, each on one core (default: the number of cores)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
out=${OUT:-$here}
jobs=${JOBS:-$(getconf _NPROCESSORS_ONLN)}
cd "$here/../.."
cargo test --release --quiet --no-run --test drag
parts=$(mktemp -d)
trap 'rm -rf "$parts"' EXIT
mkdir -p "$out"

# Lists of what is computed, the longest first; the number decides the place in the table.
bodies=dodecahedron,octahedron,tetrahedron,triangle,hexagon,plate,rod,cylinder,disc,oblate,prolate
tables() {
    sed "s/BODIES/$bodies/" <<'LISTS'
14 solids=sc3 n=32 tau=1.0 phi=0.064 place=1 rotated=1 shape=BODIES
15 solids=sc3 n=32 tau=1.0 phi=0.064 place=1 rotated=3 shape=BODIES
16 solids=sc3 n=12,20 tau=0.55,1.0 phi=0.064 place=1 rotated=1,3 shape=BODIES
17 solids=paper magic=bgk n=12,20 tau=0.55,1.0 phi=0.064 place=1 rotated=1 shape=BODIES
18 solids=sc3 n=24 tau=0.53,0.65,1.0 phi=0.064,0.216,0.30074 place=1
02 solids=sc3 n=15 tau=0.53,0.55,0.65,0.8,1.0 phi=0.064,0.125,0.216,0.30074 place=1,2
07 solids=sc3 shape=cube n=18 tau=0.53,0.65,1.0 phi=0.064 place=1,2 rotated=0,3
06 solids=sc3 shape=cube n=12,15 tau=0.53,0.65,1.0 phi=0.064 place=1,2 rotated=0,3
03 solids=sc3 n=12,15 tau=0.53,0.65,1.0 phi=0.064,0.125,0.216,0.30074 place=1 speed=0.01
00 solids=paper magic=bgk n=8,12,15 tau=0.53,0.55,0.65,0.8,1.0 phi=0.064,0.216,0.30074 place=1
01 solids=sc3 n=8,12 tau=0.53,0.55,0.65,0.8,1.0 phi=0.064,0.125,0.216,0.30074 place=1,2
08 solids=sc3 shape=cube n=12,15 tau=0.53,0.65,1.0 phi=0.064 place=1 rotated=0,3 speed=0.01
05 solids=paper magic=bgk shape=cube n=12,15 tau=0.55,0.65,1.0 phi=0.064 place=1,2 rotated=0,3
09 solids=sc3 n=12 re=20 tau=0.53,0.55,0.65 phi=0.064 speed=0,0.03
04 solids=sc1,sc2 n=12 tau=0.55,0.8 phi=0.064 place=1
10 solids=sc3 magic=0.1,0.083333 n=12 tau=0.53,1.0 phi=0.064,0.30074 place=1
11 solids=sc3 magic=0.083333 shape=cube n=12 tau=0.53,1.0 phi=0.064 place=1,2
12 solids=sc3 n=8 re=32 tau=0.55 phi=0.065449 speed=0,0.066,-0.066
13 solids=paper magic=bgk n=8 re=32 tau=0.55 phi=0.065449 speed=0,0.066,-0.066
LISTS
}

export parts
# shellcheck disable=SC2016
tables | xargs -P "$jobs" -L 1 sh -c '
    part=$1
    shift
    cargo test --release --quiet --test drag -- "$@" | tail -n +2 > "$parts/$part" && mv "$parts/$part" "$parts/$part.csv"' table

{
    echo "# Relative error of the drag factor, force over momentum fed in, noise of the force; see README.md for the columns"
    echo "solids,magic,tau,n,phi,shape,rotated,place,speed,re,drag_error,balance,noise,extreme,across,torque,volume,steps"
    cat "$parts"/*.csv
} > "$out/result.csv.part"
awk -F, -f "$here/result.awk" "$out/result.csv.part" > "$out/result.md.part"
mv "$out/result.csv.part" "$out/result.csv"
mv "$out/result.md.part" "$out/result.md"
cat "$out/result.md"
