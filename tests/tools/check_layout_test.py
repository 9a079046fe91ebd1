#!/usr/bin/env python3
"""The layout checker must find planted faults: a checker that cannot fail holds nothing."""
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import check_layout  # noqa: E402

PLANTED = {
    "core/mesh/a.cpp": ('#include "core/rbf/rbf.h"\n', "core/mesh may not include"),
    "core/haptics/b.h": ('#include "core/point_volume/point_volume.h"\n', "core/haptics may not include"),
    "core/base/c.cpp": ("#include <fstream>\n", "core has no files"),
    "core/plan/k.cpp": ('void f() { printf("x"); }\n', "core has no files, but calls printf"),
    "core/volume/d.cpp": ('#include "server/store/store.h"\n', "core may not include"),
    "server/cli/e.cpp": ('#include "tests/scenes/scenes.h"\n', "server may not include"),
    "server/cli/f.cpp": ("#include <gdcmImageReader.h>\n", "belongs to server/import/"),
    "core/novel/g.cpp": ('#include "core/base/vec3.h"\n', "not in the table"),
    "core/mesh/h.h": ('#include "triangle_mesh.h"\n', "not written from the top"),
    "notes/i.txt": ("", "does not belong at the top level"),
}
FINE = {
    "core/session/x.h": '#include "core/drill/engine.h"\n#include <vector>\n',
    "core/tradeoff/y.cpp": '#include "core/rbf/rbf.h"\n',
    "core/metrics/n.cpp": "#include <cstdio>\nint n = std::snprintf(nullptr, 0, \"1\");\n",
    "server/import/z.cpp": "#include <gdcmImageReader.h>\n",
    "tests/core/t.cpp": '#include "core/rbf/rbf.h"\n',
}


def main():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        files = {path: text for path, (text, _) in PLANTED.items()} | FINE
        readmes = {"/".join(p.split("/")[:n]) + "/README.md" for p in files for n in (1, 2) if p.count("/") >= n}
        for path, text in (files | {r: "" for r in readmes}).items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
        names = sorted(set(files) | readmes)
        faults = check_layout.check(root, names)
        for path, (_, expected) in PLANTED.items():
            place = path if path.startswith("core") or path.startswith("server") else path.split("/")[0]
            assert any(f.startswith(place) and expected in f for f in faults), f"missed: {path}: {expected}"
        for path in FINE:
            assert not any(f.startswith(path + ":") for f in faults), f"false alarm: {path}: {faults}"
        assert len(faults) == len(PLANTED), faults
        names.remove("core/mesh/README.md")
        assert any(f.startswith("core/mesh:") for f in check_layout.check(root, names)), "missed a folder without README"
    print("every planted fault found, no false alarm")


main()
