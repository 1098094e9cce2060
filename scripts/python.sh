#!/bin/sh
# Builds the Python package of ffi/python, installs it into a virtual environment of its own below the target folder, and runs its
# tests. Arguments go to pytest: scripts/python.sh -k fields
set -eu
cd "$(dirname "$0")/.."
. ./scripts/setup.sh
need_cargo
need_linker
need_features mpi
need_python

target=${CARGO_TARGET_DIR:-$PWD/target}
python=$target/python/bin/python
wheels=$target/python/wheels
# Without pip it is what an interrupted call has left.
"$python" -m pip --version >/dev/null 2>&1 || python3 -m venv --clear "$target/python"
# What is there already is not asked for again, so the second time needs no network.
"$python" -m pip install --quiet --disable-pip-version-check --requirement ffi/python/tests/requirements.txt
rm -rf "$wheels"
"$python" -m maturin build --quiet --locked --features mpi --auditwheel skip --manifest-path ffi/python/Cargo.toml --out "$wheels"
"$python" -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall "$wheels"/*.whl
exec env MPLBACKEND=Agg "$python" -m pytest -q -p no:cacheprovider ffi/python/tests "$@"
