#!/usr/bin/env bash
# What the window costs, measured on a real one with OpenGL in software: processor time before the first frame and at
# rest, loading a log of 100 MB, memory with an hour of 1 kHz in twelve channels.
#
#   .ci/figures.sh BINARY OUTDIR [SECONDS-OF-REST]
#
# Prints one line a figure. The processor's times hold on a busy machine too; loading and the longest frame are times
# by the clock. The frame itself, without a graphics driver: cargo bench -p flqr-gui --bench frame.
set -euo pipefail

usage="usage: .ci/figures.sh BINARY OUTDIR [SECONDS-OF-REST]"
binary=$(realpath "${1:?$usage}")
mkdir -p "${2:?$usage}"
out=$(realpath "$2")
rest=${3:-20}
source "$(dirname "$0")/display.sh"
ticks=$(getconf CLK_TCK)

# cpu_ms: processor time of the program so far, user and system, in ms.
cpu_ms() {
    awk -v ticks="$ticks" '{ sub(/.*\) /, ""); print int(1000 * ($12 + $13) / ticks) }' "/proc/$program/stat"
}

# at_rest: waits until no frame was drawn for two seconds.
at_rest() {
    local before=-1 now
    for ((i = 0; i < 30; i++)); do
        now=$(jq .frames.drawn "$state")
        [ "$now" = "$before" ] && return
        before=$now
        sleep 2
    done
    fail "frames are drawn without end"
}

# make_log ROWS FILE: a robot's log at 1 kHz: time and twelve channels.
make_log() {
    awk -v rows="$1" 'BEGIN {
        printf "time_s,x_m,x_dot_m_s,pitch_rad,pitch_rate_rad_s,motor_angle_left_rad,motor_angle_right_rad,"
        print "motor_speed_left_rad_s,motor_speed_right_rad_s,torque_left_nm,torque_right_nm,current_a,temperature_c"
        for (row = 0; row < 10000; row++)
            for (column = 1; column <= 12; column++)
                rest[row] = rest[row] sprintf(",%.5f", sin(0.0137 * row * column) + 0.05 * sin(7.7 * row + column))
        for (row = 0; row < rows; row++) printf "%.3f%s\n", row / 1000, rest[row % 10000]
    }' >"$2"
}

open_display 1280x800

start_program --paused
until [ -s "$state" ]; do
    kill -0 "$program" || fail "the program ended before its first frame"
    sleep 0.005
done
echo "processor time before the first frame: at most $(cpu_ms) ms"
close_window

for tab in tune friction refine experiments robot runs log; do
    open_window --tab "$tab" --paused
    until_state 20 "frames are drawn" '.frames.drawn > 3'
    at_rest
    frames=$(jq .frames.drawn "$state")
    before=$(cpu_ms)
    sleep "$rest"
    echo "at rest for $rest s, $tab: $(($(cpu_ms) - before)) ms of processor time, $(($(jq .frames.drawn "$state") - frames)) frames"
    close_window
done

make_log 1020000 "$scratch/large.csv"
open_window --tab friction --paused
until_state 20 "frames are drawn" '.frames.drawn > 3'
# The longest frame is that of the last ten seconds: those of the start must be over.
sleep 11
xdotool key ctrl+l
sleep 0.5
xdotool type --delay 15 "$scratch/large.csv"
sleep 1
before=$(cpu_ms)
xdotool key Return
until_state 120 "the log is loaded" '.friction_tab.log.rows > 0'
sleep 1
echo "log of $(($(stat -c %s "$scratch/large.csv") / 1000000)) MB: loaded in $(jq '.friction_tab.log.seconds * 100 | round / 100' "$state") s, longest frame meanwhile $(jq .frames.longest_ms "$state") ms, $(($(cpu_ms) - before)) ms of processor time"
close_window
rm "$scratch/large.csv"

make_log 3600000 "$scratch/hour.csv"
open_window --paused --log "$scratch/hour.csv"
until_state 120 "the hour is loaded" '.friction_tab.log.rows == 3600000'
at_rest
echo "memory with an hour of twelve channels: $(awk '/VmRSS/ { print int($2 / 1000) }' "/proc/$program/status") MB, at most $(awk '/VmHWM/ { print int($2 / 1000) }' "/proc/$program/status") MB"
close_window
