"""A WitMotion JY901 with its x axis to the left and z axis up, so that its roll is the robot's pitch."""

import struct
from math import cos, pi, sin

ACCELERATION, RATE, ANGLE = 0x51, 0x52, 0x53
TEMPERATURE = 2530
VERSION = 0x2F10
# Height of the IMU above the axle, m.
HEIGHT_M = 0.10


def packet(kind, first, second, third, fourth):
    """Returns one packet of four 16-bit numbers."""
    head = struct.pack("<BBhhhH", 0x55, kind, first, second, third, fourth)
    return head + bytes([sum(head) & 0xFF])


def scaled(value, full_scale):
    """Returns a number as the IMU sends it, limited to its range."""
    return max(-32768, min(32767, round(value / full_scale * 32768)))


def wrapped(angle_rad):
    """Returns an angle as the IMU sends it."""
    return (round(angle_rad / pi * 32768) + 32768) % 65536 - 32768


class Imu:
    """Makes packets of the motion, with noise and faults."""

    def __init__(self, noise, angle_noise_rad=0.0005, rate_noise_rad_s=0.002, acceleration_noise_g=0.003):
        self.noise = noise
        self.angle_noise_rad = angle_noise_rad
        self.rate_noise_rad_s = rate_noise_rad_s
        self.acceleration_noise_g = acceleration_noise_g
        self.last = None
        # Faults.
        self.frozen = self.angle_frozen = self.rate_zero = False

    def packets(self, body):
        """Returns the packets of one reading."""
        if self.frozen and self.last:
            return b"".join(self.last)
        s, c = sin(body.pitch), cos(body.pitch)
        g = body.p.gravity_m_s2
        # Acceleration of the sensor's place, horizontal and vertical, less gravity.
        forward = body.x_acceleration + HEIGHT_M * (c * body.pitch_acceleration - s * body.pitch_rate**2)
        upward = -HEIGHT_M * (s * body.pitch_acceleration + c * body.pitch_rate**2) + g
        leftward = body.x_dot * body.yaw_rate
        noise = self.noise.gauss
        accelerations = [
            scaled(value / g + noise(0, self.acceleration_noise_g), 16)
            for value in (leftward, upward * s - forward * c, upward * c + forward * s)
        ]
        rates = [
            scaled((value + noise(0, self.rate_noise_rad_s)) * 180 / pi, 2000)
            for value in (body.pitch_rate, body.yaw_rate * s, body.yaw_rate * c)
        ]
        if self.rate_zero:
            rates = [0, 0, 0]
        angles = [wrapped(angle + noise(0, self.angle_noise_rad)) for angle in (body.pitch, 0.0, body.yaw)]
        sent = [
            packet(ACCELERATION, *accelerations, TEMPERATURE),
            packet(RATE, *rates, TEMPERATURE),
            packet(ANGLE, *angles, VERSION),
        ]
        if self.angle_frozen and self.last:
            sent[2] = self.last[2]
        self.last = sent
        return b"".join(sent)
