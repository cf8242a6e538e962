#!/usr/bin/env bash
# Pictures of every page of the window, from a real X server with OpenGL in software.
#
#   .ci/pictures.sh BINARY OUTDIR [WIDTHxHEIGHT] [STEPS-OF-ZOOM]
#
# Each page with something on it, dark (NAME.png) and light (NAME-light.png), at 1280x800 unless another size is given,
# each step of zoom (as Ctrl and +) a tenth larger; with WINIT_X11_SCALE_FACTOR=2 before it as on a screen of scale 2.
# The README's pictures: .ci/pictures.sh target/release/flqr assets
set -euo pipefail

usage="usage: .ci/pictures.sh BINARY OUTDIR [WIDTHxHEIGHT] [STEPS-OF-ZOOM]"
binary=$(realpath "${1:?$usage}")
mkdir -p "${2:?$usage}"
target=$(realpath "$2")
out=$(mktemp -d)
source "$(dirname "$0")/display.sh"
model=$(realpath "$(dirname "$0")/../presets/paper.toml")
zoom=${4:-0}

# both NAME: the page as it is, dark and light.
both() {
    picture "$1"
    xdotool key ctrl+d
    picture "$1-light"
    xdotool key ctrl+d
    sleep 0.3
}

# by_name COMMAND: gives a command by its name.
by_name() {
    xdotool key ctrl+k
    sleep 0.7
    xdotool type --delay 30 "$1"
    sleep 0.3
    xdotool key Return
    sleep 0.5
}

zoomed() {
    for ((i = 0; i < zoom; i++)); do
        xdotool key ctrl+plus
        sleep 0.2
    done
}

open_display "${3:-1280x800}"
"$binary" simulate "$model" --scenario friction-sweep --controller pi --log "$scratch/sweep.csv" >/dev/null
open_window --tab tune
zoomed
until_state 90 "ten seconds are simulated" '.simulation.seconds >= 12'
both tune
xdotool key F1
until_state 20 "the manual is open" '.manual.page == "design.md"'
both manual
xdotool key Escape
until_state 20 "the manual is closed" '.manual == null'

xdotool key ctrl+2
until_state 20 "the friction page is there" '.tab == "friction"'
xdotool key ctrl+l
sleep 0.5
xdotool type --delay 15 "$scratch/sweep.csv"
xdotool key Return
until_state 60 "the log is loaded" '.friction_tab.log.rows > 0'
xdotool key ctrl+Return
until_state 180 "the fit has parameters" '.friction_tab.fit.parameters | length > 0'
# A picture says nothing of the machine that it was made on.
xdotool key ctrl+l
sleep 0.5
xdotool key ctrl+a
xdotool type --delay 15 "sweep.csv"
xdotool key Tab
both friction

xdotool key ctrl+4
until_state 20 "the experiments page is there" '.tab == "experiments"'
xdotool key ctrl+Return
until_state 180 "both runs are there" '.experiments_tab.runs | length == 2'
xdotool key space
until_state 60 "the time plays" '.experiments_tab.cursor_s > 8'
xdotool key space
both experiments

xdotool key ctrl+3
by_name "demo robot"
until_state 600 "the demonstration has an answer" '.refine_tab.refinement.effects | length > 0'
both refine
xdotool key ctrl+6
until_state 20 "the page of runs is there" '.tab == "runs"'
by_name "overlay the last two runs"
until_state 10 "two rows are ticked" '.runs_tab.shown | length == 2'
both runs
xdotool key ctrl+7
until_state 20 "the page of messages is there" '.tab == "log"'
both log
xdotool key ctrl+2
by_name "experiments to the right"
until_state 20 "two pages are beside each other" '.shown | length == 2'
both beside
close_window

rm -rf "$scratch/flqr"
open_window --tab robot --source emulated
zoomed
until_state 60 "the robot is heard" '.robot_tab.connection == "connected" and .robot_tab.rows > 2000'
both robot
close_window
cp "$out"/*.png "$target"
rm -r "$out"
