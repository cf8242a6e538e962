"""Rigid-body dynamics of a two-wheeled inverted pendulum: translation, pitch and yaw, with dry friction that sticks.

Coordinates: x is the mean path of the two wheels, pitch is positive forward, yaw is positive to the left. The wheels
do not slip. A motor torque T drives its wheel forward and reacts with -T on the body, and the motor angle is
q = wheel angle - pitch. With v = x_dot, w = yaw rate, and the sums over both motors:

    a v' + M l cos(p) p'' - M l sin(p) (p'^2 + w^2)             = sum(T - friction) / r + F
    (J + M l^2) p'' + M l cos(p) v' - M l^2 sin(p) cos(p) w^2   = M g l sin(p) - sum(T - friction) + F h
    (Z + M l^2 sin(p)^2) w' + 2 M l^2 sin(p) cos(p) p' w + M l sin(p) v w = (W / 2 r) (right - left)
"""

import tomllib
from dataclasses import dataclass
from math import cos, exp, pi, sin

# Longest integration step, s.
STEP_S = 0.0005
# Pitch at which the body lies on the floor, rad, friction coefficient of the body there, and distance from the axle to
# the point of contact, m.
FLOOR_RAD = 1.35
FLOOR_FRICTION = 0.4
FLOOR_LEVER_M = 0.3


@dataclass(frozen=True)
class Friction:
    """Stribeck friction of a motor shaft."""

    coulomb_nm: float = 0.0
    static_nm: float = 0.0
    viscous_nm_s_rad: float = 0.0
    stribeck_speed_rad_s: float = 1.0
    stribeck_exponent: float = 1.0
    offset_nm: float = 0.0

    def dry_nm(self, speed_rad_s):
        """Returns the largest dry friction torque at a shaft speed."""
        ratio = abs(speed_rad_s) / self.stribeck_speed_rad_s
        return self.coulomb_nm + (self.static_nm - self.coulomb_nm) * exp(-(ratio**self.stribeck_exponent))


@dataclass(frozen=True)
class Parameters:
    """Masses, lengths, inertias, friction and wiring of the robot, in SI units."""

    body_mass_kg: float
    wheel_mass_kg: float
    wheel_inertia_kg_m2: float
    wheel_radius_m: float
    com_height_m: float
    body_inertia_kg_m2: float
    gravity_m_s2: float
    track_width_m: float
    yaw_inertia_kg_m2: float
    friction: tuple
    torque_constant_nm_a: float
    current_steps_per_a: float
    encoder_steps: int
    motor_ids: tuple
    motor_signs: tuple
    imu_rate_hz: float

    @classmethod
    def read(cls, path):
        """Reads the parameters of a robot from a model file."""
        with open(path, "rb") as file:
            model = tomllib.load(file)
        robot, link, chassis = model["robot"], model.get("link", {}), model.get("chassis", {})

        def value(key):
            table = robot[key]
            if not isinstance(table, dict):
                return table
            return interpolate(robot["leg_height_m"], table["leg_height_m"], table[key])

        def sign(key, default):
            return 1 if link.get(key, default) == "forward" else -1

        friction = model.get("friction", {})
        return cls(
            body_mass_kg=robot["body_mass_kg"],
            wheel_mass_kg=robot["wheel_mass_kg"],
            wheel_inertia_kg_m2=robot["wheel_inertia_kg_m2"],
            wheel_radius_m=robot["wheel_radius_m"],
            com_height_m=value("com_height_m"),
            body_inertia_kg_m2=value("body_inertia_kg_m2"),
            gravity_m_s2=robot.get("gravity_m_s2", 9.81),
            track_width_m=chassis.get("track_width_m", 0.40),
            yaw_inertia_kg_m2=chassis.get("yaw_inertia_kg_m2", 0.15),
            friction=tuple(Friction(**friction.get(side, {})) for side in ("left", "right")),
            torque_constant_nm_a=link.get("torque_constant_nm_a", 0.32),
            current_steps_per_a=link.get("current_steps_per_a", 4096 / 33),
            encoder_steps=link.get("encoder_steps", 65536),
            motor_ids=(link.get("left_motor_id", 1), link.get("right_motor_id", 2)),
            motor_signs=(sign("left_direction", "forward"), sign("right_direction", "backward")),
            imu_rate_hz=link.get("imu_rate_hz", 200),
        )


def interpolate(at, xs, ys):
    """Interpolates linearly in a table, constant outside it."""
    if at <= xs[0]:
        return ys[0]
    for i in range(1, len(xs)):
        if at <= xs[i]:
            return ys[i - 1] + (ys[i] - ys[i - 1]) * (at - xs[i - 1]) / (xs[i] - xs[i - 1])
    return ys[-1]


