#!/usr/bin/env python3
"""The image runs the same scripts as run.sh; this holds the files to that, where no container engine runs."""
import pathlib
import re
import sys

TOP = pathlib.Path(__file__).resolve().parents[2]


def main():
    faults = []
    image = (TOP / "docker/Dockerfile").read_text()
    compose = (TOP / "docker/compose.yaml").read_text()
    for name in ("docker/steps.sh", "./run.sh --build-only", "./run.sh"):
        if name not in image:
            faults.append(f"docker/Dockerfile: does not run {name}")
    for source in re.findall(r"^COPY (?:--\S+ )*(\S+) ", image, re.M):
        if source != "." and not (TOP / source).exists():
            faults.append(f"docker/Dockerfile: copies {source}, which is not there")
    found = re.search(r"dockerfile: (\S+)", compose)
    if not found or not (TOP / found.group(1)).exists():
        faults.append("docker/compose.yaml: names no Dockerfile of the project")
    if re.search(r"\bUSER\b", image) is None:
        faults.append("docker/Dockerfile: serves as root")
    help_text = (TOP / "run.sh").read_text()
    for option in set(re.findall(r"(--[a-z-]+)", image.split("CMD")[-1])):
        if option not in help_text:
            faults.append(f"docker/Dockerfile: run.sh has no option {option}")
    for line in (TOP / "docker/packages.txt").read_text().splitlines():
        if not line.startswith("#") and not re.fullmatch(r"[a-z0-9.+-]+", line):
            faults.append(f"docker/packages.txt: '{line}' is no package name")
        if line == "libboost-dev":
            faults.append("docker/packages.txt: libboost-dev conflicts with libboost1.81-dev")
    print("\n".join(faults) or "docker files hold")
    return 1 if faults else 0


sys.exit(main())
