"""The faults, and what has to hold in each."""

import re
from dataclasses import dataclass
from signal import Signals

# Stops that flqr does not report as a failure.
UNEVENTFUL = (None, "requested", "operator", "time_over", "done")
# Time within which a stop that an operator or the system asked for is carried out, s.
STOP_S = 0.1
# Commands that only ask.
QUERIES = ("90", "92", "94", "9A", "9C", "9D", "C0", "B0", "30", "33")

# How flqr says that motors have not confirmed that they are off.
NOT_OFF = r"\b(not|never|no|without)\b.*\boff\b"


@dataclass
class Scenario:
    """One run: options of the robot and of flqr, what is done to flqr, and what has to hold."""

    name: str
    point: int
    robot: tuple = ()
    flqr: tuple = ()
    command: str = "drive"
    arm: bool = True
    # How long the robot is driven, and how long flqr may take in all, s.
    seconds: float = 6.0
    limit_s: float = 25.0
    # Signal, or limit of the size of a file, and when: from the first torque if armed, else from the start.
    signal: Signals | None = None
    file_bytes: int | None = None
    after_s: float = 2.0
    # Where standard output goes: "read", "stalled" or "full"; size of the recording's disk (needs the right to mount).
    output: str = "read"
    disk_kib: int = 0
    # Lines appended to the model file, busy programs on the same machine, time watched after the end, s.
    model: str = ""
    busy: int = 0
    aftermath_s: float = 1.0
    only_by_name: bool = False
    expect: tuple = ()

    def has_fault(self):
        """Returns whether something happens to a robot that is driven."""
        later = any("@+" in option and not option.startswith("push") for option in self.robot)
        return later or self.signal is not None or self.file_bytes is not None

    def breaks_the_link(self):
        """Returns whether the fault keeps frames or readings away."""
        return any(word in option for option in self.robot for word in ("cable", "silent", "latency", "stalled"))


# Expectations: each returns what is wrong, or None.


def stood(result):
    """The robot was driven to the end of its time, and then switched off."""
    if result.code != 0 or result.stopped_by != "time_over":
        return f"was stopped by {result.stopped_by}, exit {result.code}: {last_words(result)}"
    if result.robot["off_s"] is None:
        return "the motors are still on"
    if result.robot["peak"]["pitch_rad"] > 0.4:
        return f"leaned by {result.robot['peak']['pitch_rad']:.2f} rad"
    return None


def still_stands(result):
    """The robot stands in spite of flqr."""
    return f"fell at {result.robot['fell_s']:.1f} s" if result.robot["fell_s"] is not None else None


def only_queries(result):
    """No command was sent that a motor acts on."""
    others = sorted(command for command in result.robot["frames"] if command not in QUERIES)
    return f"sent {' '.join(others)}" if others else None


def nothing_sent(result):
    """Not one frame was sent."""
    return f"sent {result.robot['frames_received']} frames" if result.robot["frames_received"] else None


def never_driven(result):
    """No torque was commanded."""
    return "torque was commanded" if result.robot["first_torque_s"] is not None else None


def failed(result):
    """The exit code tells a failure."""
    return f"exit {result.code}" if result.code in (0, None) else None


def ends_off(result):
    """The motors are off in the end."""
    if result.has_torque or (result.robot["first_torque_s"] is not None and result.robot["off_s"] is None):
        return "the motors are still on"
    return None


def ends(seconds):
    """The program ends in time after the signal."""

    def check(result):
        if result.ended_s is None:
            return "the program did not end"
        late = result.ended_s - result.acted_s
        return f"ended after {late:.2f} s" if late > seconds else None

    return check


def off_within(seconds):
    """The motors are without torque and off in time."""

    def check(result):
        if result.robot["first_torque_s"] is None:
            return f"was never driven: {last_words(result)}"
        if result.has_torque:
            return "the motors still have torque"
        if result.robot["off_s"] is None:
            return "the motors are still on"
        after = result.since_fault("off_s")
        if after is None or after < 0:
            return f"was stopped before the fault: {last_words(result)}"
        return f"motors off after {after:.3f} s" if after > seconds else None

    return check


