#!/bin/sh
# What must hold besides the tests: format, lints with all features and without, dependencies, documentation, and the book.
set -eu
cd "$(dirname "$0")/.."
. ./scripts/setup.sh
need_cargo
need_linker
need_features mpi,liggghts
cargo fmt --version >/dev/null 2>&1 || fail "rustfmt is missing; run: rustup component add rustfmt"
cargo clippy --version >/dev/null 2>&1 || fail "clippy is missing; run: rustup component add clippy"

stage format cargo fmt --all --check
stage lints cargo clippy --locked --workspace --all-targets --all-features --quiet -- -D warnings
stage "lints without features" cargo clippy --locked --all-targets --quiet -- -D warnings
stage "lints of the library alone" cargo clippy --locked --package turbid --lib --no-default-features --quiet -- -D warnings
stage documentation env RUSTDOCFLAGS="-D warnings" \
    cargo doc --locked --workspace --no-deps --all-features --document-private-items --quiet
# Without features only their absence differs, and what is refused is said. Nothing is computed, so nothing is optimised.
stage "tests without features" env CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_PROFILE_DEV_DEBUG=false \
    cargo test --locked --profile dev --config profile.dev.package.turbid-core.opt-level=0 --test program bad_input
stage dependencies ./scripts/dependencies.sh
stage book ./scripts/docs.sh
