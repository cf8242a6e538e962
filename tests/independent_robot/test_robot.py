"""Checks the emulated robot against energy, a known controller, and the worked bytes of the protocols."""

import struct
import unittest
from dataclasses import replace
from math import atan2, log, pi
from pathlib import Path
from random import Random

from body import Body, Friction, Hand, Parameters
from imu import ANGLE, Imu, packet, scaled, wrapped
from motor import Motor

PAPER = Path(__file__).parents[2] / "presets" / "paper.toml"
# `flqr gains presets/paper.toml --json`: gains, and the poles of the closed loop.
GAINS = (-1.0, -0.6180850050035329, -9.767617634076158, -0.8134580593446558)
SLOW_POLE = complex(-0.28442161662723214, 1.0219455043180048)


def parameters(friction=True):
    found = Parameters.read(PAPER)
    return found if friction else replace(found, friction=(Friction(), Friction()))


class Dynamics(unittest.TestCase):
    def test_energy_is_conserved_without_friction(self):
        body = Body(parameters(friction=False), lambda speeds: (0.0, 0.0))
        body.pitch, body.x_dot, body.yaw_rate = 0.1, 0.3, 2.0
        before = body.energy_j()
        while abs(body.pitch) < 1.3 and body.time_s < 3.0:
            body.advance(body.time_s + 0.001)
            self.assertLess(abs(body.energy_j() - before), 1e-3)
        self.assertGreater(body.time_s, 0.3)

    def test_work_of_the_motors_and_friction_is_the_change_of_energy(self):
        work = 0.0
        found = parameters()
        viscous = tuple(replace(f, coulomb_nm=0.0, static_nm=0.0, viscous_nm_s_rad=0.01) for f in found.friction)
        found = replace(found, friction=viscous)
        body = Body(found, lambda speeds: (0.2, 0.1))
        before = body.energy_j()
        for _ in range(2000):
            speeds = body.motor_speeds()
            body.advance(body.time_s + 0.0001)
            for start, end, torque, f in zip(speeds, body.motor_speeds(), (0.2, 0.1), viscous):
                mean = 0.5 * (start + end)
                work += 0.0001 * mean * (torque - f.viscous_nm_s_rad * mean - f.offset_nm)
        self.assertAlmostEqual(body.energy_j() - before, work, delta=1e-3 * abs(work))

    def test_known_gains_balance_with_the_known_slow_pole(self):
        state = {}

        def torques(speeds):
            body = state["body"]
            values = (body.x, body.x_dot, body.pitch, body.pitch_rate)
            return [-sum(gain * value for gain, value in zip(GAINS, values))] * 2

        body = state["body"] = Body(parameters(friction=False), torques)
        body.x = 0.001
        crossings, peaks, last = [], [], body.x_dot
        while body.time_s < 15.0:
            body.advance(body.time_s + 0.001)
            if last * body.x_dot < 0 and body.time_s > 1.0:
                crossings.append(body.time_s)
                peaks.append(abs(body.x))
            last = body.x_dot
        period = 2 * (crossings[3] - crossings[1]) / 2
        self.assertAlmostEqual(2 * pi / period, SLOW_POLE.imag, delta=0.02)
        self.assertAlmostEqual(log(peaks[3] / peaks[1]) / period, SLOW_POLE.real, delta=0.02)

    def test_shafts_stick_below_static_friction_and_break_away_above(self):
        found = parameters()
        for torque, moves in ((0.05, False), (0.08, True)):
            body = Body(found, lambda speeds, torque=torque: (torque, torque), in_air=True)
            body.advance(0.5)
            self.assertEqual(max(map(abs, body.motor_angles())) > 1e-9, moves)

    def test_stuck_shafts_turn_robot_into_one_rigid_body(self):
        found = replace(parameters(), friction=(Friction(5.0, 5.0), Friction(5.0, 5.0)))
        body = Body(found, lambda speeds: (0.0, 0.0))
        body.pitch = 0.05
        before = body.motor_angles()
        body.advance(0.3)
        for start, end in zip(before, body.motor_angles()):
            self.assertAlmostEqual(start, end, delta=1e-6)
        self.assertGreater(body.pitch, 0.06)

    def test_wheels_apart_turn_the_robot_towards_the_slower(self):
        body = Body(parameters(friction=False), lambda speeds: (-0.1, 0.1))
        body.advance(0.1)
        wheel = body.p.track_width_m / 2 / body.p.wheel_radius_m
        inertia = 0.15 + 2 * (1.0 + 0.002 / 0.055**2) * 0.2**2
        self.assertAlmostEqual(body.yaw_rate, 0.1 * 2 * 0.1 * wheel / inertia, delta=1e-6)
        left, right = body.motor_angles()
        self.assertAlmostEqual((right - left) / (2 * wheel), body.yaw, delta=1e-9)

    def test_floor_stops_the_fall(self):
        body = Body(parameters(), lambda speeds: (0.0, 0.0))
        body.pitch = 0.1
        body.advance(3.0)
        self.assertTrue(body.lies())
        self.assertAlmostEqual(body.x_dot, 0.0, delta=1e-6)

    def test_hand_holds_against_torque(self):
        body = Body(parameters(), lambda speeds: (2.0, 2.0))
        body.hand = Hand(0.0)
        body.advance(1.0)
        self.assertLess(abs(body.pitch), 0.002)
        self.assertEqual(body.x, 0.0)


