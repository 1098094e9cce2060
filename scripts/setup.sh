# What run.sh and test.sh need from the system; read by both. Quiet when nothing is missing.

have() {
    command -v "$1" >/dev/null 2>&1
}

fail() {
    echo "error: $*" >&2
    exit 1
}

# Rust comes from rustup, which needs no root.
need_cargo() {
    if ! have cargo && [ -r "${CARGO_HOME:-$HOME/.cargo}/env" ]; then
        . "${CARGO_HOME:-$HOME/.cargo}/env"
    fi
    have cargo || fail "cargo, the build tool of Rust, is not here; see https://rustup.rs, then run this again"
}

# Rust links with the system's C compiler and its C library.
need_linker() {
    if have cc; then
        return
    fi
    if ! have apt-get; then
        fail "no C linker (cc) is here: install gcc and the headers of the C library by your system's means"
    elif [ "$(id -u)" = 0 ]; then
        as_root=
    elif have sudo; then
        as_root=sudo
    else
        fail "no C linker (cc) is here; as root: apt-get install gcc libc6-dev"
    fi
    echo "installing a C linker (gcc, libc6-dev)" >&2
    $as_root apt-get update -q >&2 &&
        $as_root env DEBIAN_FRONTEND=noninteractive \
            apt-get install -y -q --no-install-recommends gcc libc6-dev >&2 ||
        fail "apt-get could not install gcc and libc6-dev"
}
