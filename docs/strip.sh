#!/bin/sh
# Makes docs/pictures/strip-split.jpg anew: a split view with its speed-up after a time, where screenshots count samples.
# Needs Xvfb, xdotool, ImageMagick, and `lightgrid` on the PATH or in LIGHTGRID:
#
#     sh docs/strip.sh [SECONDS]
#
# SECONDS are what both halves get; from some ten samples a pixel on the figure is sure.
set -eu
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
server= window=
trap 'kill $window $server 2>/dev/null || true; rm -r "$folder"' EXIT
mkfifo "$folder/display"
Xvfb -displayfd 3 -noreset -screen 0 960x600x24 -nolisten tcp 3>"$folder/display" 2>/dev/null &
server=$!
read -r number <"$folder/display"
export DISPLAY=":$number"
unset WAYLAND_DISPLAY

echo '{"window_size": [960, 600], "size": {"Viewport": 2}}' >"$folder/window.json"
"${LIGHTGRID:-lightgrid}" view office --device cpu --settings "$folder/window.json" &
window=$!
until id=$(xdotool search --onlyvisible --name lightgrid); do sleep 1; done
xdotool windowfocus "$id"
sleep 20
# No panels, the samples as they are, and both halves.
for key in h n v; do
    xdotool key "$key"
    sleep 2
done
sleep "${1:-60}"
import -window root -quality 88 docs/pictures/strip-split.jpg
