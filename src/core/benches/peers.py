#!/usr/bin/env python3
"""Speed of the planar plant beside its peers, in one run on one core.

    python3 src/core/benches/peers.py [PEERS_SCRIPT]

PEERS_SCRIPT (default ../shared/peers/sim_peers.py, beside the repository) simulates the same robot with the
same friction, gain, start and ten steps of order 4 a millisecond in numba, MuJoCo and SciPy; it needs these
packages in the Python that runs this, and prints one line of JSON. Of a peer the shortest of its times counts
(wall clock or processor), of the plant the wall clock. The two required ratios decide the exit code.
"""
import json
import os
import pathlib
import re
import subprocess
import sys

REPOSITORY = pathlib.Path(__file__).resolve().parents[3]
REQUIRED = {"numba RK4": 4, "mujoco [0-9.]+ RK4": 20}
NANOSECONDS = {"ns": 1, "µs": 1e3, "ms": 1e6, "s": 1e9}


def pinned(command, folder):
    cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
    command = (["taskset", "-c", str(cores[-1])] if cores else []) + command
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    return subprocess.run(command, cwd=folder, env=os.environ | one_thread, stdout=subprocess.PIPE, text=True, check=True).stdout


def bench():
    """Fastest and median time of a tick with ten substeps, ns."""
    subprocess.run(["cargo", "bench", "-q", "-p", "flqr-core", "--bench", "simulate", "--no-run"], cwd=REPOSITORY, check=True)
    text = pinned(["cargo", "bench", "-q", "-p", "flqr-core", "--bench", "simulate", "--", "planar_plant"], REPOSITORY)
    row = re.search(r"─ 10 (.*)", text).group(1)
    times = [float(number) * NANOSECONDS[unit] / 1000 for number, unit in re.findall(r"([0-9.]+) (ns|µs|ms|s)\b", row)]
    return times[0], times[2]


def main():
    script = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else REPOSITORY.parent / "shared/peers/sim_peers.py").resolve()
    if not script.exists():
        print(f"skipped: there is no {script}")
        return 0
    before = bench()
    peers = json.loads(pinned([sys.executable, str(script)], script.parent))["peers"]
    after = bench()
    fastest, median = min(before[0], after[0]), min(before[1], after[1])
    print(f"planar plant, 10 substeps of order 4 a 1 ms step: {fastest:.0f} ns (median {median:.0f} ns)")
    missed = False
    for name, times in peers.items():
        if not isinstance(times, dict):
            print(f"{name}: {times}")
            continue
        peer = min(times[key] for key in ("min_ns", "cpu_median_ns"))
        required = next((ratio for pattern, ratio in REQUIRED.items() if re.match(pattern, name)), None)
        missed |= required is not None and peer < required * fastest
        goal = f", required {required}" if required else ""
        print(f"{name}: {peer:.0f} ns, ratio {peer / fastest:.1f}{goal}")
    absent = [pattern for pattern in REQUIRED if not any(re.match(pattern, name) for name in peers)]
    return int(missed or bool(absent))


sys.exit(main())
