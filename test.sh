#!/bin/sh
# Builds Turbid and runs all tests, with all features; scripts/checks.sh has what else must hold. Installs what they miss.
set -eu
cd "$(dirname "$0")"
. ./scripts/setup.sh
need_cargo
need_linker
need_features mpi,liggghts
need_device
need_lammps
need_c
need_python
need_browser

# One build for all tests: optimised numerics with assertions and overflow checks. There are a device, if only the processor, LAMMPS and
# a browser; tests that need one of them must not pass without.
export TURBID_NEEDS_DEVICE=1 TURBID_NEEDS_LAMMPS=1 TURBID_NEEDS_BROWSER=1
stage build cargo test --locked --workspace --all-features --no-run --quiet
stage tests cargo test --locked --workspace --all-features
stage "tests of the Python package" ./scripts/python.sh
