"""Faults of the emulated robot: NAME[=VALUE]@START[..END].

START and END are seconds from the start, or with a plus sign before START from the first torque command:

  encoder-frozen=left|right|both   angle stays, speed reads zero
  encoder-stale=left|right|both    angle and speed stay
  imu-angle-frozen, imu-rate-zero, imu-frozen, imu-silent
  torque-reversed=left|right|both  torque-factor=FACTOR
  motors-swapped                   each motor has the identifier of the other
  held                             a hand brings the robot upright and holds it
  push=NEWTON                      at the height of the centre of mass
  command-latency=MS, reply-latency=MS
  motor-off=left|right|both        switches off without a command
  motor-silent=left|right|both     neither hears nor answers, and keeps its torque
  off-ignored=left|right|both      neither answers 0x80 nor switches off
  errors=left|right|both:BITS, voltage=V, temperature=C
  foreign=COMMAND:HZ               frames of another controller: 80, 81, 88, A1, A2 or 280; 0 Hz sends one
  cable-cut                        both ends of the adapter's terminal are closed
  cable-stalled                    the adapter no longer reads or writes
"""

import struct
from argparse import ArgumentTypeError

from body import Hand
from motor import MULTI_ID

SIDES = {"left": (0,), "right": (1,), "both": (0, 1)}
# Time of a motor's answer, s, supply and temperature without a fault.
REPLY_LATENCY_S = 0.0002
VOLTAGE_V = 24.0
TEMPERATURE_C = 31
# Torque current of another controller, steps.
FOREIGN_STEPS = 20


class Fault:
    """One fault and its time. `action` takes the robot, the value, and whether the fault begins or ends."""

    def __init__(self, text):
        what, _, when = text.partition("@")
        self.name, _, self.value = what.partition("=")
        if self.name not in FAULTS:
            raise ArgumentTypeError(f"unknown fault {self.name!r}; known are {', '.join(FAULTS)}")
        self.action = FAULTS[self.name]
        start, _, end = when.partition("..")
        self.from_torque = start.startswith("+")
        self.start_s = float(start or 0)
        self.end_s = float(end) if end else None


def motors(robot, sides):
    """Returns the motors of one side or both, with their index."""
    return [(side, robot.motors[side]) for side in SIDES[sides]]


def encoder_frozen(robot, sides, begins, keep_speed=False):
    angles, speeds = robot.body.motor_angles(), robot.body.motor_speeds()
    for side, motor in motors(robot, sides):
        motor.frozen = None
        if begins:
            steps, speed = motor.reading(angles[side], speeds[side])
            motor.frozen = steps, speed if keep_speed else 0


def encoder_stale(robot, sides, begins):
    encoder_frozen(robot, sides, begins, keep_speed=True)


def imu_angle_frozen(robot, _value, begins):
    robot.imu.angle_frozen = begins


def imu_rate_zero(robot, _value, begins):
    robot.imu.rate_zero = begins


def imu_frozen(robot, _value, begins):
    robot.imu.frozen = begins


def imu_silent(robot, _value, begins):
    robot.imu_silent = begins


def torque_reversed(robot, sides, begins):
    for _, motor in motors(robot, sides):
        motor.torque_factor = -1.0 if begins else 1.0


def torque_factor(robot, factor, begins):
    for motor in robot.motors:
        motor.torque_factor = float(factor) if begins else 1.0


def motors_swapped(robot, _value, begins):
    robot.sides = dict(zip(robot.parameters.motor_ids, (1, 0) if begins else (0, 1)))


def held(robot, _value, begins):
    robot.body.hand = Hand(robot.body.time_s, robot.body.pitch) if begins else None


def push(robot, newton, begins):
    robot.body.push_n = float(newton) if begins else 0.0
    robot.body.push_height_m = robot.parameters.com_height_m


def command_latency(robot, milliseconds, begins):
    robot.command_latency_s = float(milliseconds) / 1000 if begins else 0.0


def reply_latency(robot, milliseconds, begins):
    robot.reply_latency_s = float(milliseconds) / 1000 if begins else REPLY_LATENCY_S


def motor_off(robot, sides, begins):
    for _, motor in motors(robot, sides):
        motor.switch_off()
        motor.on = not begins


def motor_silent(robot, sides, begins):
    for _, motor in motors(robot, sides):
        motor.silent = begins


def off_ignored(robot, sides, begins):
    for _, motor in motors(robot, sides):
        motor.ignores_off = begins


def errors(robot, value, begins):
    sides, _, bits = value.partition(":")
    for _, motor in motors(robot, sides):
        motor.errors = int(bits, 0) if begins else 0


def voltage(robot, volts, begins):
    for motor in robot.motors:
        motor.voltage_v = float(volts) if begins else VOLTAGE_V


def temperature(robot, celsius, begins):
    for motor in robot.motors:
        motor.temperature_c = int(celsius) if begins else TEMPERATURE_C


def foreign(robot, value, begins):
    command, _, rate = value.partition(":")
    robot.foreign = begins
    if command == "280":
        identifier, data = MULTI_ID, struct.pack("<4h", FOREIGN_STEPS, -FOREIGN_STEPS, 0, 0)
    else:
        identifier = 0x140 + robot.parameters.motor_ids[0]
        data = struct.pack("<BxxxhH", int(command, 16), FOREIGN_STEPS if command == "A1" else 0, 0)

    def send(due):
        if robot.foreign:
            robot.foreign_frame(identifier, data)
            if float(rate):
                robot.at(due + 1.0 / float(rate), send)

    if begins:
        send(robot.now())


def cable_cut(robot, _value, _begins):
    robot.can.close()


def cable_stalled(robot, _value, begins):
    robot.stalled = begins


FAULTS = {
    action.__name__.replace("_", "-"): action
    for action in (
        encoder_frozen,
        encoder_stale,
        imu_angle_frozen,
        imu_rate_zero,
        imu_frozen,
        imu_silent,
        torque_reversed,
        torque_factor,
        motors_swapped,
        held,
        push,
        command_latency,
        reply_latency,
        motor_off,
        motor_silent,
        off_ignored,
        errors,
        voltage,
        temperature,
        foreign,
        cable_cut,
        cable_stalled,
    )
}
