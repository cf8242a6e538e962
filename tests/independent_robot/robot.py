#!/usr/bin/env python3
"""Emulates the robot in real time: two LK motors behind an SLCAN adapter and a JY901, each on a pseudo-terminal.

Prints a JSON line with the names of both terminals, then one for each event, and runs until its standard input ends,
SIGTERM or --seconds. The line `rock` on standard input has the hand rock the robot once more.
"""

import argparse
import contextlib
import gc
import heapq
import itertools
import json
import os
import random
import select
import signal
import struct
import sys
import time

import faults
from body import Body, Hand, Parameters
from faults import REPLY_LATENCY_S, Fault
from imu import Imu
from motor import MULTI_ID, OFF, ON, STOP, TORQUE, Motor
from record import Record, torque_steps
from terminal import Terminal

# Bytes of the IMU that wait for a reader before they are dropped, as a serial driver drops those of a closed port.
UNREAD_BYTES = 400
# Transmission time of a reading at 115200 baud, s.
IMU_LATENCY_S = 0.003
# When the hand begins to rock the robot, and how long it is still before it may be driven, s.
ROCKING_S = 0.5
STILL_S = 0.3
# Interval of the on-board controller, s, and noise of its pitch, rad.
ONBOARD_S = 0.004
ONBOARD_NOISE_RAD = 0.001
ONBOARD_TORQUE_NM = 2.0
# Answers of the adapter to commands other than frames.
ADAPTER_ANSWERS = {b"V": b"V1013\r", b"v": b"v0102\r", b"N": b"N0001\r", b"F": b"F00\r", b"T": b"\a"}


