#!/bin/sh
# Makes docs/pictures/window-moving.jpg anew: three moments of the living room while the mouse turns the camera. Needs
# Xvfb, xdotool, ImageMagick, and `lightgrid` on the PATH or in LIGHTGRID:
#
#     sh docs/moving.sh
set -eu
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
Xvfb :77 -screen 0 1440x900x24 >/dev/null 2>&1 &
screen=$!
export DISPLAY=:77
sleep 1
"${LIGHTGRID:-lightgrid}" view living-room --device cpu --settings "$folder/settings.json" >/dev/null 2>&1 &
window=$!
trap 'kill $window $screen; wait; rm -r "$folder"' EXIT
# Until the first pictures are whole.
sleep 30
xdotool mousemove 700 450 mousedown 1
for step in $(seq 1 30); do
    xdotool mousemove $((700 + 2 * step)) 450
    sleep 0.08
    case $step in 1 | 14 | 28) import -window root -crop 854x826+293+50 +repage "$folder/$step.png" ;; esac
done
xdotool mouseup 1
montage "$folder/1.png" "$folder/14.png" "$folder/28.png" -resize 440x -tile 3x1 -geometry +2+0 -quality 82 \
    docs/pictures/window-moving.jpg
