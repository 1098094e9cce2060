#!/bin/sh
# Draws the pictures of docs/ from the program as it is, and of the tutorials; takes some minutes on two cores.
#
#   scripts/pictures.sh            draws all of them
#   scripts/pictures.sh --check    names those that are out of date; `cargo test --test library pages` and scripts/docs.sh do so, too
#
# A picture is out of date if it is not the one that was drawn, or if since then one of these has changed: its case, a state hash in
# tests/golden, as results of the program have, or a picture of a tutorial, as its way of drawing has. docs/pictures.sums has their
# checksums. TURBID names a program in place of one that is built here. docs/report.png and docs/live.png are pictures by
# Chromium; docs/paraview.png is not drawn here.
set -eu
cd "$(dirname "$0")/.."
export LC_ALL=C
sums=docs/pictures.sums

# A line of the sums: picture, case, checksum of the picture, checksum of what it is drawn from.
line() {
    picture=$(cksum <"docs/$1.png" | cut -d ' ' -f 1)
    source=$(cat "cases/$2.toml" tests/golden/*/state_hash docs/tutorials/*/*.png | cksum | cut -d ' ' -f 1)
    echo "$1 $2 $picture $source"
}

lines() {
    line settling_velocity hindered_settling
    line report hindered_settling
    line live hindered_settling
    line view_spheres hindered_settling
    line view_cubes cubes_settling
    line view_dry_box dry_box
    line view_jacks jacks
}

if [ "${1:-}" = --check ]; then
    stale=$(lines | while read -r line; do
        grep -qxF "$line" "$sums" || echo "docs/${line%% *}.png"
    done)
    [ -n "$stale" ] || exit 0
    echo "out of date: $(echo $stale)" >&2
    echo "draw them anew, and look at them: scripts/pictures.sh" >&2
    exit 1
fi

out=target/pictures
rm -rf "$out"
mkdir -p "$out"
if [ -z "${TURBID:-}" ]; then
    cargo build --release --locked
    TURBID=target/release/turbid
fi

# A run of a case with one view at its end.
view() {
    name=$1 case=$2 end=$3 view=$4
    shift 4
    "$TURBID" run "cases/$case.toml" --out "$out/$name" --set "run.end.$end" --set "output.picture_every.$end" \
        --set "output.pictures=[{ view = $view }]" "$@"
    cp "$(ls "$out/$name/pictures/"*.png | tail -n 1)" "docs/$name.png"
}

view view_spheres hindered_settling stokes_times=12 '{ size = [960, 720] }' --set 'domain.size.diameters=[11, 8, 9]'
view view_cubes cubes_settling stokes_times=12 '{ size = [900, 720], slice = { quantity = "vorticity" } }'
view view_dry_box dry_box time=0.15 '{ size = [900, 720], force_chains = true, force_range = 0.01 }'
view view_jacks jacks time=0.25 '{ colour = "speed" }'

# A picture of a page by Chromium: name, size, address.
page() {
    if chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome); then
        [ "$(id -u)" = 0 ] && sandbox=--no-sandbox || sandbox=
        "$chromium" --headless $sandbox --hide-scrollbars --window-size="$2" --virtual-time-budget=6000 \
            --screenshot="docs/$1.png" "$3" 2>/dev/null
    else
        echo "docs/$1.png stays as it is: there is no Chromium" >&2
    fi
}

"$TURBID" run cases/hindered_settling.toml --out "$out/hindered_settling" --serve 2>"$out/address" &
until [ -e "$out/hindered_settling/pictures/view_0000004860.png" ]; do
    kill -0 $! || exit 1
    sleep 1
done
page live 1280,860 "$(grep -o 'http://[^ ]*' "$out/address" | head -n 1)"
wait $!
cp "$out/hindered_settling/settling_velocity.png" docs/
"$TURBID" report "$out/hindered_settling"
page report 900,1140 "file://$PWD/$out/hindered_settling/report.html"

UPDATE=1 cargo test --workspace --all-features --test program tutorials
lines >"$sums"
echo "look at them: docs/*.png, docs/tutorials/*/*.png" >&2
