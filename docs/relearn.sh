#!/bin/sh
# Makes docs/pictures/relearn.gif anew: the living room while the map is turned once, each cell in the colour of the
# tile that matters most to it. Needs a graphics device, ffmpeg, and `lightgrid` on the PATH or in LIGHTGRID:
#
#     sh docs/relearn.sh
set -eu
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
for frame in $(seq 10 27); do
    "${LIGHTGRID:-lightgrid}" screenshot --env-rotation $(((frame - 10) * 20)) --overlay best-tile --panel none \
        --size 320x180 --samples 8 --denoise -o "$folder/$frame.png"
done
ffmpeg -v error -y -framerate 4 -start_number 10 -i "$folder/%d.png" \
    -vf 'split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=none' docs/pictures/relearn.gif
