"""What truly happened to the emulated robot: its motion, and the frames that reached it."""

import csv
import struct

from motor import MULTI_ID, TORQUE

# Time after the first torque command in which the torque is still to be small, s.
ARMING_S = 0.02
COLUMNS = [
    "time_s",
    "x_m",
    "x_dot_m_s",
    "pitch_rad",
    "pitch_rate_rad_s",
    "yaw_rad",
    "yaw_rate_rad_s",
    "wheel_speed_left_rad_s",
    "wheel_speed_right_rad_s",
    "torque_left_nm",
    "torque_right_nm",
    "on_left",
    "on_right",
    "held",
]


class Record:
    """Motion at a constant interval, largest values while a motor was on, and frames with their times."""

    def __init__(self, interval_s):
        self.interval_s = interval_s
        self.next_s = 0.0
        self.rows = []
        self.frames = []
        self.unanswered = 0
        self.first_torque_s = None
        self.x_at_torque = 0.0
        self.last_torque_s = None
        self.fault_s = None
        self.off_s = None
        self.fell_s = None
        self.lying_with_torque_s = 0.0
        self.peak = dict.fromkeys(("distance_m", "pitch_rad", "yaw_rate_rad_s", "speed_m_s"), 0.0)

    def add_row(self, body, torques, on):
        """Adds a row of the motion at the next instant of the grid."""
        if self.first_torque_s is not None and any(torques) and body.lies():
            self.lying_with_torque_s += self.interval_s
        wheels = [speed + body.pitch_rate for speed in body.motor_speeds()]
        motion = (body.x, body.x_dot, body.pitch, body.pitch_rate, body.yaw, body.yaw_rate)
        self.rows.append((self.next_s, *motion, *wheels, *torques, *map(int, on), int(body.hand is not None)))
        self.next_s += self.interval_s

    def note_peaks(self, body):
        """Takes the motion of a driven robot into account."""
        peak = self.peak
        peak["distance_m"] = max(peak["distance_m"], abs(body.x - self.x_at_torque))
        peak["speed_m_s"] = max(peak["speed_m_s"], abs(body.x_dot))
        peak["pitch_rad"] = max(peak["pitch_rad"], abs(body.pitch))
        peak["yaw_rate_rad_s"] = max(peak["yaw_rate_rad_s"], abs(body.yaw_rate))

    def commands(self):
        """Returns count, first and last time of the frames of each command."""
        found = {}
        for now, identifier, data in self.frames:
            name = f"{identifier:03X}" if identifier == MULTI_ID or not data else f"{data[0]:02X}"
            entry = found.setdefault(name, {"count": 0, "first_s": now, "last_s": now})
            entry["count"] += 1
            entry["last_s"] = now
        return found

    def torque_at_arming_nm(self, nm_per_step):
        """Returns the largest torque commanded just after the first one."""
        early = [
            torque_steps(identifier, data)
            for now, identifier, data in self.frames
            if self.first_torque_s is not None and now - self.first_torque_s < ARMING_S
        ]
        return max(early, default=0) * nm_per_step

    def report(self):
        """Returns times, largest values and frames, for JSON."""
        keys = ("first_torque_s", "last_torque_s", "fault_s", "off_s", "fell_s", "lying_with_torque_s", "peak")
        return {
            **{key: getattr(self, key) for key in keys},
            "frames": self.commands(),
            "frames_received": len(self.frames),
            "frames_unanswered": self.unanswered,
        }

    def write_motion(self, path):
        """Writes the true motion as CSV."""
        with open(path, "w", newline="", encoding="ascii") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            for row in self.rows:
                writer.writerow([f"{value:.6g}" for value in row])

    def write_frames(self, path):
        """Writes the frames received as candump logs them."""
        with open(path, "w", encoding="ascii") as file:
            for now, identifier, data in self.frames:
                file.write(f"({now:.6f}) slcan {identifier:03X}#{data.hex().upper()}\n")


def torque_steps(identifier, data):
    """Returns the largest torque current that a frame commands, in steps."""
    if identifier == MULTI_ID and len(data) == 8:
        return max(map(abs, struct.unpack("<4h", data)))
    if len(data) == 8 and data[0] == TORQUE:
        return abs(struct.unpack_from("<h", data, 4)[0])
    return 0
