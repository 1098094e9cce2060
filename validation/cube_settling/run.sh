#!/bin/sh
# Cubes against spheres of the same volume, at two volume fractions with two seeds each: eight runs, then result.csv and
# result.md. Runs that are already there are not repeated.
#
#   ./run.sh              the study: 70 t*, averages from 30 t*
#   ./run.sh END FROM     a trial of another length; its tables go to the output directory only
#
# TURBID   the program (default: target/release/turbid, built if it is not there)
# OUT      output directory (default: out/validation/cube_settling in the repository)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
end=${1:-70}
from=${2:-30}
out=${OUT:-$root/out/validation/cube_settling}
turbid=${TURBID:-$root/target/release/turbid}
if [ ! -x "$turbid" ]; then
    (cd "$root" && cargo build --release)
fi
version=$("$turbid" --version)

# The number after a key of a summary; nothing where there is none.
of() {
    sed -n "s/^ *\"$2\": \([0-9.eE+-]*\),*$/\1/p" "$1/summary.json" | head -n 1
}

for phi in 0.1 0.3; do
    for seed in 1 2; do
        for shape in sphere cube; do
            run=$out/phi_${phi}_seed_${seed}_$shape
            mkdir -p "$run"
            # What a run depends on; written beside its results when it has ended by itself.
            {
                echo "$version, phi $phi, seed $seed, $shape, $end t*, averages from $from t*"
                cat "$here/case.toml"
            } > "$run/wanted.key"
            if [ -f "$run/summary.json" ] && [ -f "$run/done.key" ] && cmp -s "$run/wanted.key" "$run/done.key"; then
                echo "phi $phi, seed $seed, $shape: already there"
                continue
            fi
            echo "phi $phi, seed $seed, $shape"
            rm -f "$run/done.key"
            case $shape in
                sphere) geometry='{ sphere = { diameter = 1.5e-3 } }' ;;
                cube) geometry='{ cube = { equivalent_diameter = 1.5e-3 } }' ;;
            esac
            "$turbid" run "$here/case.toml" --out "$run" \
                --set "particles.0.shape=$geometry" \
                --set "particles.0.volume_fraction=$phi" \
                --set "particles.0.seed=$seed" \
                --set "run.end={ stokes_times = $end }" \
                --set "run.average_from={ stokes_times = $from }"
            if ! grep -q '"interrupted": false' "$run/summary.json"; then
                echo "interrupted; start again to continue with this run" >&2
                exit 1
            fi
            mv "$run/wanted.key" "$run/done.key"
        done
    done
done
rm -f "$out"/*/wanted.key

{
    echo "# Settling velocity of cubes and of spheres of the same volume over the Stokes velocity, Ar 1000, density ratio 3.3,"
    echo "# 12 cells per diameter, L = 8 D, tau 0.55, f32, balance fluid_only; $end t*, averages from $from t*"
    echo "phi,seed,shape,u,standard_error,mlups"
    for phi in 0.1 0.3; do
        for seed in 1 2; do
            for shape in sphere cube; do
                run=$out/phi_${phi}_seed_${seed}_$shape
                echo "$phi,$seed,$shape,$(of "$run" settling_velocity_over_stokes),$(of "$run" standard_error),$(of "$run" mlups)"
            done
        done
    done
} > "$out/result.csv"

{
    echo "Made by \`run.sh\` on $(date -u +%Y-%m-%d) with $version; $end t*, averages from $from t*."
    echo
    echo "| phi | spheres, seeds 1, 2 | cubes, seeds 1, 2 | cubes are slower by | Marquardt et al. (2024), Table 1 |"
    echo "|---|---|---|---|---|"
    awk -F, '
    /^#/ || /^phi/ { next }
    {
        key = $1 " " $3
        text[key] = text[key] (text[key] == "" ? "" : ", ") sprintf("%.4f +- %.4f", $4, $5)
        sum[key] += $4; square[key] += $5 * $5
        if (!seen[$1]++) order[++n] = $1
    }
    END {
        published["0.1"] = "14.0 % (0.274, 0.236)"
        published["0.3"] = "26.4 % (0.144, 0.106)"
        for (i = 1; i <= n; i++) {
            phi = order[i]; s = sum[phi " sphere"]; c = sum[phi " cube"]
            error = c / s * sqrt(square[phi " sphere"] / (s * s) + square[phi " cube"] / (c * c))
            printf "| %s | %s | %s | %.1f +- %.1f %% | %s |\n", phi, text[phi " sphere"], text[phi " cube"],
                100 * (1 - c / s), 100 * error, published[phi]
        }
    }' "$out/result.csv"
} > "$out/result.md"

if [ "$end $from" = "70 30" ]; then
    cp "$out/result.csv" "$out/result.md" "$here"
fi
cat "$out/result.md"
