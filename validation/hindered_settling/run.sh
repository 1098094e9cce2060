#!/bin/sh
# Hindered settling at three volume fractions with both force balances: six runs, then result.csv and result.md.
#
#   ./run.sh              the study: 150 t*, averages from 50 t*; runs that are already there are not repeated
#   ./run.sh END FROM     a trial of another length; its tables go to the output directory only
#
# TURBID   the program (default: target/release/turbid, built if it is not there)
# OUT      output directory (default: out/validation/hindered_settling in the repository)
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
end=${1:-150}
from=${2:-50}
out=${OUT:-$root/out/validation/hindered_settling}
turbid=${TURBID:-$root/target/release/turbid}
if [ ! -x "$turbid" ]; then
    (cd "$root" && cargo build --release)
fi
version=$("$turbid" --version)

fractions="0.1 0.2 0.3"
balances="fluid_only mixture"

for phi in $fractions; do
    for balance in $balances; do
        run=$out/phi_${phi}_$balance
        mkdir -p "$run"
        # What a run depends on; written beside its results when it has ended by itself.
        {
            echo "$version, phi $phi, $balance, $end t*, averages from $from t*"
            cat "$here/case.toml"
        } > "$run/wanted.key"
        if [ -f "$run/summary.json" ] && [ -f "$run/done.key" ] && cmp -s "$run/wanted.key" "$run/done.key"; then
            echo "phi $phi, $balance: already there"
            continue
        fi
        echo "phi $phi, $balance"
        rm -f "$run/done.key"
        "$turbid" run "$here/case.toml" --out "$run" \
            --set "particles.0.volume_fraction=$phi" \
            --set "driving.force_balance=\"$balance\"" \
            --set "run.end={ stokes_times = $end }" \
            --set "run.average_from={ stokes_times = $from }"
        if ! grep -q '"interrupted": false' "$run/summary.json"; then
            echo "interrupted; start again to continue with this run" >&2
            exit 1
        fi
        mv "$run/wanted.key" "$run/done.key"
    done
done
rm -f "$out"/*/wanted.key

{
    echo "# Hindered settling, Ar 1000, density ratio 3.3, 12 cells per diameter, L = 8 D, tau 0.55, f32; $end t*, averages from $from t*"
    echo "# u and standard_error over the Stokes velocity, relative to the mixture; table_1: Marquardt et al. (2024), Table 1, spheres;"
    echo "# garside_yao: Garside & Al-Dibouni (1977) with the prefactor of Yao et al. (2021); expected_factor: what the same correlation"
    echo "# says of this balance over fluid_only; net_flux over the Stokes velocity; contacts per particle; largest overlap over D, mean in time"
    echo "phi,balance,u,standard_error,table_1,garside_yao,over_table_1,over_garside_yao,expected_factor,net_flux,contacts,max_overlap,mlups,version"
    for phi in $fractions; do
        for balance in $balances; do
            run=$out/phi_${phi}_$balance
            awk -f "$here/collect.awk" -v phi="$phi" -v balance="$balance" \
                "$here/reference.csv" "$run/series.csv" "$run/summary.json"
        done
    done
} > "$out/result.csv"

{
    echo "Made by \`run.sh\` on $(date -u +%Y-%m-%d) with $version; $end t*, averages from $from t*."
    echo
    awk -F, '
    /^#/ || /^phi/ { next }
    !head++ {
        print "| phi | balance | u / u_Stokes | standard error | Table 1 | over Table 1 | Garside, Yao | over it | mixture / fluid_only | expected | exponent m |"
        print "|---|---|---|---|---|---|---|---|---|---|---|"
    }
    $2 == "fluid_only" { fluid_only = $3 }
    {
        ratio = "-"; expected = "-"; m = "-"
        if ($2 == "mixture") {
            ratio = sprintf("%.3f", $3 / fluid_only)
            expected = sprintf("%.3f", $9)
            m = sprintf("%.2f (expected %.2f)", log($3 / fluid_only) / log(1 - $1), log($9) / log(1 - $1))
        }
        printf "| %s | `%s` | %.4f | %s | %.3f | %+.1f %% | %.3f | %+.1f %% | %s | %s | %s |\n",
            $1, $2, $3, $4 == "" ? "-" : sprintf("%.4f", $4), $5, 100 * ($7 - 1), $6, 100 * ($8 - 1), ratio, expected, m
    }' "$out/result.csv"
} > "$out/result.md"

if [ "$end $from" = "150 50" ]; then
    cp "$out/result.csv" "$out/result.md" "$here"
fi
cat "$out/result.md"
