#!/bin/sh
# Changes one constant of a copy of the program at a time, and asks `turbid validate` whether it notices: for each change the
# cases that fail. A change that none of them notices ends this with exit code 1.
#   validation/mutations.sh [NAME]...            all, or those named
#   PROFILE=dev CASES="hertz friction" validation/mutations.sh prefactor
set -eu
cd "$(dirname "$0")/.."
root=$PWD
profile=${PROFILE:-release}
cases=${CASES:-shear_wave taylor_green channel restitution friction hertz settling_tank}
target=${CARGO_TARGET_DIR:-$root/target}
export CARGO_TARGET_DIR="$target"
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT

# Name, file, original text, replacement.
mutations() {
    cat <<'TABLE'
weight|crates/core/src/fluid/kernel.rs|scaled(1.0 / 18.0), scaled(1.0 / 36.0)|scaled(1.0 / 18.5), scaled(1.0 / 35.5)
quadratic|crates/core/src/fluid/kernel.rs|c(4.5) * rho, c(3.0) * rho|c(4.0) * rho, c(3.0) * rho
force_sign|crates/core/src/fluid/kernel.rs|[u[0] + a[0], u[1] + a[1], u[2] + a[2]]|[u[0] - a[0], u[1] - a[1], u[2] - a[2]]
solid_sign|crates/core/src/fluid/kernel.rs|*odd = open * *odd + b * (v + v)|*odd = open * *odd - b * (v + v)
solid_weight|crates/core/src/coupling/saturated/collision.rs|covered.solid * above_half * (through + above_half).recip()|covered.solid
exchange_sign|crates/core/src/coupling/saturated/collision.rs|given * (u[axis] - velocity[axis])|given * (velocity[axis] - u[axis])
viscosity|crates/core/src/units.rs|dt: (relaxation_time - 0.5) / 3.0|dt: relaxation_time / 3.0
prefactor|crates/core/src/contact/law.rs|4.0 / 3.0 * self.modulus * (couple|4.0 / 5.0 * self.modulus * (couple
TABLE
}

missed=0
mutations | while IFS='|' read -r name file from to; do
    if [ $# -gt 0 ]; then
        case " $* " in *" $name "*) ;; *) continue ;; esac
    fi
    rm -rf "$copy/turbid"
    mkdir "$copy/turbid"
    git archive HEAD | tar -x -C "$copy/turbid"
    FROM=$from TO=$to awk '
        BEGIN { from = ENVIRON["FROM"]; to = ENVIRON["TO"] }
        (at = index($0, from)) && !done { $0 = substr($0, 1, at - 1) to substr($0, at + length(from)); done = 1 }
        { print }
        END { exit !done }' "$root/$file" >"$copy/turbid/$file" || { echo "$name: $file has no \`$from\`" >&2; exit 1; }
    (cd "$copy/turbid" && cargo build --quiet --profile "$profile" --bin turbid)
    case $profile in dev) folder=debug ;; *) folder=$profile ;; esac
    # shellcheck disable=SC2086
    said=$(timeout 1800 "$target/$folder/turbid" validate $cases --json "$copy/checks.json" 2>&1) && code=0 || code=$?
    noticed=$(awk -F'"' '/"case":/ { name = $4 } /"pass": false/ { failed[name]++ }
        END { for (name in failed) printf " %s (%d)", name, failed[name] }' "$copy/checks.json")
    case $code in
    3) echo "$name: noticed by$noticed" ;;
    *) echo "$name: not noticed, exit code $code"; echo "$said" | tail -n 3; missed=1 ;;
    esac
    [ "$missed" = 0 ] || exit 1
done
