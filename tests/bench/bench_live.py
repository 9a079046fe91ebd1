#!/usr/bin/env python3
"""Live drills alone, and while cases are imported, segmented and reconstructed on the same machine.

    tests/bench/bench_live.py [--program build/release/bin/spinaltap] [--sessions 16] [--seconds 5] [--runs 3] [--realtime]

Prints the median over the runs of each round trip, and their ratio. Both come from the same minutes, turn by turn.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile
import threading

KEYS = ["p50_us", "p99_us", "p999_us", "max_us", "missed", "late"]


def run(program, *arguments):
    out = subprocess.run([program, *arguments, "--json"], capture_output=True, text=True, check=True)
    return json.loads(out.stdout)


def keep_busy(program, folder, begun, ends, done):
    """Jobs, one after another, until told to end."""
    phantom = run(program, "phantom", "--out", f"{folder}/ct", "--reduce", "2")
    seed = ",".join(map(str, phantom["seed_point_patient"]))
    begun.set()
    while not ends.is_set():
        data = ["--data", f"{folder}/data"]
        case = run(program, "import", "--from", f"{folder}/ct", "--name", "meanwhile", *data)["case_id"]
        run(program, "segment", case, "--seed", seed, *data)
        run(program, "reconstruct", case, *data)
        done.append(case)


def main():
    parser = argparse.ArgumentParser()
    top = pathlib.Path(__file__).resolve().parents[2]
    parser.add_argument("--program", default=str(top / "build/release/bin/spinaltap"))
    parser.add_argument("--sessions", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--realtime", action="store_true")
    o = parser.parse_args()
    load = ["load", "--sessions", str(o.sessions), "--seconds", str(o.seconds)] + ["--realtime"] * o.realtime
    alone, disturbed, jobs = [], [], 0
    for _ in range(o.runs):
        alone.append(run(o.program, *load))
        with tempfile.TemporaryDirectory() as folder:
            begun, ends, done = threading.Event(), threading.Event(), []
            thread = threading.Thread(target=keep_busy, args=(o.program, folder, begun, ends, done))
            thread.start()
            begun.wait(timeout=120)
            disturbed.append(run(o.program, *load))
            ends.set()
            thread.join()
            jobs += len(done)
    print(f"{o.sessions} sessions at 1 kHz, {o.runs} x {o.seconds:g} s; {jobs} cases reconstructed meanwhile")
    if o.realtime:
        print(alone[0].get("realtime", ""))
    print(f"{'':10}{'alone':>12}{'disturbed':>12}{'ratio':>8}")
    for key in KEYS:
        a, b = (statistics.median(run[key] for run in runs) for runs in (alone, disturbed))
        print(f"{key:10}{a:12.1f}{b:12.1f}{b / a if a else float('nan'):8.2f}")


if __name__ == "__main__":
    main()
