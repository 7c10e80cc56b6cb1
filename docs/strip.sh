#!/bin/sh
# Makes docs/pictures/strip-move.jpg and strip-split.jpg: a window while the camera moves, and its split view with
# the speed-up, which goes by the clock. Needs Xvfb, xdotool, ImageMagick, and `lightgrid` on the PATH or in LIGHTGRID:
#
#     sh docs/strip.sh
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
take() { import -window root -quality 88 "docs/pictures/$1.jpg"; }

echo '{"window_size": [960, 600], "size": {"Viewport": 2}}' >"$folder/window.json"
"${LIGHTGRID:-lightgrid}" view office --device cpu --settings "$folder/window.json" &
window=$!
until id=$(xdotool search --onlyvisible --name lightgrid); do sleep 1; done
xdotool windowfocus "$id"
sleep "${PATIENCE:-20}"
xdotool key h
sleep 5
# Half a turn of the hand: the picture is small while it lasts.
xdotool mousemove 480 300 mousedown 1
for _ in 1 2 3 4 5 6 7 8; do
    xdotool mousemove_relative -- -6 0
    sleep 0.2
done
take strip-move
xdotool mouseup 1
sleep 2
xdotool key v
# Longer on a slow machine: both halves need some tens of samples.
sleep "${SPLIT_SECONDS:-120}"
take strip-split
