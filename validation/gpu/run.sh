#!/bin/sh
# Bits and speed of a device: result.md. Less than ten minutes on a GPU; SMALL=1 takes small boxes, for PoCL.
#
# DEVICE  the device (default: gpu)
# OUT     directory for result.md (default: this one)
# TURBID  the program (default: built here)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
device=${DEVICE:-gpu}
out=${OUT:-$here}
cd "$here/../.."
if [ -z "${TURBID:-}" ]; then
    cargo build --release --quiet
    turbid=$PWD/${CARGO_TARGET_DIR:-target}/release/turbid
    case ${CARGO_TARGET_DIR:-} in /*) turbid=$CARGO_TARGET_DIR/release/turbid ;; esac
else
    turbid=$TURBID
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"

cases="single_sphere sphere_array hindered_settling hindered_settling_paper cubes_settling settling_tank shear_cell rotating_cylinder
    stl_particles"
if [ -n "${SMALL:-}" ]; then
    steps=4 edge=4
else
    steps=300 edge=25
fi

# The hash of the state after some steps: case, options.
hash_of() {
    name=$1
    shift
    "$turbid" run "cases/$name.toml" --quiet --overwrite --out "$work/$name" --set "run.end.steps=$steps" --set "run.average_from={ steps = 0 }" \
        --set output.fields_every=never --set output.picture_every=never --set output.particles_every=never "$@" >&2
    sed -n 's/.*"state_hash": "\(.*\)".*/\1/p' "$work/$name/summary.json"
}

# Million cell updates per second of settling bodies: options.
speed_of() {
    "$turbid" bench validation/hindered_settling/case.toml --device "$device" --steps 60 --json \
        --set lattice.cells_per_diameter=18 --set particles.0.volume_fraction=0.3 \
        --set "domain.size.diameters=[$edge,$edge,$edge]" "$@" | sed -n 's/^ *"mlups": \([0-9.]*\).*/\1/p' | head -1
}

{
    echo "Made by \`run.sh\`, $(date -u +%F)."
    echo
    echo '```text'
    "$turbid" doctor
    echo '```'
    echo
    echo "| case | precision | steps | hash of the state | device, 1, 2 and 4 ranks |"
    echo "|---|---|---|---|---|"
    for name in $cases; do
        for precision in f32 f64; do
            expected=$(hash_of "$name" --set "fluid.precision=$precision")
            found=
            for ranks in 1 2 4; do
                hash=$(hash_of "$name" --set "fluid.precision=$precision" --device "$device" --threads "$ranks")
                [ "$hash" = "$expected" ] && hash=equal
                found="$found $hash"
            done
            echo "| $name | $precision | $steps | $expected |$found |"
        done
    done
    echo
    echo "| what | precision | million cell updates per second |"
    echo "|---|---|---|"
    cells=$((edge * 18))
    for precision in f32 f64; do
        echo "| fluid alone, $cells x $cells x $cells cells | $precision | $(speed_of --fluid-only --set "fluid.precision=$precision") |"
    done
    for precision in f32 f64; do
        echo "| spheres, volume fraction 0.3, 18 cells per diameter, the same box | $precision | $(speed_of --set "fluid.precision=$precision") |"
    done
    cube='particles.0.shape={ cube = { equivalent_diameter = 1.5e-3 } }'
    echo "| cubes of the same volume | f32 | $(speed_of --set "$cube") |"
} > "$out/result.md.part"
mv "$out/result.md.part" "$out/result.md"
cat "$out/result.md"