def named(pattern=None):
    """flqr stopped the robot for a reason that it names."""

    def check(result):
        if result.stopped_by in UNEVENTFUL:
            return f"unnoticed: stopped by {result.stopped_by}"
        if result.code in (0, None):
            return f"exit {result.code}"
        if pattern and not re.search(pattern, f"{result.stopped_by}\n{result.end.get('text')}", re.IGNORECASE):
            return f"not named ({pattern}): {last_words(result)}"
        return None

    return check


def says(pattern):
    """flqr says so."""
    return lambda result: (
        None if re.search(pattern, result.said, re.IGNORECASE) else f"not said ({pattern}): {last_words(result)}"
    )


def within(**limits):
    """The true motion stays within limits."""

    def check(result):
        peak = result.robot["peak"]
        over = [f"{key} {peak[key]:.2f} > {limit}" for key, limit in limits.items() if peak[key] > limit]
        return ", ".join(over) or None

    return check


def not_on_the_floor(result):
    """No torque was applied to a robot that lay on the floor."""
    seconds = result.robot["lying_with_torque_s"]
    return f"{seconds:.1f} s of torque on the floor" if seconds > 0.1 else None


def recording_holds_what_was_received(result):
    """Frames recorded as sent are those that the robot received."""
    recorded, received = result.recorded_sent, result.robot["frames_received"]
    return f"{recorded} recorded as sent, {received} received" if recorded != received else None


def torque_at_arming_below(limit_nm):
    """The torque begins small."""

    def check(result):
        found = result.robot["largest_torque_at_arming_nm"]
        return f"{found:.2f} N m in the first 20 ms" if found > limit_nm else None

    return check


def health_read_at(least_hz):
    """Voltage and errors are read often enough from each motor."""

    def check(result):
        asked = result.robot["frames"].get("9A", {"count": 0, "first_s": 0, "last_s": 1})
        rate = asked["count"] / 2 / (asked["last_s"] - asked["first_s"])
        return f"read at {rate:.1f} Hz" if rate < least_hz else None

    return check


def never_connected(result):
    """The connection is not shown as one."""
    shown = {line["connection"] for line in result.lines if line.get("type") == "status"}
    return "shown as connected" if "connected" in shown else None


def has_end(result):
    """The last line is the end."""
    return None if result.end else "no end line"


def last_words(result):
    words = [text for text in result.message.splitlines() if text.strip()]
    return words[-1] if words else result.end.get("text", "nothing said")


def fault(name, point, spec, *expect, **more):
    """A driven robot with one fault, two seconds after the first torque."""
    spec = spec if "@" in spec else f"{spec}@+2"
    return Scenario(name, point, ("--fault", spec, *more.pop("robot", ())), expect=expect, **more)


def interrupted(name, number, *expect, **more):
    """A driven robot whose program gets a signal."""
    return Scenario(name, more.pop("point", 14), signal=number, expect=(off_within(STOP_S), *expect), **more)


def unarmed(name, point, spec, *expect):
    """A robot with a fault in the checks, which must not be armed however willing the operator is."""
    return Scenario(
        name,
        point,
        ("--fault", spec),
        ("--arm", "--yes"),
        arm=False,
        signal=Signals.SIGINT,
        after_s=5.0,
        expect=(never_driven, *expect),
    )


def own_controller(name, robot, **more):
    """A robot that balances by itself, watched without arming."""
    more = {"signal": Signals.SIGINT, "after_s": 3.0, "aftermath_s": 3.0, **more}
    return Scenario(name, 11, robot, arm=False, expect=(only_queries, still_stands), **more)


MOTOR_LOST = (failed, named("motor_silent"), recording_holds_what_was_received, says(NOT_OFF))
# flqr stops a robot that turns at more than 3 rad/s; until its motors are off it may turn a little faster.
SHORT_RUNAWAY = within(distance_m=1.0, pitch_rad=0.6, yaw_rate_rad_s=3.8)
PUSHED = ("--fault", "push=30@+3..+3.1")
STANDING = ("--hold", "none", "--lean", "0.02")

