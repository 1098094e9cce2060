#!/bin/sh
# Builds the book, target/docs/book/index.html: the pages that docs/SUMMARY.md lists, and after them every other page of the tree, so that
# links between them work in the book as they do on a code host. `cargo test --test library pages` checks links and the summary.
# Builds mdBook once if it is not here (40 s on two cores).
set -eu
cd "$(dirname "$0")/.."
. ./scripts/setup.sh
need_cargo
need_linker

version=0.5.4
tools=$PWD/target/tools
book=${CARGO_TARGET_DIR:-$PWD/target}/docs
mdbook=$tools/bin/mdbook
if [ "$("$mdbook" --version 2>/dev/null)" != "mdbook v$version" ]; then
    echo "building mdbook $version" >&2
    cargo install mdbook --version "=$version" --locked --no-default-features --quiet --debug \
        --config profile.dev.debug=0 --root "$tools" --force
fi

scripts/pictures.sh --check
rm -rf "$book"
mkdir -p "$book/src"
# Everything, as pages name code, cases and pictures as well; what git ignores stays out.
git ls-files -z --cached --others --exclude-standard -- . ':!advisories' | xargs -0 cp --parents -t "$book/src"
cp docs/book.toml "$book/"
cd "$book/src"
# mdBook makes index.html of index.md, which is what a link to a folder opens.
find . -name '*.md' -exec sed -i 's/](\([^)]*\)README\.md/](\1index.md/g' {} +
find . -name README.md | while read -r page; do
    mv "$page" "$(dirname "$page")/index.md"
done
{
    sed 's#](#](docs/#' docs/SUMMARY.md
    printf '\n# In the repository\n\n'
    find . -name '*.md' ! -name SUMMARY.md ! -path './docs/*' | sed 's#^\./##' | LC_ALL=C sort | while read -r page; do
        title=$(sed -n 's/^# //p' "$page" | head -n 1)
        printf -- '- [%s](%s)\n' "${title:-$page}" "$page"
    done
} >SUMMARY.md
rm docs/SUMMARY.md
cd ..
"$mdbook" build >&2
echo "the book: $book/book/docs/index.html" >&2
