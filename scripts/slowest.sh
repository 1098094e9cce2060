#!/bin/sh
# Lists the slowest tests with their times (s); test.sh has installed what they need.
#
#   scripts/slowest.sh [NUMBER] [FILTER]      20 of all tests by default
set -eu
cd "$(dirname "$0")/.."
export TURBID_NEEDS_DEVICE=1 TURBID_NEEDS_LAMMPS=1 TURBID_NEEDS_BROWSER=1

cargo test --workspace --all-features --no-run --message-format=json 2>/dev/null |
    python3 -c '
import json, os, sys
for line in sys.stdin:
    built = json.loads(line)
    if built.get("executable") and built["profile"]["test"]:
        print(built["executable"], os.path.dirname(built["manifest_path"]), built["target"]["name"], sep="\t")
' | while IFS="$(printf '\t')" read -r program folder name; do
    # The harness measures its tests only where unstable options are allowed.
    (cd "$folder" && RUSTC_BOOTSTRAP=1 "$program" -Zunstable-options --report-time ${2:+"$2"}) |
        sed -n "s/^test \(.*\) \.\.\. ok <\(.*\)s>\$/\2 $name \1/p"
done | sort -rn | head -n "${1:-20}"
