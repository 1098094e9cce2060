#!/bin/sh
# Builds turbid and runs the main case, or passes its arguments on:
#
#   ./run.sh                       the main case, cases/hindered_settling.toml, in place of an earlier run of it
#   ./run.sh check cases/x.toml    turbid check cases/x.toml
#
# TURBID_FEATURES names cargo features to build with, and what they need is installed if it is missing:
#
#   TURBID_FEATURES=liggghts ./run.sh crosscheck
#
# Files in the arguments and output directories are relative to where you are.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
features=${TURBID_FEATURES:-}
. "$here/scripts/setup.sh"
need_cargo
need_linker
need_features "$features"

start=$(date +%s)
cargo build --release --locked --manifest-path "$here/Cargo.toml" --features "$features"
seconds=$(($(date +%s) - start))
if [ "$seconds" -gt 2 ]; then
    echo "the build took $seconds s" >&2
fi

if [ $# -eq 0 ]; then
    set -- run "$here/cases/hindered_settling.toml" --overwrite
fi
exec cargo run --release --locked --quiet --manifest-path "$here/Cargo.toml" --features "$features" -- "$@"