class Hand:
    """A hand that holds the robot: it brings it upright, or to a lean, rocks it for a time, and does not give way."""

    RAISE_S = 0.5
    TREMOR_RAD = 0.001
    TREMOR_HZ = 2.3

    def __init__(self, time_s, pitch_rad=0.0, rocking_s=(0.0, 0.0), lean_rad=0.0, amplitude_rad=0.13, period_s=2.0):
        self.time_s = time_s
        self.pitch_rad = pitch_rad
        self.rocking_s = rocking_s
        self.lean_rad = lean_rad
        self.amplitude_rad = amplitude_rad
        self.period_s = period_s

    def pitch(self, time_s):
        """Returns the pitch at a time."""
        age = time_s - self.time_s
        lifted = 0.5 * (1.0 + cos(pi * age / self.RAISE_S)) if age < self.RAISE_S else 0.0
        pitch = self.lean_rad + (self.pitch_rad - self.lean_rad) * lifted
        pitch += self.TREMOR_RAD * sin(2 * pi * self.TREMOR_HZ * time_s)
        start, end = self.rocking_s
        if start < time_s < end:
            pitch += self.amplitude_rad * sin(2 * pi * (time_s - start) / self.period_s)
        return pitch


class Body:
    """State of the robot, and its integration in time.

    `torques` is called before each step with the two motor speeds and returns the two motor torques.
    """

    def __init__(self, parameters, torques, in_air=False):
        self.p = parameters
        self.torques = torques
        self.in_air = in_air
        self.hand = None
        self.push_n = 0.0
        self.push_height_m = 0.0
        self.time_s = 0.0
        self.x = self.pitch = self.yaw = 0.0
        self.x_dot = self.pitch_rate = self.yaw_rate = 0.0
        self.x_acceleration = self.pitch_acceleration = 0.0
        # Wheel angles and speeds where the wheels are in the air, rad and rad/s.
        self.air_angles = [0.0, 0.0]
        self.air_speeds = [0.0, 0.0]
        p = parameters
        wheel = p.wheel_mass_kg + p.wheel_inertia_kg_m2 / p.wheel_radius_m**2
        self.half_track = p.track_width_m / 2
        self.translation_kg = p.body_mass_kg + 2 * wheel
        self.moment_kg_m = p.body_mass_kg * p.com_height_m
        self.lever_kg_m2 = self.moment_kg_m * p.com_height_m
        self.pitch_kg_m2 = p.body_inertia_kg_m2 + self.lever_kg_m2
        self.yaw_kg_m2 = p.yaw_inertia_kg_m2 + 2 * wheel * self.half_track**2

    def motor_angles(self):
        """Returns the angles of both motor shafts, rad."""
        if self.in_air:
            return [angle - self.pitch for angle in self.air_angles]
        turn = self.yaw * self.half_track
        radius = self.p.wheel_radius_m
        return [(self.x - turn) / radius - self.pitch, (self.x + turn) / radius - self.pitch]

    def motor_speeds(self):
        """Returns the speeds of both motor shafts, rad/s."""
        if self.in_air:
            return [speed - self.pitch_rate for speed in self.air_speeds]
        turn = self.yaw_rate * self.half_track
        radius = self.p.wheel_radius_m
        return [(self.x_dot - turn) / radius - self.pitch_rate, (self.x_dot + turn) / radius - self.pitch_rate]

    def energy_j(self):
        """Returns kinetic and potential energy, the axle's height being zero."""
        s, c = sin(self.pitch), cos(self.pitch)
        return (
            0.5 * self.translation_kg * self.x_dot**2
            + self.moment_kg_m * c * self.x_dot * self.pitch_rate
            + 0.5 * self.pitch_kg_m2 * self.pitch_rate**2
            + 0.5 * (self.yaw_kg_m2 + self.lever_kg_m2 * s * s) * self.yaw_rate**2
            + self.moment_kg_m * self.p.gravity_m_s2 * c
        )

    def lies(self):
        """Returns whether the body lies on the floor."""
        return abs(self.pitch) >= FLOOR_RAD

    def advance(self, time_s):
        """Integrates up to a time."""
        step = self._step_held if self.hand else self._step_in_air if self.in_air else self._step
        while time_s - self.time_s > 1.5 * STEP_S:
            step(STEP_S)
            self.time_s += STEP_S
        if time_s > self.time_s:
            step(time_s - self.time_s)
            self.time_s = time_s

    def _accelerations(self, pitch, pitch_rate, yaw_rate, x_dot, left, right):
        """Returns the accelerations and the entries of the inverse mass matrix."""
        s, c = sin(pitch), cos(pitch)
        coupling = self.moment_kg_m * c
        total = left + right
        force = total / self.p.wheel_radius_m + self.moment_kg_m * s * (pitch_rate**2 + yaw_rate**2) + self.push_n
        moment = self.moment_kg_m * self.p.gravity_m_s2 * s + self.lever_kg_m2 * s * c * yaw_rate**2 - total
        moment += self.push_n * self.push_height_m
        determinant = self.translation_kg * self.pitch_kg_m2 - coupling * coupling
        i11 = self.pitch_kg_m2 / determinant
        i12 = -coupling / determinant
        i22 = self.translation_kg / determinant
        yaw_inertia = self.yaw_kg_m2 + self.lever_kg_m2 * s * s
        gyroscopic = (2 * self.lever_kg_m2 * c * pitch_rate + self.moment_kg_m * x_dot) * s * yaw_rate
        yaw_moment = (right - left) * self.half_track / self.p.wheel_radius_m - gyroscopic
        x_acceleration, pitch_acceleration = i11 * force + i12 * moment, i12 * force + i22 * moment
        return x_acceleration, pitch_acceleration, yaw_moment / yaw_inertia, i11, i12, i22, yaw_inertia

    def _step(self, h):
        friction = self.p.friction
        radius, half_track = self.p.wheel_radius_m, self.half_track
        speeds = self.motor_speeds()
        torques = self.torques(speeds)
        left, right = (
            torque - f.viscous_nm_s_rad * speed - f.offset_nm for torque, speed, f in zip(torques, speeds, friction)
        )
        # Smooth forces by the midpoint rule, without dry friction.
        v0, p0, w0 = self.x_dot, self.pitch_rate, self.yaw_rate
        a, b, d, *_ = self._accelerations(self.pitch, p0, w0, v0, left, right)
        half = 0.5 * h
        a, b, d, i11, i12, i22, yaw_inertia = self._accelerations(
            self.pitch + half * p0, p0 + half * b, w0 + half * d, v0 + half * a, left, right
        )
        v1, p1, w1 = v0 + h * a, p0 + h * b, w0 + h * d
        # Dry friction as the impulses that stop the shafts, as far as their limits allow.
        along, back = i11 / radius - i12, i12 / radius - i22
        turning = half_track / (radius * yaw_inertia)
        straight = along / radius - back
        turn = turning * half_track / radius
        own, cross = straight + turn, straight - turn
        slip_left = (v1 - w1 * half_track) / radius - p1
        slip_right = (v1 + w1 * half_track) / radius - p1
        left, right = stopping_impulses(
            own, cross, slip_left, slip_right, h * friction[0].dry_nm(speeds[0]), h * friction[1].dry_nm(speeds[1])
        )
        v1 += along * (left + right)
        p1 += back * (left + right)
        w1 += turning * (right - left)
        self.pitch += half * (p0 + p1)
        if abs(self.pitch) >= FLOOR_RAD:
            side = 1 if self.pitch > 0 else -1
            self.pitch = side * FLOOR_RAD
            if side * p1 > 0:
                impulse = p1 / i22
                p1 = 0.0
                v1 -= i12 * impulse
                drag = FLOOR_FRICTION * abs(impulse) / FLOOR_LEVER_M * i11
                v1 = max(0.0, v1 - drag) if v1 > 0 else min(0.0, v1 + drag)
                turn = FLOOR_FRICTION * abs(impulse) / yaw_inertia
                w1 = max(0.0, w1 - turn) if w1 > 0 else min(0.0, w1 + turn)
        self.x += half * (v0 + v1)
        self.yaw += half * (w0 + w1)
        self.x_dot, self.pitch_rate, self.yaw_rate = v1, p1, w1
        self.x_acceleration, self.pitch_acceleration = (v1 - v0) / h, (p1 - p0) / h

    def _step_held(self, h):
        pitch = self.hand.pitch(self.time_s + h)
        rate = (pitch - self.pitch) / h
        self.pitch_acceleration = 0.0
        self.pitch, self.pitch_rate = pitch, rate
        self.x_dot = self.yaw_rate = self.x_acceleration = 0.0

    def _step_in_air(self, h):
        inertia = self.p.wheel_inertia_kg_m2
        torques = self.torques(self.air_speeds)
        for i, (torque, f) in enumerate(zip(torques, self.p.friction)):
            speed = self.air_speeds[i]
            driven = speed + h * (torque - f.viscous_nm_s_rad * speed - f.offset_nm) / inertia
            limit = h * f.dry_nm(speed) / inertia
            stopped = 0.0 if abs(driven) <= limit else driven - limit if driven > 0 else driven + limit
            self.air_angles[i] += 0.5 * h * (speed + stopped)
            self.air_speeds[i] = stopped


def stopping_impulses(own, cross, slip_left, slip_right, limit_left, limit_right):
    """Returns the impulses within the limits that bring both slips to zero, or oppose those that remain."""
    determinant = own * own - cross * cross
    left = (cross * slip_right - own * slip_left) / determinant
    right = (cross * slip_left - own * slip_right) / determinant
    if abs(left) <= limit_left and abs(right) <= limit_right:
        return left, right
    left = right = 0.0
    for _ in range(12):
        before = left, right
        left = max(-limit_left, min(limit_left, -(slip_left + cross * right) / own))
        right = max(-limit_right, min(limit_right, -(slip_right + cross * left) / own))
        if abs(left - before[0]) + abs(right - before[1]) < 1e-12:
            break
    return left, right