SCENARIOS = [
    Scenario("no fault", 15, seconds=8.0, expect=(stood, recording_holds_what_was_received, health_read_at(20))),
    Scenario("no fault, pushed", 12, ("--fault", "push=30@+2..+2.1"), expect=(stood,)),
    Scenario("no fault, LQR", 12, flqr=("--controller", "lqr"), seconds=10.0, expect=(stood,)),
    Scenario("replies at 0x180", 15, ("--reply-base", "0x180"), expect=(stood,)),
    # A robot with a controller of its own.
    own_controller("check, on-board controller", (*STANDING, "--onboard", "silent")),
    own_controller("check, controller on the bus", (*STANDING, "--onboard", "bus")),
    own_controller(
        "check passes, on-board",
        ("--onboard", "silent", "--hold", "until", "--hold-seconds", "3", "--lean", "0.02"),
        signal=None,
        aftermath_s=4.0,
    ),
    Scenario(
        "monitor, controller on the bus",
        11,
        (*STANDING, "--onboard", "bus"),
        ("--seconds", "3"),
        "monitor",
        arm=False,
        expect=(nothing_sent, still_stands),
    ),
    unarmed("arming refused, 15 V", 11, "voltage=15@0", only_queries),
    # Sensors against each other.
    *(
        fault(
            f"encoder {kind}, {side}",
            12,
            f"encoder-{kind}={side}",
            named("encoder|wheel|yaw|gyro"),
            off_within(3),
            SHORT_RUNAWAY,
            # A reading that stays as it was shows once the robot moves.
            robot=PUSHED if kind == "stale" else (),
            seconds=15.0,
        )
        for kind in ("frozen", "stale")
        for side in ("left", "right", "both")
    ),
    fault(
        "IMU angle frozen",
        12,
        "imu-angle-frozen",
        named("pitch|angle|imu|gyro"),
        off_within(3),
        SHORT_RUNAWAY,
        not_on_the_floor,
    ),
    fault(
        "IMU rate zero",
        12,
        "imu-rate-zero",
        named("rate|imu|gyro"),
        off_within(3),
        SHORT_RUNAWAY,
        not_on_the_floor,
    ),
    fault("IMU rate zero from the start", 12, "imu-rate-zero@0", never_driven, failed, limit_s=40.0),
    fault("IMU frozen", 12, "imu-frozen", named(), off_within(0.5), SHORT_RUNAWAY, not_on_the_floor),
    fault("IMU silent", 12, "imu-silent", named(), off_within(0.2), SHORT_RUNAWAY),
    fault("torque reversed, left", 12, "torque-reversed=left@+0", named(), off_within(0.2), SHORT_RUNAWAY),
    fault("torque reversed, both", 12, "torque-reversed=both@+0", named(), off_within(0.2), SHORT_RUNAWAY),
    fault("torque reversed later, left", 12, "torque-reversed=left", named(), off_within(1), SHORT_RUNAWAY),
    fault("torque reversed later, both", 12, "torque-reversed=both", named(), off_within(1), SHORT_RUNAWAY),
    fault("motors swapped", 12, "motors-swapped@0", never_driven, failed, limit_s=40.0),
    fault(
        "motors swapped, senses fitted",
        12,
        "motors-swapped@0",
        SHORT_RUNAWAY,
        model='left_direction = "backward"\nright_direction = "forward"\n',
    ),
    # Other controllers.
    *(
        fault(f"foreign {command} once", 13, f"foreign={command}:0", named("other_controller"), off_within(STOP_S))
        for command in ("80", "81", "88", "A1", "A2", "280")
    ),
    *(
        fault(
            f"foreign {command} at {rate} Hz",
            13,
            f"foreign={command}:{rate}",
            named("other_controller"),
            off_within(STOP_S),
        )
        for command, rate in (("A1", 5), ("A2", 100), ("81", 20))
    ),
    *(
        unarmed(f"foreign {command} in the checks", 13, f"foreign={command}@0.8", says("other controller"))
        for command in ("A1:1", "A2:100", "88:0", "81:20", "280:5")
    ),
    # Signals and outputs.
    interrupted("SIGINT", Signals.SIGINT, ends(1)),
    interrupted("SIGTERM", Signals.SIGTERM, ends(1)),
    interrupted("SIGHUP", Signals.SIGHUP, ends(1)),
    interrupted("SIGQUIT", Signals.SIGQUIT, ends(1)),
    interrupted("SIGUSR1", Signals.SIGUSR1),
    interrupted("SIGUSR2", Signals.SIGUSR2),
    interrupted("SIGXFSZ", Signals.SIGXFSZ),
    interrupted("SIGTSTP", Signals.SIGTSTP),
    Scenario("file size limit reached", 14, file_bytes=500_000, expect=(failed, ends_off, says("rows?"))),
    interrupted("SIGINT, output stalled", Signals.SIGINT, ends(1), output="stalled"),
    Scenario("standard output full", 3, output="full", expect=(failed, ends_off)),
    Scenario("recording's disk full", 3, disk_kib=1000, expect=(failed, ends_off, says("rows?"))),
    # Links that break.
    fault("cable cut", 15, "cable-cut", failed, recording_holds_what_was_received, says(NOT_OFF)),
    fault("cable cut, drives time out", 15, "cable-cut", failed, robot=("--motor-timeout-ms", "100")),
    # A pseudo-terminal takes bytes for an adapter that reads none, and does not tell how many wait.
    fault("adapter stalled", 15, "cable-stalled", failed, says(NOT_OFF)),
    fault("adapter stalled for 1 s", 15, "cable-stalled@+2..+3", failed, off_within(1.2), aftermath_s=2.0),
    fault("motor silent, left", 15, "motor-silent=left", *MOTOR_LOST),
    fault("motor silent, both", 15, "motor-silent=both", *MOTOR_LOST),
    Scenario(
        "motors do not switch off",
        15,
        ("--fault", "off-ignored=both@+1"),
        signal=Signals.SIGINT,
        expect=(failed, says(NOT_OFF)),
    ),
    # The nudge after arming.
    Scenario("held robot", 16, ("--hold", "always"), expect=(named(r"\bheld\b|\bhold"), off_within(3))),
    Scenario(
        "air run on the ground",
        16,
        flqr=("--run", "air-multisine"),
        expect=(named("ground|in the air"), within(distance_m=0.5)),
    ),
    fault("latency of 12 ms", 16, "reply-latency=12@0", failed, says("latency|round trip"), limit_s=40.0),
    fault("commands late by 12 ms", 16, "command-latency=12@0", failed, says("latency|round trip"), limit_s=40.0),
    fault("commands late by 25 ms", 16, "command-latency=25@0", failed, says("latency|round trip"), limit_s=40.0),
    fault("torque twice as large", 16, "torque-factor=1.986@0", named("torque_scale"), off_within(3)),
    fault("torque half as large", 16, "torque-factor=0.5@0", named("torque_scale"), off_within(3)),
    # Start, and what the motors report.
    # A tenth of the limit of 2.42 N m, where the torque ramps in within 0.2 s.
    Scenario("armed at a lean", 17, ("--lean", "0.08"), expect=(torque_at_arming_below(0.27), stood)),
    fault("motor off by itself, left", 17, "motor-off=left", named("motor_off"), off_within(STOP_S)),
    fault("motor error bit", 17, "errors=left:0x02", named("motor_error"), off_within(STOP_S)),
    fault("18 V", 17, "voltage=18", named("voltage"), off_within(STOP_S)),
    fault("95 °C", 17, "temperature=95", named("motor_hot"), off_within(STOP_S)),
    Scenario("busy machine", 18, busy=12, seconds=20.0, limit_s=60.0, only_by_name=True, expect=(stood,)),
    # What monitor says.
    Scenario(
        "monitor, silent bus",
        19,
        STANDING,
        ("--seconds", "2"),
        "monitor",
        arm=False,
        expect=(never_connected, nothing_sent),
    ),
    Scenario(
        "monitor, output stalled",
        19,
        (*STANDING, "--onboard", "bus"),
        (),
        "monitor",
        arm=False,
        output="stalled",
        signal=Signals.SIGINT,
        expect=(ends(1), nothing_sent),
    ),
    fault("checks fail, 15 V", 19, "voltage=15@0", failed, has_end, never_driven, only_queries, limit_s=40.0),
]
