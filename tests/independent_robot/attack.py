#!/usr/bin/env python3
"""Drives the emulated robot with flqr through a list of faults, and compares what was true with what flqr believed.

    attack.py FLQR [--out FOLDER] [SCENARIO…]

Prints one row for each scenario (names may have wildcards), then the expectations that failed. Exits with 1 if there
are any.
"""

import argparse
import contextlib
import csv
import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path

from scenarios import SCENARIOS

HERE = Path(__file__).resolve().parent
PAPER = HERE.parents[1] / "presets" / "paper.toml"
# Time until a program that was told to end is taken for one that hangs, s.
END_S = 6.0
# Time after which the robot is rocked again if flqr has not asked for an answer yet, and after which an answer that
# did not arm the robot is repeated, s.
ROCK_AGAIN_S = 2.0
ANSWER_AGAIN_S = 2.0
# How often a scenario is run that a busy machine disturbed, and how late the robot may be, s.
ATTEMPTS = 4
LATENESS_S = 0.015
# Stops of a machine that is too busy, where the link is not what fails.
BUSY_STOPS = ("late", "motor_silent", "imu_silent")


@dataclass
class Result:
    """What came of a run."""

    code: int | None
    suspended: bool
    ended_s: float | None
    acted_s: float | None
    message: str
    lines: list
    robot: dict
    recorded_sent: int | None = None
    believed: dict = field(default_factory=dict)

    @property
    def end(self):
        """The last line of flqr's JSON, if it is the end."""
        return next((line for line in reversed(self.lines) if line.get("type") == "end"), {})

    @property
    def stopped_by(self):
        return self.end.get("stopped_by")

    @property
    def said(self):
        """Everything that flqr said in words."""
        texts = [line.get("text", "") for line in self.lines if line.get("type") in ("event", "end", "check")]
        return "\n".join([*texts, self.message])

    @property
    def fault_s(self):
        """When the fault met the driven robot or the signal was sent, in the robot's time."""
        at = self.robot["fault_s"] if self.acted_s is None else self.acted_s
        driven = self.robot["first_torque_s"]
        return max((time for time in (at, driven) if time is not None), default=None)

    def since_fault(self, key):
        """Time from the fault to an event of the robot."""
        at = self.robot[key]
        return None if at is None or self.fault_s is None else at - self.fault_s

    @property
    def was_early(self):
        """Whether the robot was stopped before its fault, as on a machine that is too busy."""
        at = self.robot["fault_s"] if self.acted_s is None else self.acted_s
        off = self.robot["off_s"]
        return self.robot["first_torque_s"] is not None and off is not None and (at is None or off < at)

    @property
    def has_torque(self):
        return any(self.robot["torques_nm"])

    @property
    def torque_gone_s(self):
        """Time from the fault until the motors had no torque; None if they still have."""
        if self.has_torque:
            return None
        after = self.since_fault("last_torque_s")
        return None if after is None else max(0.0, after)


class Robot:
    """The emulated robot as a process."""

    def __init__(self, folder, options):
        self.report = folder / "robot.json"
        command = [sys.executable, str(HERE / "robot.py"), "--model", str(PAPER), "--report", str(self.report)]
        command += ["--truth", str(folder / "truth.csv"), "--frames", str(folder / "frames.log"), *options]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.names = json.loads(self.process.stdout.readline())
        self.events = {}
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            event = json.loads(line)
            self.events[event["event"]] = time.monotonic()

    def has_been_still(self, seconds):
        """Returns whether the hand has not rocked it for some time."""
        return "still" in self.events and time.monotonic() - self.events["still"] > seconds

    def rock(self):
        """Has the hand rock it again."""
        del self.events["still"]
        self.process.stdin.write("rock\n")
        self.process.stdin.flush()

    def finish(self):
        """Ends it and returns its report."""
        self.process.stdin.close()
        self.process.wait(timeout=30)
        return json.loads(self.report.read_text())


