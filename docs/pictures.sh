#!/bin/sh
# Makes the pictures of README.md and docs/*.md anew, or those whose command contains WORD:
#
#     sh docs/pictures.sh [WORD]
#
# Each command stands beside its picture, in a comment that begins with `<!-- lightgrid`; what it writes as .png is
# kept as .jpg. Needs ImageMagick, for windows a graphics device, for .gif ffmpeg, and `lightgrid` on the PATH or in
# LIGHTGRID.
set -eu
cd "$(dirname "$0")/.."
mkdir -p docs/pictures
sed -n 's/^<!-- \(lightgrid .*\) -->$/\1/p' README.md docs/*.md | grep -F -e "${1:-lightgrid}" |
    while read -r _ words; do
        png=${words##* -o }
        echo "$png"
        # Words are split, and no more than that: names have no spaces.
        set -f
        # shellcheck disable=SC2086
        "${LIGHTGRID:-lightgrid}" $words </dev/null
        case $png in *.gif) continue ;; esac
        convert "$png" -quality 88 "${png%.png}.jpg"
        rm "$png"
    done
