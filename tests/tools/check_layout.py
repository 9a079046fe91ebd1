#!/usr/bin/env python3
"""Holds the layout and the direction of includes: the table below is the design's, section 4."""
import pathlib
import re
import subprocess
import sys

TOP_LEVEL = {"CMakeLists.txt", "CMakePresets.json", "README.md", "run.sh", "test.sh",
             "server", "core", "web", "wasm", "docker", "tests"}

# Module -> what it may include, besides itself and base. What stands below a module comes with it, never above.
CORE = {
    "base": set(),
    "volume": set(), "rbf": set(), "mesh": set(), "plan": set(), "haptics": set(),
    "segment": {"volume"}, "surface": {"volume"}, "phantom": {"volume"},
    "point_volume": {"volume", "plan"},
    "drill": {"point_volume", "plan"}, "splats": {"point_volume"}, "metrics": {"plan", "point_volume"},
    "session": {"drill", "haptics", "plan", "point_volume"},
    "wire": {"session", "splats", "mesh", "plan"},
    "recording": {"session", "wire"},
}
CORE["tradeoff"] = set(CORE)


def closure(module):
    """A module's headers hand on what they include, so those count as allowed too."""
    seen, todo = set(), [module]
    while todo:
        for below in CORE[todo.pop()]:
            if below not in seen:
                seen.add(below)
                todo.append(below)
    return seen | {module, "base"}


ROOMS = {"core": {"core"}, "wasm": {"core", "wasm"}, "server": {"core", "server"},
         "tests": {"core", "server", "wasm", "tests"}}
# Libraries that only these folders may include.
ONLY_IN = {r"gdcm": ("server/import/",), r"boost/(beast|asio)": ("server/http/", "server/ws/", "tests/server/"),
           r"soci": ("server/store/",), r"CLI/|CLI11": ("server/main.cpp", "server/cli/"),
           r"seccomp": ("server/import/",), r"meshoptimizer": ("server/mesh_out/",), r"nifti": ("server/import/",), r"emscripten": ("wasm/",)}
NOT_IN_CORE = re.compile(r"(sys/socket|netinet|fstream|filesystem|chrono|iostream|boost|nlohmann)")
FILE_CALL = re.compile(r"\b(fopen|fprintf|printf|puts|fputs)\s*\(")  # <cstdio> is there for snprintf alone
INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]')


def faults_of_include(path, quote, target):
    room = path.split("/")[0]
    if room == "core" and quote == "<" and NOT_IN_CORE.match(target):
        yield f"core has no files, sockets, clocks or JSON, but includes <{target}>"
    for pattern, places in ONLY_IN.items():
        if quote == "<" and re.match(pattern, target) and not path.startswith(places):
            yield f"<{target}> belongs to {' and '.join(places)} alone"
    if quote != '"':
        return
    other = target.split("/")
    if other[0] not in ("core", "server", "wasm", "tests", "web"):
        if room != "tests":
            yield f'"{target}" is not written from the top of the project'
        return
    if other[0] not in ROOMS.get(room, set()):
        yield f'{room} may not include "{target}"'
    elif room == "core" and other[0] == "core":
        module = path.split("/")[1]
        if module not in CORE:
            yield f"core/{module} is not in the table"
        elif other[1] not in closure(module):
            yield f'core/{module} may not include "{target}"'


def check(root, files):
    """Every fault as 'path:line: text'."""
    faults = []
    for name in sorted({f.split("/")[0] for f in files}):
        if not name.startswith(".") and name not in TOP_LEVEL:
            faults.append(f"{name}:0: does not belong at the top level")
    for path in files:
        if not path.endswith((".h", ".cpp")):
            continue
        for number, line in enumerate((root / path).read_text(encoding="utf-8").splitlines(), 1):
            found = INCLUDE.match(line)
            if path.startswith("core/") and FILE_CALL.search(line):
                faults.append(f"{path}:{number}: core has no files, but calls {FILE_CALL.search(line).group(1)}")
            if found:
                faults += [f"{path}:{number}: {text}" for text in faults_of_include(path, *found.groups())]
    folders = {"/".join(f.split("/")[:2]) for f in files
               if f.startswith(("core/", "server/")) and f.count("/") >= 2}
    folders |= {f.split("/")[0] for f in files if "/" in f and not f.startswith(".")}
    for folder in sorted(folders - {"core/cmake"}):
        if f"{folder}/README.md" not in files and not folder.endswith("/golden"):
            faults.append(f"{folder}:0: opens without a README.md")
    return faults


def tracked(root):
    out = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=root, capture_output=True, text=True, check=True)
    return [f for f in out.stdout.splitlines() if (root / f).is_file()]


if __name__ == "__main__":
    top = pathlib.Path(__file__).resolve().parents[2]
    found = check(top, tracked(top))
    print("\n".join(found) if found else "layout and includes hold")
    sys.exit(1 if found else 0)