class Program:
    """flqr as a process with a terminal to type on."""

    def __init__(self, scenario, folder, flqr, names):
        model = folder / "model.toml"
        model.write_text(PAPER.read_text() + scenario.model)
        self.recording = folder / ("disk" if scenario.disk_kib else "") / "run.csv"
        for file in self.recording.parent.glob("run.*"):
            file.unlink()
        command = [flqr, scenario.command, names["can"], "--imu", names["imu"], "--json"]
        command += ["--record", str(self.recording)]
        if scenario.command == "drive":
            command.insert(3, str(model))
            if scenario.arm:
                command += ["--arm", "--seconds", str(scenario.seconds)]
        command += scenario.flqr
        (folder / "command.txt").write_text(" ".join(map(str, command)) + "\n")
        self.keyboard, terminal = os.openpty()
        self.lines, self.message = [], ""
        output = subprocess.PIPE
        if scenario.output == "full":
            output = open("/dev/full", "wb")
        elif scenario.output == "stalled":
            self.unread, output = full_pipe()
        # A process group of its own, but in this session: a stop signal is ignored in an orphaned group.
        self.process = subprocess.Popen(
            command, stdin=terminal, stdout=output, stderr=subprocess.PIPE, text=True, process_group=0
        )
        os.close(terminal)
        self.readers = [threading.Thread(target=self.read_message, daemon=True)]
        if output == subprocess.PIPE:
            self.readers.append(threading.Thread(target=self.read_lines, daemon=True))
        else:
            os.close(output if isinstance(output, int) else output.fileno())
        for reader in self.readers:
            reader.start()

    def read_lines(self):
        for line in self.process.stdout:
            try:
                self.lines.append(json.loads(line))
            except ValueError:
                self.message += f"not JSON: {line}"

    def read_message(self):
        for line in self.process.stderr:
            self.message += line

    def is_asking(self):
        """Returns whether the checks have passed at least once."""
        return "type drive" in self.message

    def type(self, text):
        os.write(self.keyboard, text.encode())

    def kill(self):
        self.process.kill()
        self.process.wait()


def full_pipe():
    """Returns a pipe that takes no more."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    try:
        while True:
            os.write(writer, b"\n" * 65536)
    except BlockingIOError:
        pass
    os.set_blocking(writer, True)
    return reader, writer


@contextlib.contextmanager
def small_disk(folder, kib):
    """Mounts a disk of this size on the folder, for the recording."""
    if not kib:
        yield
        return
    folder.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kib}k", "none", str(folder)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def run(scenario, flqr, folder):
    """Runs one scenario."""
    folder.mkdir(parents=True, exist_ok=True)
    with small_disk(folder / "disk", scenario.disk_kib):
        return run_on_disk(scenario, flqr, folder)


def run_on_disk(scenario, flqr, folder):
    """Runs one scenario, with a folder to record in."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(scenario.busy)]
    robot = Robot(folder, scenario.robot)
    time.sleep(0.1)
    program = Program(scenario, folder, flqr, robot.names)
    started = time.monotonic()
    acted = ended = None
    typed = None
    try:
        while program.process.poll() is None:
            now = time.monotonic()
            if "torque" not in robot.events and robot.has_been_still(0.0) and program.is_asking():
                # A check that opens meanwhile makes the answer void.
                if typed is None or now - typed > ANSWER_AGAIN_S:
                    program.type("drive\n")
                    typed = now
            elif scenario.arm and typed is None and robot.has_been_still(ROCK_AGAIN_S):
                robot.rock()
            origin = robot.events.get("torque") if scenario.arm else started
            if acted is None and origin and now - origin >= scenario.after_s:
                if scenario.file_bytes:
                    limits = (scenario.file_bytes, resource.RLIM_INFINITY)
                    resource.prlimit(program.process.pid, resource.RLIMIT_FSIZE, limits)
                if scenario.signal:
                    program.process.send_signal(scenario.signal)
                if scenario.signal or scenario.file_bytes:
                    acted = time.monotonic()
            if now - started > scenario.limit_s or (scenario.signal and acted and now - acted > END_S):
                break
            time.sleep(0.01)
        if program.process.poll() is not None:
            ended = time.monotonic()
        time.sleep(scenario.aftermath_s)
        suspended = is_suspended(program.process.pid)
    finally:
        if program.process.poll() is None:
            program.kill()
        report = robot.finish()
        for process in busy:
            process.kill()
            process.wait()
    for reader in program.readers:
        reader.join(timeout=2)
    os.close(program.keyboard)
    if scenario.output == "stalled":
        os.close(program.unread)

    def in_robot_time(at):
        return None if at is None else at - report["started_s"]

    result = Result(
        code=program.process.returncode if ended else None,
        suspended=suspended,
        ended_s=in_robot_time(ended),
        acted_s=in_robot_time(acted),
        message=program.message,
        lines=program.lines,
        robot=report,
    )
    (folder / "flqr.jsonl").write_text("".join(json.dumps(line) + "\n" for line in program.lines))
    (folder / "flqr.err").write_text(program.message)
    read_recording(result, program.recording)
    return result


def read_recording(result, csv_file):
    """Reads from the recording which frames were sent, and the motion that flqr saw."""
    frames = csv_file.with_suffix(".log")
    if frames.exists():
        sent = [line for line in frames.read_text(errors="replace").splitlines() if line.endswith(" T")]
        result.recorded_sent = len(sent)
    if csv_file.exists():
        with csv_file.open(newline="", errors="replace") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        for column in ("x_m", "pitch_rad"):
            values = [abs(number(row.get(column))) for row in rows]
            result.believed[column] = max(values, default=0.0)


