#!/bin/sh
# Production lines by module, and their sum: lines that are not blank, documentation included, tests left out.
set -eu
cd "$(dirname "$0")/.."
find src crates/*/src ffi/*/src ffi/*/build.rs -name '*.rs' ! -path '*/tests/*' ! -name '*tests.rs' -print | sort | while read -r file; do
    module=$(echo "$file" | sed -e 's|^src/|turbid/|' -e 's|^crates/||' -e 's|^ffi/||' -e 's|/src/|/|' -e 's|\.rs$||' | cut -d/ -f1-2)
    lines=$(awk '/^#\[cfg\(test\)\]/ { held = 1; next } held && /^mod .*\{/ { exit } { held = 0 } NF { n++ } END { print n + 0 }' "$file")
    echo "$module $lines"
done | awk '{ sum[$1] += $2; all += $2 } END { for (m in sum) print sum[m], m; print all, "all" }' | sort -rn
