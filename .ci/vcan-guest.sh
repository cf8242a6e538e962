#!/bin/sh
# Inside the virtual machine of .ci/vcan.sh: the program on real SocketCAN, with can-utils as a third party.
set -eu
model=/model.toml
step() { echo "== $*"; }
fail() { echo "FAILED: $*"; exit 1; }
# The last status line that a session printed.
last() { grep '"type":"status"' "$1" | tail -n 1; }

step "frames both ways, states, and every dropped frame counted"
FLQR_REQUIRE_CAN=1 socketcan --test-threads=1

step "interfaces are listed"
flqr interfaces --json | jq -e '.can | map(.name) | (index("vcan0") != null and index("vcan1") != null)' >/dev/null ||
    fail "flqr interfaces"

step "emulator and monitor as two processes, candump as a third party"
flqr emulate $model --can vcan0 --balancing --json --seconds 14 > emulate.json &
emulator=$!
sleep 1
candump -L -n 400 -T 8000 vcan0 > dump.log &
dump=$!
flqr monitor can:vcan0 --model $model --seconds 5 --record watched.csv --json > monitor.jsonl
wait $dump
last monitor.jsonl | jq -e '.connection == "connected" and .motors.left.rate_hz > 50 and .bus.sent == 0' >/dev/null ||
    { last monitor.jsonl; fail "the monitor hears the emulated robot and sends nothing"; }
grep -q ' 141#A1' dump.log || fail "candump sees torque commands"
[ "$(grep -c ' vcan0 ' watched.log)" -gt 500 ] || fail "the recording has the raw frames"
kill $emulator
wait $emulator || true

step "cansend asks a motor, and it answers"
# No controller is on the bus here that would ask as well. A motor may answer on the identifier that it is asked on.
flqr emulate $model --can vcan0 --json --seconds 60 > emulate.json &
emulator=$!
sleep 1
candump -L -n 2 -T 8000 vcan0,142:7FF > reply.log &
dump=$!
sleep 1
cansend vcan0 142#9A00000000000000
wait $dump
cat reply.log
grep -q ' 142#9A00000000000000$' reply.log || fail "candump sees the query"
grep ' 142#9A' reply.log | grep -qv '#9A00000000000000$' || fail "motor 2 answers with its state"
kill $emulator
wait $emulator || true

step "driven for 60 s over CAN, recorded as candump hears it"
# Replies have identifiers of their own here, so that the frames of each identifier have one sender and one order.
flqr emulate $model --can vcan0 --imu --reply-id 0x180 --json --seconds 90 > emulate.json &
emulator=$!
sleep 1
imu=$(head -n 1 emulate.json | jq -r .imu)
candump -L -r 8388608 vcan0 > dump.log &
dump=$!
sleep 1
flqr drive can:vcan0 $model --imu "serial:$imu@115200" --arm --yes --seconds 60 --record driven.csv --json > drive.jsonl ||
    { tail -n 3 drive.jsonl; fail "the robot was driven for 60 s"; }
sleep 1
kill $dump
wait $dump || true
last drive.jsonl
tail -n 1 drive.jsonl
tail -n 1 drive.jsonl | jq -e '.type == "end" and .stopped_by == "time_over" and .motors_off and .problem == null and
    .recording.rows > 60000 and .recording.rows_lost == 0' >/dev/null || fail "the run ended as it should"
last drive.jsonl | jq -e '.bus.dropped == 0 and .bus.lost == 0 and .bus.late < 60 and .bus.load > 0.3' >/dev/null ||
    fail "no frame was lost, and fewer than one tick of a thousand came late"
# frames FILE: the frames of each identifier in their order, one identifier after the other, without times and directions
frames() { grep -F " vcan0 " "$1" | cut -d " " -f 3 | sort -s -k 1.1,1.3; }
frames dump.log > heard.txt
frames driven.log > recorded.txt
wc -l heard.txt recorded.txt
cmp heard.txt recorded.txt || fail "the recording has the frames that candump heard"
[ "$(wc -l < recorded.txt)" -gt 240000 ] || fail "four frames in each of 60,000 ticks"
cut -c 2-18 driven.log | sort -n -c || fail "times of the recording rise"
tail -n 20 driven.log | grep ' 14[12]#' | tail -n 2 | grep -q ' 142#8000000000000000 T' ||
    fail "the motors were switched off in the end"
kill $emulator
wait $emulator || true

step "slcand on the emulator's pseudo-terminal"
flqr emulate $model --balancing --json --seconds 12 > emulate.json &
emulator=$!
sleep 1
slcan=$(head -n 1 emulate.json | jq -r .slcan)
slcand -o -c -s8 "$slcan" slcan0
sleep 0.5
ip link set slcan0 up
candump -L -n 100 -T 5000 slcan0 > slcan.log
[ "$(grep -c ' slcan0 14[12]#A1' slcan.log)" -gt 50 ] || { head slcan.log; fail "slcand hears the emulated adapter"; }
flqr monitor can:slcan0 --model $model --seconds 3 --json > monitor.jsonl
last monitor.jsonl | jq -e '.motors.left.rate_hz > 20' >/dev/null || { last monitor.jsonl; fail "the monitor hears it too"; }
kill $emulator
wait $emulator || true

step "an interface that is not there"
flqr monitor can:can7 --seconds 1 2> refused.txt && fail "can7 was opened" || true
cat refused.txt
grep -q can7 refused.txt || fail "the refusal names the interface"
step done