def number(text):
    try:
        return float(text)
    except (TypeError, ValueError):
        return 0.0


def shown(value, digits=2):
    return "-" if value is None else f"{value:.{digits}f}"


def is_suspended(process):
    """Returns whether a process was stopped by a signal."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] == "T"
    except OSError:
        return False


def exit_of(result):
    """Returns the exit code, or what is in its place."""
    if result.code is None:
        return "asleep" if result.suspended else "hangs"
    return str(result.code)


def disturbance_of(scenario, result):
    """Returns why a run tells nothing, if it does."""
    late = result.robot["worst_lateness_s"]
    if late > LATENESS_S:
        return f"the emulated robot itself was late by {1000 * late:.0f} ms"
    if scenario.has_fault() and result.was_early and result.stopped_by in (None, *BUSY_STOPS):
        return f"stopped before the fault: {result.end.get('text')}"
    if result.stopped_by in BUSY_STOPS and not scenario.busy and not scenario.breaks_the_link():
        return f"stopped for another reason than the fault: {result.end.get('text')}"
    return None


COLUMNS = [
    ("scenario", 30),
    ("stopped by", 17),
    ("exit", 6),
    ("torque 0 s", 10),
    ("off s", 7),
    ("x m", 6),
    ("x seen", 6),
    ("pitch", 6),
    ("p. seen", 7),
    ("yaw r/s", 7),
    ("floor s", 7),
    ("sent", 6),
    ("heard", 6),
    ("frames by command", 0),
]


def row(scenario, result):
    """Returns a row of the table."""
    robot = result.robot
    off = "no" if robot["off_s"] is None else shown(result.since_fault("off_s"))
    driven = robot["first_torque_s"] is not None
    gone = "-" if not driven else "stays" if result.has_torque else shown(result.torque_gone_s)
    frames = " ".join(f"{command}:{entry['count']}" for command, entry in sorted(robot["frames"].items()))
    cells = [
        scenario.name,
        result.stopped_by or "-",
        exit_of(result),
        gone,
        off,
        shown(robot["peak"]["distance_m"]),
        shown(result.believed.get("x_m")),
        shown(robot["peak"]["pitch_rad"]),
        shown(result.believed.get("pitch_rad")),
        shown(robot["peak"]["yaw_rate_rad_s"]),
        shown(robot["lying_with_torque_s"]),
        "-" if result.recorded_sent is None else str(result.recorded_sent),
        str(robot["frames_received"]),
        frames,
    ]
    return line(cells)


def line(cells):
    return " ".join(f"{cell:<{width}}" for cell, (_, width) in zip(cells, COLUMNS)).rstrip()


LEGEND = """\
torque 0 s, off s: from the fault, the signal or else the first torque to the last torque, and until both motors
were off.
x m, pitch, yaw r/s: true largest values from the first torque on (pitch and yaw rate while a motor was on), SI.
x seen, p. seen: largest values in flqr's recording, which begins before the first torque.
floor s: time on the floor with torque. sent, heard: frames that flqr recorded as sent, and that the robot received.
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flqr")
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO")
    parser.add_argument("--out", type=Path, default=Path("target/attack"), help="folder of recordings and true motion")
    parser.add_argument("--list", action="store_true")
    options = parser.parse_intermixed_args()

    def is_chosen(scenario):
        if not options.scenarios:
            return not scenario.only_by_name
        return any(fnmatch(scenario.name, pattern) for pattern in options.scenarios)

    # A shell ignores these for what it runs in the background, and flqr would inherit that.
    for number in (signal.SIGINT, signal.SIGQUIT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    chosen = [scenario for scenario in SCENARIOS if is_chosen(scenario)]
    if options.list:
        for scenario in chosen:
            print(f"{scenario.point:3} {scenario.name}")
        return 0
    print(LEGEND)
    print(line([name for name, _ in COLUMNS]))
    failures, skipped = [], []
    for scenario in chosen:
        folder = options.out / re.sub(r"[^a-z0-9]+", "-", scenario.name.lower())
        for _ in range(ATTEMPTS):
            try:
                result = run(scenario, options.flqr, folder)
            except subprocess.CalledProcessError as error:
                print(f"{scenario.name}: skipped: {error}", flush=True)
                skipped.append(scenario.name)
                result = None
                break
            print(row(scenario, result), flush=True)
            disturbance = disturbance_of(scenario, result)
            if not disturbance:
                break
            print(f"    disturbed: {disturbance}", flush=True)
        for problem in filter(None, (result and expectation(result) for expectation in scenario.expect)):
            failures.append(f"{scenario.point}, {scenario.name}: {problem}")
            print(f"    FAILED: {problem}", flush=True)
    without = f", without {', '.join(skipped)}" if skipped else ""
    print(f"\n{len(chosen)} scenarios{without}, {len(failures)} expectations failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
