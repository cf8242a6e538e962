# What the scripts that drive a real window share: an X server of their own, windows in it, and the program's own
# account of itself (--state-out). Sourced after `out` is set to the folder of the results; needs Xvfb, openbox,
# xdotool, imagemagick and jq. Ends only the processes that it started.

state="$out/state.json"
scratch=$(mktemp -d)
started=()

cleanup() {
    local status=$?
    for ((i = ${#started[@]} - 1; i >= 0; i--)); do
        kill "${started[i]}" 2>/dev/null || true
        wait "${started[i]}" 2>/dev/null || true
    done
    rm -rf "$scratch"
    [ "$status" = 0 ] || echo "${0##*/}: what there is up to here is in $out" >&2
}
trap cleanup EXIT

fail() {
    echo "${0##*/}: $*" >&2
    [ -s "$state" ] && cat "$state" >&2
    [ -s "$scratch/stderr" ] && cat "$scratch/stderr" >&2
    import -window root "$out/failed.png" 2>/dev/null || true
    exit 1
}

# open_display WIDTHxHEIGHT: a display number of our own; Xvfb reports the one that it found free.
open_display() {
    size=$1
    rm -f "$scratch/display"
    mkfifo "$scratch/display"
    exec {display_pipe}<>"$scratch/display"
    Xvfb -displayfd "$display_pipe" -screen 0 "${size}x24" -nolisten tcp >/dev/null 2>&1 &
    started+=($!)
    read -r -t 20 -u "$display_pipe" display || fail "Xvfb did not start"
    export DISPLAY=":$display"
    openbox >/dev/null 2>&1 &
    started+=($!)
    sleep 0.5
}

# start_program ARGUMENT…: the program, with settings of its own; its number is in `program`.
start_program() {
    rm -f "$state"
    LIBGL_ALWAYS_SOFTWARE=1 XDG_CONFIG_HOME="$scratch" XDG_STATE_HOME="$scratch" "$binary" --state-out "$state" "$@" \
        2>"$scratch/stderr" &
    program=$!
    started+=("$program")
}

# open_window ARGUMENT…: the same, and its window over the whole display.
open_window() {
    start_program "$@"
    window=$(timeout 60 xdotool search --sync --onlyvisible --name '^flqr' | tail -1) || fail "no window appeared"
    xdotool windowactivate --sync "$window" windowmove "$window" 0 0 \
        windowsize "$window" $((${size%x*} - 2)) $((${size#*x} - 24))
}

# close_window: ends the program at once.
close_window() {
    kill "$program" 2>/dev/null || true
    wait "$program" 2>/dev/null || true
}

# until_state SECONDS WHAT JQ-CONDITION: waits until the condition holds of the state file.
until_state() {
    for ((i = 0; i < $1 * 10; i++)); do
        jq -e "$3" "$state" >/dev/null 2>&1 && return
        kill -0 "$program" 2>/dev/null || fail "the program ended before: $2"
        sleep 0.1
    done
    fail "did not happen within $1 s: $2"
}

# picture NAME: a screenshot that is not blank, the pointer out of the way.
picture() {
    xdotool mousemove $((${size%x*} / 2)) 40
    sleep 0.6
    import -window root "$out/$1.png"
    local colours
    colours=$(identify -format %k "$out/$1.png")
    [ "$colours" -ge 100 ] || fail "$1.png is blank: it has $colours colours"
    echo "$1.png: $colours colours"
}
