#!/bin/sh
# Production lines by module, and the sums of product, laboratory and all: lines that are not blank, documentation included, tests left
# out. Exit code 1 if a sum is above its budget.
set -eu
cd "$(dirname "$0")/.."
find src crates/*/src ffi/*/src ffi/*/build.rs -name '*.rs' ! -path '*/tests/*' ! -name '*tests.rs' -print | sort | while read -r file; do
    module=$(echo "$file" | sed -e 's|^src/|turbid/|' -e 's|^crates/||' -e 's|^ffi/||' -e 's|/src/|/|' -e 's|\.rs$||' | cut -d/ -f1-2)
    lines=$(awk '/^#\[cfg\(test\)\]/ { held = 1; next } held && /^mod .*\{/ { exit } { held = 0 } NF { n++ } END { print n + 0 }' "$file")
    echo "$module $lines"
done | awk '
    { sum[$1] += $2; part = $1 ~ "^lab/" ? "laboratory" : "product"; sum[part] += $2; sum["all"] += $2 }
    END {
        budget["product"] = 45000; budget["laboratory"] = 7000; budget["all"] = 51000
        for (name in sum) {
            over = name in budget && sum[name] > budget[name]
            print sum[name], name (over ? " (the budget is " budget[name] ")" : "") | "sort -rn"
            failed += over
        }
        close("sort -rn")
        exit failed > 0
    }'