class Robot:
    """The body, the devices around it, and the events in time."""

    def __init__(self, options):
        self.options = options
        self.parameters = Parameters.read(options.model)
        self.record = Record(options.truth_s)
        self.noise = random.Random(options.seed)
        self.motors = [Motor(self.parameters, side, options.motor_timeout_ms / 1000) for side in (0, 1)]
        self.body = Body(self.parameters, self.torques, options.wheels_in_air)
        self.imu = Imu(self.noise)
        self.can, self.serial = Terminal(), Terminal(UNREAD_BYTES)
        # Index of the motor that has each identifier.
        self.sides = dict(zip(self.parameters.motor_ids, (0, 1)))
        self.line = b""
        self.adapter_mode = None
        self.adapter_lines = []
        self.onboard = options.onboard
        self.onboard_gains = [float(gain) for gain in options.gains.split(",")]
        # States of faults.
        self.stalled = self.foreign = self.imu_silent = False
        self.command_latency_s, self.reply_latency_s = 0.0, REPLY_LATENCY_S
        self.queue = []
        self.order = itertools.count()
        self.started = time.monotonic()
        self.worst_lateness_s = 0.0
        if options.hold == "none":
            self.body.pitch = options.lean
        elif not options.wheels_in_air:
            self.body.hand = Hand(0.0, options.lean, lean_rad=options.lean)
            self.rock(ROCKING_S)
        if options.hold == "until":
            self.at(options.hold_seconds, self.release)
        self.at(0.0, self.imu_reading)
        if self.onboard != "none":
            self.at(0.0, self.onboard_tick)
        for fault in options.fault:
            if not fault.from_torque:
                self.schedule(fault, 0.0)

    # Time.

    def now(self):
        """Returns the time since the start, s."""
        return time.monotonic() - self.started

    def at(self, time_s, action, *arguments):
        """Has an action done at a time; it is given that time."""
        heapq.heappush(self.queue, (time_s, next(self.order), action, arguments))

    def announce(self, time_s, event):
        """Prints an event."""
        print(json.dumps({"event": event, "time_s": round(time_s, 6)}), flush=True)

    def schedule(self, fault, origin_s):
        """Has a fault begin, and end."""
        self.at(origin_s + fault.start_s, self.begin, fault)
        if fault.end_s is not None:
            self.at(origin_s + fault.end_s, lambda _time_s: fault.action(self, fault.value, False))

    def begin(self, time_s, fault):
        """Begins a fault; a push is none."""
        if self.record.fault_s is None and fault.action is not faults.push:
            self.record.fault_s = time_s
        fault.action(self, fault.value, True)

    def run(self):
        """Runs until the end is asked for."""
        woken, waker = os.pipe()
        os.set_blocking(waker, False)
        signal.set_wakeup_fd(waker)
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: None)
        while (now := self.now()) < self.options.seconds:
            if self.record.first_torque_s is not None and self.record.off_s is None:
                self.worst_lateness_s = max(self.worst_lateness_s, now - self.queue[0][0])
            while self.queue[0][0] <= now:
                time_s, _, action, arguments = heapq.heappop(self.queue)
                self.advance(self.now())
                action(time_s, *arguments)
            wait = max(0.0, min(self.queue[0][0], self.options.seconds) - self.now())
            adapter = [] if self.stalled or self.can.is_closed() else [self.can.master]
            ready, _, _ = select.select([woken, sys.stdin, self.serial.master, *adapter], [], [], wait)
            if self.can.master in ready:
                self.received(self.can.read())
            if self.serial.master in ready:
                self.serial.read()
            if woken in ready:
                break
            if sys.stdin in ready:
                order = os.read(sys.stdin.fileno(), 4096)
                if not order:
                    break
                if b"rock" in order and self.body.hand:
                    self.rock(self.now())
        self.advance(self.now())

    def advance(self, now):
        """Brings the body up to now, and records its motion on the way."""
        body, record = self.body, self.record
        on = [motor.on for motor in self.motors]
        while record.next_s <= now:
            body.advance(record.next_s)
            record.add_row(body, self.torques(body.motor_speeds()), on)
        body.advance(now)
        if record.first_torque_s is not None and any(on):
            record.note_peaks(body)
        if record.fell_s is None and body.lies():
            record.fell_s = now
            self.announce(now, "fell")

    def torques(self, speeds):
        """Returns the torques of both shafts at their speeds."""
        time_s = self.body.time_s
        torques = [motor.torque_nm(speed, time_s) for motor, speed in zip(self.motors, speeds)]
        if any(torques):
            self.record.last_torque_s = time_s
        return torques

    def rock(self, time_s):
        """Has the hand rock the body for a while from then on."""
        self.body.hand.rocking_s = (time_s, time_s + self.options.rock)
        self.at(time_s + self.options.rock + STILL_S, self.announce, "still")

    def release(self, _time_s):
        """Has the hand let go."""
        self.body.hand = None

    # The adapter.

    def received(self, data):
        """Takes the lines that are complete."""
        *lines, self.line = (self.line + data).split(b"\r")
        now = self.now()
        for line in lines:
            if self.command_latency_s:
                self.at(now + self.command_latency_s, self.adapter_line, line)
            else:
                self.advance(now)
                self.adapter_line(now, line)

    def adapter_line(self, time_s, line):
        """Carries out one line of the host."""
        kind = line[:1]
        if kind == b"t":
            self.adapter_frame(time_s, line)
            return
        if kind in (b"S", b"O", b"L", b"C"):
            self.adapter_lines.append(line.decode(errors="replace"))
            if kind != b"S":
                self.adapter_mode = kind
        self.send(ADAPTER_ANSWERS.get(kind, b"\r"))

    def adapter_frame(self, time_s, line):
        """Puts a frame of the host on the bus."""
        try:
            identifier, length, data = int(line[1:4], 16), int(line[4:5]), bytes.fromhex(line[5:].decode())
        except ValueError:
            length, data = None, b""
        if self.adapter_mode != b"O" or len(data) != length:
            self.send(b"\a")
            return
        self.send(b"z\r")
        record = self.record
        record.frames.append((time_s, identifier, data))
        if record.first_torque_s is None and torque_steps(identifier, data):
            record.first_torque_s, record.x_at_torque = time_s, self.body.x
            self.announce(time_s, "torque")
            for fault in self.options.fault:
                if fault.from_torque:
                    self.schedule(fault, time_s)
            if self.options.hold == "armed":
                self.at(time_s + self.options.release_ms / 1000, self.release)
        record.unanswered += not self.to_motors(time_s, identifier, data)

    def send(self, data):
        """Sends to the host after the latency of replies."""
        self.at(self.now() + self.reply_latency_s, self.send_now, data)

    def send_now(self, _time_s, data):
        """Sends to the host."""
        if not self.stalled:
            self.can.write(data)

    def bus_frame(self, identifier, data):
        """Shows the host a frame on the bus."""
        if self.adapter_mode in (b"O", b"L"):
            self.send(b"t%03X%d%s\r" % (identifier, len(data), data.hex().upper().encode()))

    # The bus.

    def to_motors(self, time_s, identifier, data):
        """Hands a frame to the motors, whoever sent it; returns whether one answered."""
        if len(data) != 8:
            return False
        if self.onboard == "silent" and (identifier == MULTI_ID or data[0] in (OFF, ON, STOP, TORQUE)):
            self.onboard = "none"
        angles, speeds = self.body.motor_angles(), self.body.motor_speeds()
        answered = False
        for number, side in self.sides.items():
            motor = self.motors[side]
            if identifier == MULTI_ID:
                reply = motor.answer_multi(data, number - 1, angles[side], speeds[side], time_s)
            elif identifier == 0x140 + number:
                reply = motor.answer(data, angles[side], speeds[side], time_s)
            else:
                continue
            if reply:
                answered = True
                self.bus_frame(self.options.reply_base + number, reply)
        if any(motor.on for motor in self.motors):
            self.record.off_s = None
        elif self.record.off_s is None:
            self.record.off_s = time_s
        return answered

    def foreign_frame(self, identifier, data):
        """Puts a frame of another controller on the bus."""
        self.bus_frame(identifier, data)
        self.to_motors(self.now(), identifier, data)

    # What the robot does without the host.

    def imu_reading(self, time_s):
        """Sends a reading, and has the next one taken."""
        if not self.imu_silent:
            data = self.imu.packets(self.body)
            self.at(self.now() + IMU_LATENCY_S, lambda _time_s: self.serial.write(data))
        self.at(time_s + 1.0 / self.parameters.imu_rate_hz, self.imu_reading)

    def onboard_tick(self, time_s):
        """Has the on-board controller balance the robot, unless the host has taken over from one that is silent."""
        body = self.body
        pitch = body.pitch + self.noise.gauss(0, ONBOARD_NOISE_RAD)
        state = (body.x, body.x_dot, pitch, body.pitch_rate)
        torque = 0.0 if body.hand else -sum(gain * value for gain, value in zip(self.onboard_gains, state))
        torque = max(-ONBOARD_TORQUE_NM, min(ONBOARD_TORQUE_NM, torque))
        for number, side in self.sides.items():
            motor = self.motors[side]
            steps = round(motor.sign * torque / motor.nm_per_step)
            if self.onboard == "bus":
                self.foreign_frame(0x140 + number, struct.pack("<BxxxhH", TORQUE, steps, 0))
            elif self.onboard == "silent":
                motor.command_torque(steps, self.now())
        self.at(time_s + ONBOARD_S, self.onboard_tick)

    # Results.

    def report(self):
        """Returns what happened, for JSON."""
        return {
            **self.record.report(),
            "started_s": self.started,
            "seconds": self.now(),
            "adapter_lines": self.adapter_lines,
            "lost_bytes": self.can.lost_bytes,
            "largest_torque_at_arming_nm": self.record.torque_at_arming_nm(self.motors[0].nm_per_step),
            "motors_on": [motor.on for motor in self.motors],
            "torques_nm": self.torques(self.body.motor_speeds()),
            "pitch_rad": self.body.pitch,
            "worst_lateness_s": self.worst_lateness_s,
        }

    def save(self):
        """Writes the files that were asked for."""
        report = self.report()
        if self.options.truth:
            self.record.write_motion(self.options.truth)
        if self.options.frames:
            self.record.write_frames(self.options.frames)
        if self.options.report:
            with open(self.options.report, "w", encoding="ascii") as file:
                json.dump(report, file, indent=1)


