#!/bin/sh
# Force on spheres and spheroids fixed at a small gap while they move, with and without lubrication: result.csv. Half an
# hour on two cores. OUT: another folder for it.
cd "$(dirname "$0")/../.." && exec cargo test --release --quiet --package turbid-lab --test lubrication -- all
