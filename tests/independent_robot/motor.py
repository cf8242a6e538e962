"""A motor drive of the LK MF series (protocol V2.36): one frame in, at most one frame out."""

import struct
from math import pi

OFF, ON, STOP = 0x80, 0x88, 0x81
STATE_1, CLEAR_ERRORS, STATE_2, STATE_3 = 0x9A, 0x9B, 0x9C, 0x9D
ENCODER, TURNS, ANGLE = 0x90, 0x92, 0x94
TORQUE, SPEED = 0xA1, 0xA2
# The multi-motor command, on an identifier of its own.
MULTI_ID = 0x280
# Error bit of a command that stays away.
SIGNAL_LOST = 0x80

PEAK_TORQUE_NM = 4.5
RESISTANCE_OHM = 0.5
# Gain of the drive's own speed control, N m s/rad.
SPEED_GAIN = 0.05


class Motor:
    """State of one drive. Angles and torques at its interface are those of the robot, forward positive."""

    def __init__(self, parameters, side, timeout_s=0.0):
        self.nm_per_step = parameters.torque_constant_nm_a / parameters.current_steps_per_a
        self.back_emf_v_s = parameters.torque_constant_nm_a
        self.steps = parameters.encoder_steps
        self.sign = parameters.motor_signs[side]
        self.offset = (12345, 54321)[side]
        self.timeout_s = timeout_s
        self.on = True
        self.current_steps = 0
        self.target_speed = None
        self.commanded_s = None
        self.voltage_v = 24.0
        self.temperature_c = 31
        self.errors = 0
        # Faults: encoder reading (steps, dps) that is repeated, factor of the torque, no answer at all or to 0x80.
        self.frozen = None
        self.torque_factor = 1.0
        self.silent = self.ignores_off = False

    def torque_nm(self, speed_rad_s, time_s):
        """Returns the torque on the shaft."""
        if not self.on:
            return 0.0
        if self.timeout_s and self.commanded_s is not None and time_s - self.commanded_s > self.timeout_s:
            self.current_steps, self.target_speed = 0, None
            self.errors |= SIGNAL_LOST
        if self.target_speed is not None:
            self.current_steps = round(SPEED_GAIN * (self.target_speed - self.sign * speed_rad_s) / self.nm_per_step)
            self.current_steps = max(-2048, min(2048, self.current_steps))
        if self.current_steps == 0:
            return 0.0
        torque = self.sign * self.current_steps * self.nm_per_step
        # What the supply leaves at this speed.
        gain = self.back_emf_v_s / RESISTANCE_OHM
        high = min(PEAK_TORQUE_NM, max(0.0, gain * (self.voltage_v - self.back_emf_v_s * speed_rad_s)))
        low = max(-PEAK_TORQUE_NM, min(0.0, gain * (-self.voltage_v - self.back_emf_v_s * speed_rad_s)))
        return self.torque_factor * max(low, min(high, torque))

    def switch_off(self):
        """Switches the motor off, by command or on its own."""
        self.on = False
        self.current_steps, self.target_speed = 0, None

    def command_torque(self, current_steps, time_s):
        """Takes a torque current command; a motor that is off ignores it."""
        self.commanded_s = time_s
        if self.on:
            self.current_steps = max(-2048, min(2048, current_steps))
            self.target_speed = None

    def reading(self, angle_rad, speed_rad_s):
        """Returns encoder steps and speed in dps as the drive reports them."""
        if self.frozen is not None:
            return self.frozen
        angle = self.sign * angle_rad + 2 * pi * self.offset / self.steps
        steps = int(angle / (2 * pi) * self.steps // 1) % self.steps
        speed = round(self.sign * speed_rad_s * 180 / pi)
        return steps, max(-32768, min(32767, speed))

    def answer(self, data, angle_rad, speed_rad_s, time_s):
        """Carries a command out and returns the reply, or None where there is none."""
        command = data[0]
        if self.silent or (self.ignores_off and command == OFF):
            return None
        if command in (OFF, ON, STOP):
            if command == OFF:
                self.switch_off()
            elif command == ON:
                self.on = True
            else:
                self.current_steps, self.target_speed = 0, None
            self.commanded_s = time_s
            return bytes(data)
        if command == CLEAR_ERRORS:
            self.errors &= ~SIGNAL_LOST
        if command in (STATE_1, CLEAR_ERRORS):
            volts, amperes = round(100 * self.voltage_v), abs(self.current_steps) // 4
            state = 0x00 if self.on else 0x10
            return struct.pack("<BbhhBB", command, self.temperature_c, volts, amperes, state, self.errors)
        if command == TORQUE:
            self.command_torque(struct.unpack_from("<h", data, 4)[0], time_s)
        elif command == SPEED:
            self.commanded_s = time_s
            if self.on:
                self.target_speed = struct.unpack_from("<i", data, 4)[0] * 0.01 * pi / 180
        steps, speed = self.reading(angle_rad, speed_rad_s)
        if command in (STATE_2, TORQUE, SPEED):
            return struct.pack("<BbhhH", command, self.temperature_c, self.current_steps, speed, steps)
        if command == STATE_3:
            return struct.pack("<Bbhhh", command, self.temperature_c, self.current_steps, 0, -self.current_steps)
        if command == ENCODER:
            return struct.pack("<BxHHH", command, steps, steps, 0)
        if command == TURNS:
            hundredths = round(self.sign * angle_rad * 18000 / pi)
            return bytes([command]) + hundredths.to_bytes(8, "little", signed=True)[:7]
        if command == ANGLE:
            return struct.pack("<BxxxI", command, steps * 36000 // self.steps)
        return None

    def answer_multi(self, data, slot, angle_rad, speed_rad_s, time_s):
        """Takes this motor's slot of the multi-motor command."""
        single = bytes([TORQUE, 0, 0, 0]) + bytes(data[2 * slot : 2 * slot + 2]) + bytes(2)
        return self.answer(single, angle_rad, speed_rad_s, time_s)
