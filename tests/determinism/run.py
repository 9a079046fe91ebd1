#!/usr/bin/env python3
"""Builds scene_hash with every compiler and level there is, and compares each hash with the golden ones.

usage: run.py [--work DIR] [--only NAME[,NAME...]]

Prints one line a target; exits 1 when a hash differs or a target does not build. A compiler that is not installed is an
error too, not a pass: docker/packages.txt lists them all. CPU levels that this machine lacks are named and left out.
"""
import argparse
import concurrent.futures
import csv
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MODULES = ["base", "plan", "point_volume", "drill", "haptics", "session"]
FLAGS = ["-std=c++20", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-Wall", "-Wextra", "-Werror"]
NATIVE = [
    ("g++-O0", "g++", ["-O0"]),
    ("g++-O3", "g++", ["-O3"]),
    ("g++-O3-v3", "g++", ["-O3", "-march=x86-64-v3"]),
    ("g++-O3-v4", "g++", ["-O3", "-march=x86-64-v4"]),
    ("clang++-O0", "clang++", ["-O0"]),
    ("clang++-O3", "clang++", ["-O3"]),
    ("clang++-O3-v3", "clang++", ["-O3", "-march=x86-64-v3"]),
    ("clang++-O3-v4", "clang++", ["-O3", "-march=x86-64-v4"]),
]
# With contraction the bits must differ, or the comparison could not tell.
CONTROL = ("contracted-v3", "g++", ["-O3", "-march=x86-64-v3", "-ffp-contract=fast"])
WASM = ("em++-O2", "em++", ["-O2", "-msimd128"])


def golden():
    with open(ROOT / "tests/scenes/golden/scenes.csv") as file:
        return list(csv.reader(line for line in file if not line.startswith("#")))


def cpu_has(level):
    needed = {"v3": {"avx2", "bmi2", "fma"}, "v4": {"avx512f", "avx512vl", "avx512bw", "avx512dq"}}
    try:
        text = pathlib.Path("/proc/cpuinfo").read_text()
    except OSError:
        return False
    flags = next((set(line.split()) for line in text.splitlines() if line.startswith("flags")), set())
    return needed[level] <= flags


def sources():
    found = [path for module in MODULES for path in sorted((ROOT / "core" / module).glob("*.cpp"))]
    return found + [ROOT / "tests/determinism/scene_hash.cpp"]


def run(command, env):
    done = subprocess.run(command, capture_output=True, text=True, env=env, check=False)
    if done.returncode != 0:
        tail = " | ".join((done.stderr or done.stdout).strip().splitlines()[-4:])
        raise RuntimeError(f"{pathlib.Path(command[0]).name} failed: {tail}")
    return done.stdout


def build(name, compiler, flags, work, env):
    folder = work / name
    folder.mkdir(parents=True, exist_ok=True)
    include = ["-I" + str(ROOT)]
    if compiler == "em++":  # Debian's header-only libraries through a folder of links: -I/usr/include shadows the sysroot
        links = work / "header_only"
        links.mkdir(exist_ok=True)
        for library in ("tl", "hwy"):
            if not (links / library).is_symlink():
                (links / library).symlink_to("/usr/include/" + library)
        include += ["-isystem", str(links)]
    launcher = ["ccache"] if shutil.which("ccache") else []

    # One translation unit: the headers cost far more than the code, and every target reads them once.
    whole = folder / "whole.cpp"
    whole.write_text("".join(f'#include "{source.relative_to(ROOT)}"\n' for source in sources()))
    target = str(folder / "whole.o")
    run(launcher + [compiler, *FLAGS, *flags, *include, "-c", str(whole), "-o", target], env)
    if compiler == "em++":
        program = folder / "scene_hash.js"
        run([compiler, *flags, target, "-o", str(program), "-sENVIRONMENT=node", "-sALLOW_MEMORY_GROWTH=1"], env)
        # node 18 and later would fetch the module over a URL that does not exist.
        return ["node", "--no-experimental-fetch", str(program)]
    program = folder / "scene_hash"
    run([compiler, *flags, target, "-o", str(program), "-lhwy"], env)
    return [str(program)]


def compare(command, rows, env):
    """The rows that differ, as one line each."""
    arguments = [field for row in rows for field in row[:4]]
    lines = run(command + arguments, env).split("\n")[: len(rows)]
    wrong = []
    for row, line in zip(rows, lines):
        expected = " ".join(row[:6])
        if line.strip() != expected:
            wrong.append(f"got '{line.strip()}', golden '{expected}'")
    return wrong + ["fewer lines than runs"] * (len(lines) < len(rows))


def judge(name, compiler, flags, work, rows, env):
    """A line to print, and whether all is well."""
    level = name[-2:]
    if level in ("v3", "v4") and not cpu_has(level):
        return f"{name:14} left out: this CPU lacks x86-64-{level}", True
    wanted = [row for row in rows if row[6] == "short" or "-O0" not in flags]
    try:
        wrong = compare(build(name, compiler, flags, work, env), wanted, env)
    except (RuntimeError, OSError) as error:
        return f"{name:14} {error}", False
    if "-ffp-contract=fast" in flags:
        return f"{name:14} " + ("differs, as it must" if wrong else "does not differ: the bits prove nothing"), bool(wrong)
    return f"{name:14} " + (f"{len(wanted)} hashes agree" if not wrong else "; ".join(wrong)), not wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, help="where to build; a temporary folder otherwise")
    parser.add_argument("--only", help="names of targets, separated by commas")
    options = parser.parse_args()
    env = dict(os.environ, NODE_PATH=os.environ.get("NODE_PATH", "/usr/share/nodejs"))
    only = set(options.only.split(",")) if options.only else None
    rows, failed = golden(), 0
    with tempfile.TemporaryDirectory() as scratch, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        work = options.work or pathlib.Path(scratch)
        work.mkdir(parents=True, exist_ok=True)
        targets = [target for target in [*NATIVE, CONTROL, WASM] if not only or target[0] in only]
        for line, right in pool.map(lambda target: judge(*target, work, rows, env), targets):
            failed += not right
            print(line, flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