class Protocols(unittest.TestCase):
    def motor(self, side):
        return Motor(parameters(friction=False), side)

    def test_torque_commands(self):
        for side, text, torque in ((0, "A100000084010000", 1.0), (1, "A10000003EFF0000", 0.5)):
            motor = self.motor(side)
            reply = motor.answer(bytes.fromhex(text), 0.0, 0.0, 0.0)
            self.assertEqual((len(reply), reply[0]), (8, 0xA1))
            self.assertAlmostEqual(motor.torque_nm(0.0, 0.0), torque, delta=0.0014)

    def test_multi_motor_command(self):
        data = bytes.fromhex("84017CFE00000000")
        torques = []
        for side in (0, 1):
            motor = self.motor(side)
            self.assertEqual(motor.answer_multi(data, side, 0.0, 0.0, 0.0)[0], 0xA1)
            torques.append(motor.torque_nm(0.0, 0.0))
        self.assertAlmostEqual(torques[0], torques[1])

    def test_state_2(self):
        motor = self.motor(0)
        motor.temperature_c, motor.current_steps, motor.offset = 35, 310, 0xC000
        reply = motor.answer(bytes([0x9C]) + bytes(7), 0.0, -287 * pi / 180, 0.0)
        self.assertEqual(reply.hex(), "9c233601e1fe00c0")

    def test_state_1(self):
        motor = self.motor(0)
        motor.temperature_c, motor.voltage_v, motor.errors = 35, 24.01, 8
        self.assertEqual(motor.answer(bytes([0x9A]) + bytes(7), 0.0, 0.0, 0.0).hex(), "9a23610900000008")

    def test_turns(self):
        reply = self.motor(0).answer(bytes([0x92]) + bytes(7), -2 * pi, 0.0, 0.0)
        self.assertEqual(reply.hex(), "926073ffffffffff")

    def test_motor_keeps_its_torque_until_it_is_off_or_its_time_is_out(self):
        command = bytes([0xA1, 0, 0, 0]) + struct.pack("<hxx", 100)
        for timeout, after in ((0.0, True), (0.1, False)):
            motor = Motor(parameters(friction=False), 0, timeout)
            motor.answer(command, 0.0, 0.0, 0.0)
            self.assertEqual(motor.torque_nm(0.0, 5.0) != 0, after)
        motor.answer(bytes([0x80]) + bytes(7), 0.0, 0.0, 5.0)
        motor.answer(command, 0.0, 0.0, 5.0)
        self.assertEqual(motor.torque_nm(0.0, 5.0), 0.0)
        self.assertEqual(motor.answer(bytes([0x9A]) + bytes(7), 0.0, 0.0, 5.0)[6], 0x10)

    def test_imu_packets(self):
        self.assertEqual(packet(0x51, 0, 0, scaled(1.0, 16), 2530).hex(), "5551000000000008e20999")
        rates = [scaled(rate, 2000) for rate in (10.01, -10.01, 0)]
        self.assertEqual(packet(0x52, *rates, 2530).hex(), "5552a4005cff0000e20991")
        angles = [wrapped(angle * pi / 180) for angle in (-0.01648, 0.00549, -90.0)]
        self.assertEqual(packet(ANGLE, *angles, 0x2F10).hex(), "5553fdff010000c0102fa4")

    def test_imu_at_a_standstill_sees_gravity_along_its_angle(self):
        body = Body(parameters(), lambda speeds: (0.0, 0.0))
        body.pitch = 0.3
        sent = Imu(Random(1), 0.0, 0.0, 0.0).packets(body)
        _, y, z = struct.unpack_from("<hhh", sent, 2)
        roll = struct.unpack_from("<h", sent, 24)[0] * pi / 32768
        self.assertAlmostEqual(atan2(y, z), roll, delta=1e-3)
        self.assertAlmostEqual(roll, 0.3, delta=1e-4)


if __name__ == "__main__":
    unittest.main()
