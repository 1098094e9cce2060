#!/bin/sh
# Drag on a body in a periodic cube, held and moving, with both couplings: result.csv.
#
# OUT   where the table goes (default: result.csv beside this file)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
out=${OUT:-$here/result.csv}
cd "$here/../.."

table() {
    cargo test --release --quiet --test drag -- "$@" | tail -n +2
}

{
    echo "# Relative error of the drag factor, force over momentum fed in, noise of the force; see README.md for the columns"
    echo "solids,magic,tau,n,phi,shape,rotated,place,speed,re,drag_error,balance,noise,extreme,across,torque,volume,steps"
    table solids=paper magic=bgk n=8,12,15 tau=0.53,0.55,0.65,0.8,1.0 phi=0.064,0.216,0.30074 place=1
    table solids=sc3 n=8,12,15 tau=0.53,0.55,0.65,0.8,1.0 phi=0.064,0.125,0.216,0.30074 place=1,2
    table solids=sc3 n=12,15 tau=0.53,0.65,1.0 phi=0.064,0.125,0.216,0.30074 place=1 speed=0.01
    table solids=sc1,sc2 n=12 tau=0.55,0.8 phi=0.064 place=1
    table solids=paper magic=bgk shape=cube n=12,15 tau=0.55,0.65,1.0 phi=0.064 place=1,2 rotated=0,3
    table solids=sc3 shape=cube n=12,15,18 tau=0.53,0.65,1.0 phi=0.064 place=1,2 rotated=0,3
    table solids=sc3 shape=cube n=12,15 tau=0.53,0.65,1.0 phi=0.064 place=1 rotated=0,3 speed=0.01
    table solids=sc3 n=12 re=20 tau=0.53,0.55,0.65 phi=0.064 speed=0,0.03
} > "$out.part"
mv "$out.part" "$out"
