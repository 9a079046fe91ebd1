#!/usr/bin/env python3
"""bench_chain.py PROGRAM [--data DIR] [SCENE ...]: from a CT to a case that can be drilled, stage by stage.

Each stage is the program itself: import, segment, reconstruct, and the point volumes of both pedicles at 0.1 mm. Printed for
each: seconds by the clock, seconds of CPU, peak memory. Scenes: phantom (95 slices, made first and not counted), osteoporotic,
verse-L1 .. verse-L5, pancreas-L3, tptbox-L3 (these need ../shared/data, or --data). Default: all that are there.
"""
import argparse
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time

SHARED = pathlib.Path(__file__).resolve().parents[3] / "shared" / "data" / "ct"
VERSE = "verse-014/sub-verse014_ct.nii.gz"
VERSE_LABEL = "verse-014/sub-verse014_seg-vert_msk.nii.gz"


class Stages:
    """Runs the program; keeps what each stage took."""

    def __init__(self, program, store):
        self.program, self.store, self.rows = program, store, []

    def run(self, *arguments):
        command = [self.program, *map(str, arguments), "--data", self.store, "--json"]
        start = time.monotonic()
        child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        out, err = child.stdout.read(), child.stderr.read()
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - start
        if child.returncode != 0:
            raise SystemExit(f"{' '.join(command)}: {err.strip()}")
        self.rows.append((arguments[0], seconds, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024))
        return json.loads(out)

    def show(self, scene, figures):
        print(f"\n{scene}: {figures['samples']} samples, {figures['centres']} centres, {figures['triangles']} triangles; "
              + ", ".join(f"{k[:-2]} {v:.2f} s" for k, v in figures.items() if k.endswith("_s")))
        print(f"  {'stage':12} {'clock s':>8} {'CPU s':>8} {'peak MB':>8}")
        for name, clock, cpu, peak in self.rows:
            print(f"  {name:12} {clock:8.2f} {cpu:8.2f} {peak:8.0f}")
        print(f"  {'all':12} {sum(r[1] for r in self.rows):8.2f} {sum(r[2] for r in self.rows):8.2f} "
              f"{max(r[3] for r in self.rows):8.0f}", flush=True)


def joined(point):
    return ",".join(str(v) for v in point)


def finish(stages, scene, case, paths):
    figures = stages.run("reconstruct", case)
    paths = paths or moved_paths(stages.program, stages.store, case)
    for name, (entry, target) in paths.items():
        stages.run("plan", case, "--label", name, "--entry", joined(entry), "--target", joined(target), "--spacing", "0.1")
    stages.show(scene, figures)


def phantom(program, store, folder, osteoporotic):
    ct = folder / ("osteoporotic" if osteoporotic else "phantom")
    made = subprocess.run([program, "phantom", "--out", ct, "--json"] + (["--osteoporotic"] if osteoporotic else []),
                          check=True, capture_output=True, text=True)
    truth = json.loads(made.stdout)
    stages = Stages(program, store)
    case = stages.run("import", "--from", ct)["case_id"]
    stages.run("segment", case, "--seed", joined(truth["seed_point_patient"]))
    finish(stages, ct.name, case,
           {side: (p["entry_patient"], p["target_patient"]) for side, p in truth["pedicles"].items()})


# Entries and targets through the pedicles, read off the scans. Elsewhere those of verse-L3 are moved to the bone's middle: not a
# surgeon's choice, but as many points.
L3_PATHS = {"right": ((-41.7, 200.1, -129.0), (-37.4, 172.0, -122.2)), "left": ((-5.9, 198.2, -132.5), (-13.2, 172.0, -123.5))}
L3_MIDDLE = (-23.0, 183.8, -128.6)  # of its mesh's vertices
REAL = {
    "verse-L3": (VERSE, VERSE_LABEL, 22, None, L3_PATHS),
    "pancreas-L3": ("pancreas-cb-001/dicom", None, 0,
                    ["--seed", "6,110,220"],
                    {"right": ((-17.1, 144.2, 224.6), (-0.2, 112.0, 225.0)),
                     "left": ((34.3, 139.3, 223.1), (14.6, 112.0, 222.9))}),
    "tptbox-L3": ("tptbox-l3/sub-ct_label-22_ct.nii.gz", "tptbox-l3/sub-ct_seg-vert_label-22_msk.nii.gz", 22, None, None),
}
for number, value in ((1, 20), (2, 21), (4, 23), (5, 24)):
    REAL[f"verse-L{number}"] = (VERSE, VERSE_LABEL, value, None, None)


def moved_paths(program, store, case):
    """L3_PATHS, moved by as much as this mesh's middle lies from that one's."""
    with tempfile.NamedTemporaryFile(suffix=".stl") as mesh:
        subprocess.run([program, "export", case, "--format", "stl", "--out", mesh.name, "--data", store], capture_output=True,
                       check=True)
        data = pathlib.Path(mesh.name).read_bytes()
    triangles = [struct.unpack_from("<9f", data, 84 + 50 * n + 12) for n in range((len(data) - 84) // 50)]
    middle = [sum(t[a] + t[a + 3] + t[a + 6] for t in triangles) / (3 * len(triangles)) for a in range(3)]
    shift = [m - o for m, o in zip(middle, L3_MIDDLE)]
    return {side: tuple(tuple(c + d for c, d in zip(p, shift)) for p in path) for side, path in L3_PATHS.items()}


def real(program, store, scene, data):
    source, label, value, seed, paths = REAL[scene]
    stages = Stages(program, store)
    arguments = ["import", "--from", data / source]
    if label:
        arguments += ["--label", data / label, "--label-value", value]
    case = stages.run(*arguments)["case_id"]
    stages.run("segment", case, *(seed or []))
    finish(stages, scene, case, paths)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--data", type=pathlib.Path, default=SHARED)
    options = parser.parse_args()
    known = ["phantom", "osteoporotic", *(sorted(REAL) if options.data.exists() else [])]
    for scene in options.scenes or known:
        if scene not in known:
            sys.exit(f"no scene {scene!r}; there are {', '.join(known)}")
        with tempfile.TemporaryDirectory() as folder:
            store = str(pathlib.Path(folder) / "store")
            if scene in ("phantom", "osteoporotic"):
                phantom(options.program, store, pathlib.Path(folder), scene == "osteoporotic")
            else:
                real(options.program, store, scene, options.data)


if __name__ == "__main__":
    main()