def arguments():
    """Reads the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=faults.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", default="presets/paper.toml", help="model file of the robot")
    parser.add_argument("--fault", action="append", default=[], type=Fault, metavar="NAME[=VALUE]@START[..END]")
    parser.add_argument(
        "--hold",
        choices=["armed", "until", "always", "none"],
        default="armed",
        help="a hand holds the robot until the first torque command, until --hold-seconds, always or never",
    )
    parser.add_argument("--hold-seconds", type=float, default=6.0)
    parser.add_argument("--release-ms", type=float, default=0.0, help="from the first torque command to the release")
    parser.add_argument("--rock", type=float, default=2.0, help="time for which the hand rocks the body, s")
    parser.add_argument(
        "--lean", type=float, default=0.0, help="pitch at which the hand holds the body, or at which it starts, rad"
    )
    parser.add_argument("--wheels-in-air", action="store_true")
    parser.add_argument(
        "--onboard",
        choices=["none", "silent", "bus"],
        default="none",
        help="on-board controller: inside the drives until the host commands them, or with frames on the bus",
    )
    parser.add_argument(
        "--gains",
        default="-1.0,-0.618,-9.768,-0.8135",
        help="its gains of x, x_dot, pitch and pitch rate for each motor",
    )
    parser.add_argument(
        "--motor-timeout-ms", type=float, default=0.0, help="time without commands until torque drops; 0: never"
    )
    parser.add_argument("--reply-base", type=lambda text: int(text, 0), default=0x140, help="0x140 or 0x180")
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--truth", metavar="CSV", help="true motion")
    parser.add_argument("--truth-s", type=float, default=0.005, help="interval of its rows")
    parser.add_argument("--frames", metavar="LOG", help="frames received, as candump logs them")
    parser.add_argument("--report", metavar="JSON")
    return parser.parse_args()


def take_precedence():
    """Goes before other programs, where that is allowed: a real robot does not wait for this machine."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
    except OSError:
        with contextlib.suppress(OSError):
            os.nice(-10)


def main():
    robot = Robot(arguments())
    names = {"can": f"slcan:{robot.can.name}@1000000", "imu": f"serial:{robot.serial.name}@115200"}
    print(json.dumps(names), flush=True)
    # Nothing here makes cycles, and a collection would delay the motors' answers.
    gc.disable()
    take_precedence()
    robot.run()
    robot.save()


if __name__ == "__main__":
    main()
