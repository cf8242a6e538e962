#!/usr/bin/env bash
# Opens the window in a real X server, drives it like a person, and pictures it.
#
#   .ci/window.sh BINARY OUTDIR [LOG]
#
# Changes a weight, loads LOG by its typed path (without LOG: friction pairs made here) and fits it, runs LQR and
# FLQR on flat ground, lets the time play and saves a picture and a report; checks by the program's own account
# (--state-out) that each step happened, and by the pictures that they are not blank and differ. Needs Xvfb,
# openbox, xdotool, imagemagick and jq. Ends only the processes it started.
set -euo pipefail

usage="usage: .ci/window.sh BINARY OUTDIR [LOG]"
binary=$(realpath "${1:?$usage}")
mkdir -p "${2:?$usage}"
out=$(realpath "$2")
log=${3:+$(realpath "$3")}
source "$(dirname "$0")/display.sh"

# differ A B: the pictures differ in at least 500 pixels.
differ() {
    local pixels
    pixels=$(compare -metric AE "$out/$1.png" "$out/$2.png" null: 2>&1 || true)
    pixels=$(printf '%.0f' "${pixels%% *}")
    [ "$pixels" -ge 500 ] || fail "$1.png and $2.png are the same ($pixels pixels differ)"
}

if [ -z "$log" ]; then
    log="$scratch/pairs.csv"
    awk 'BEGIN {
        print "speed_rad_s,torque_nm"
        for (i = 0; i < 120; i++) {
            v = -59.5 + i; s = v < 0 ? -1 : 1
            printf "%.6f,%.6f\n", v, (0.04 + 0.03 * exp(-s * v / 4)) * s + 5e-4 * v + 0.001 * sin(2.4 * i)
        }
    }' >"$log"
fi

open_display 1280x800
open_window
until_state 30 "the simulated robot runs" '.simulation.seconds >= 2'
picture tune

echo "changing a weight"
gain=$(jq -c .gain "$state")
xdotool key ctrl+e
sleep 0.5
xdotool key ctrl+a
xdotool type --delay 30 450
xdotool key Return
until_state 10 "the weight is 450 and the gains are others" ".q_diagonal[0] == 450 and .gain != $gain"
sleep 1.5
picture weight
differ tune weight

echo "loading and fitting $log"
xdotool key ctrl+l
sleep 0.5
xdotool type --delay 15 "$log"
xdotool key Return
until_state 60 "the log is loaded" '.friction_tab.log.rows > 0'
picture log
xdotool key ctrl+Return
until_state 120 "the fit has parameters" '.friction_tab.fit.parameters | length > 0'
picture fit
differ weight log
differ log fit

echo "running LQR and FLQR"
xdotool key ctrl+4
until_state 10 "the experiments page is there" '.tab == "experiments"'
picture no-run
xdotool key ctrl+Return
until_state 120 "both runs are there, and FLQR hunts less" \
    '.experiments_tab.runs | length == 2 and .[0].statistics.x_m.std > .[1].statistics.x_m.std'
picture experiments
differ no-run experiments
xdotool key space
until_state 30 "the time plays" '.experiments_tab.cursor_s > 2'
xdotool key space
until_state 10 "the time is held" '.experiments_tab.playing == false'
picture experiments-later
differ experiments experiments-later
for file in page.png report.html; do
    rm -f "$out/$file"
    xdotool key ctrl+l
    sleep 0.5
    xdotool key ctrl+a
    xdotool type --delay 15 "$out/$file"
    xdotool key Return
    until_state 20 "$file is saved" ".message == \"Saved $out/$file.\""
done
colours=$(identify -format %k "$out/page.png")
[ "$colours" -ge 100 ] || fail "page.png is blank: it has $colours colours"
grep -q '<svg' "$out/report.html" || fail "report.html has no chart"

echo "light"
xdotool key ctrl+d
picture experiments-light
differ experiments-later experiments-light
xdotool key ctrl+2
until_state 10 "the friction page is back" '.tab == "friction"'
picture fit-light
xdotool key ctrl+1
until_state 10 "the tune page is back" '.tab == "tune"'
picture tune-light
differ tune tune-light
kill -0 "$program" 2>/dev/null || fail "the program ended by itself"

echo "any command by its name, and pages beside each other"
xdotool key ctrl+k
sleep 0.5
xdotool type --delay 30 "friction to the right"
picture palette
xdotool key Return
until_state 10 "friction is beside tune" '.shown == ["tune", "friction"]'
picture beside
differ tune-light beside

echo "coming back after a kill"
sleep 2
kill -9 "$program"
wait "$program" 2>/dev/null || true
open_window
until_state 30 "the session of before is offered" '.question == "restore"'
picture restore
xdotool key r
until_state 10 "the weight is back, beside the fit" '.q_diagonal[0] == 450 and .shown == ["tune", "friction"]'
xdotool key ctrl+q
until_state 10 "closing asks" '.question == "leave"'
picture leave
xdotool key d
for ((i = 0; i < 100; i++)); do
    kill -0 "$program" 2>/dev/null || break
    sleep 0.1
done
kill -0 "$program" 2>/dev/null && fail "the window did not close"
wait "$program" || fail "the closed window ended with code $?"

echo "watching an emulated robot"
open_window --tab robot --source emulated
until_state 30 "the robot is heard" '.robot_tab.connection == "connected" and .robot_tab.rows > 2000'
picture robot
xdotool key ctrl+Return
until_state 10 "the connection is closed" '.robot_tab.session == "closed"'
picture robot-closed
differ robot robot-closed
kill -0 "$program" 2>/dev/null || fail "the second window ended by itself"
echo "window.sh: passed; pictures and state in $out"
