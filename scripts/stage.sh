#!/bin/sh
# Lays out what a package has below a prefix: the program, manual pages, completions for shells, licences, and the cases as examples.
#
#   scripts/stage.sh PROGRAM PREFIX
set -eu
program=$(realpath "$1")
cd "$(dirname "$0")/.."
prefix=$2
doc=$prefix/share/doc/turbid
rm -rf "$prefix"
mkdir -p "$doc/examples" "$prefix/share/bash-completion/completions" "$prefix/share/zsh/vendor-completions" \
    "$prefix/share/fish/vendor_completions.d"
install -D "$program" "$prefix/bin/turbid"
"$program" man "$prefix/share/man/man1"
"$program" completions bash >"$prefix/share/bash-completion/completions/turbid"
"$program" completions zsh >"$prefix/share/zsh/vendor-completions/_turbid"
"$program" completions fish >"$prefix/share/fish/vendor_completions.d/turbid.fish"
cp LICENSE-APACHE LICENSE-MIT NOTICE CHANGELOG.md "$doc/"
for file in cases/*; do
    case $file in
    *.expect.toml) ;;
    *) cp "$file" "$doc/examples/" ;;
    esac
done
cp packaging/slurm.sh "$doc/examples/"
