#!/bin/sh
# Drag on a body in a periodic cube, fixed and moving, with both couplings: result.csv. An hour on two cores, of which
# the other bodies with 32 cells take most. OUT: another folder for it.
cd "$(dirname "$0")/../.." && exec cargo test --release --quiet --package turbid-lab --test drag -- all
