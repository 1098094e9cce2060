# What run.sh, test.sh and scripts/ need from the system; read by them. Quiet when nothing is missing.

have() {
    command -v "$1" >/dev/null 2>&1
}

fail() {
    echo "error: $*" >&2
    exit 1
}

# Runs a command under a name and tells its time.
stage() {
    name=$1
    shift
    echo "== $name" >&2
    start=$(date +%s)
    "$@"
    echo "   $name took $(($(date +%s) - start)) s" >&2
}

# Rust comes from rustup, which needs no root.
need_cargo() {
    if ! have cargo && [ -r "${CARGO_HOME:-$HOME/.cargo}/env" ]; then
        . "${CARGO_HOME:-$HOME/.cargo}/env"
    fi
    have cargo || fail "cargo, the build tool of Rust, is not here; see https://rustup.rs, then run this again"
}

# Installs Debian packages (from the second argument on) for what the first one names.
install_packages() {
    what=$1
    shift
    if ! have apt-get; then
        fail "$what: not here, nor is apt-get; install by your system's means what Debian has in: $*"
    elif [ "$(id -u)" = 0 ]; then
        as_root=
    elif have sudo; then
        as_root=sudo
    else
        fail "$what: not here; as root: apt-get install $*"
    fi
    echo "installing $what ($*)" >&2
    $as_root apt-get update -q >&2 &&
        $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "$@" >&2 ||
        fail "apt-get could not install $*"
}

# Rust links with the system's C compiler and its C library.
need_linker() {
    have cc || install_packages "a C linker" gcc libc6-dev
}

# Whether any of these files is there.
any_file() {
    for file; do
        [ -e "$file" ] && return 0
    done
    return 1
}

# The cargo feature `liggghts`: the library and its headers, MPI's headers, and what compiles and reads them.
need_liggghts() {
    missing=
    have liggghts || missing="$missing liggghts"
    any_file "${LIGGGHTS_INCLUDE:-/usr/include/liggghts}/library.h" || missing="$missing libliggghts-dev"
    have "${MPICC:-mpicc}" || missing="$missing libopenmpi-dev"
    [ -n "${LIBCLANG_PATH:-}" ] || any_file /usr/lib/llvm-*/include/clang-c/Index.h ||
        missing="$missing libclang-dev"
    have "${CXX:-c++}" || missing="$missing g++"
    # Each of the names in it is a word of its own.
    [ -z "$missing" ] || install_packages "LIGGGHTS and what builds against it" $missing
}

# The cargo feature `mpi`: the library and its headers, what reads them, and what starts the processes of a job.
need_mpi() {
    missing=
    have mpirun || missing="$missing openmpi-bin"
    have "${MPICC:-mpicc}" || missing="$missing libopenmpi-dev"
    [ -n "${LIBCLANG_PATH:-}" ] || any_file /usr/lib/llvm-*/include/clang-c/Index.h ||
        missing="$missing libclang-dev"
    [ -z "$missing" ] || install_packages "MPI and what builds against it" $missing
}

# Tests of the cargo feature `gpu`: a driver of OpenCL for the processor, and what loads it.
need_device() {
    any_file /etc/OpenCL/vendors/*.icd || install_packages "a driver of OpenCL" pocl-opencl-icd ocl-icd-libopencl1
}

# Tests of ffi/engines/lammps: the library alone.
need_lammps() {
    any_file /usr/lib/*/liblammps.so.0 || install_packages LAMMPS liblammps0
}

# The Python package: the interpreter, and what makes virtual environments.
need_python() {
    have python3 || install_packages "Python" python3 python3-venv
    python3 -c 'import venv, ensurepip' 2>/dev/null || install_packages "virtual environments of Python" python3-venv
}

# Tests of pages: a browser.
need_browser() {
    have chromium || have chromium-browser || have google-chrome || install_packages "a browser" chromium
}

# The C API: what its example is built with.
need_c() {
    missing=
    have make || missing="$missing make"
    have pkg-config || missing="$missing pkg-config"
    [ -z "$missing" ] || install_packages "what builds the example of the C API" $missing
}

# What these cargo features, with commas or blanks between them, need besides Rust.
need_features() {
    case ",$(echo "$1" | tr ' ' ',')," in
    *,liggghts,*) need_liggghts ;;
    esac
    case ",$(echo "$1" | tr ' ' ',')," in
    *,mpi,*) need_mpi ;;
    esac
}
