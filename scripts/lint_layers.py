#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Who may include whom (docs/architecture.md), as data. Exits 1 and names every line that breaks it."""
import pathlib
import re
import sys

MAY_INCLUDE = {
    "core": set(),
    "geometry": {"core"},
    "scene": {"core", "geometry"},
    "features": {"core", "geometry", "scene"},
    "io": {"core", "geometry", "scene"},
    "nn": {"core"},
    "vggt": {"core", "geometry", "scene", "io", "nn"},
    "reconstruction": {"core", "geometry", "scene", "features", "io", "nn", "vggt"},
    "registration": {"core", "geometry", "scene", "features"},
    "change": {"core", "geometry", "scene"},
    "evaluation": {"core", "geometry", "scene", "io", "registration", "change"},
    "report": {"core", "geometry", "scene", "io", "change"},
}
MAY_INCLUDE["pipeline"] = set(MAY_INCLUDE) | {"evaluation", "report"}
MAY_INCLUDE["cli"] = set(MAY_INCLUDE)


def main() -> int:
    root = pathlib.Path(__file__).resolve().parent.parent / "src" / "vggtcd"
    bad = []
    for path in sorted(root.rglob("*")):
        if path.suffix not in {".h", ".cc"}:
            continue
        room = path.relative_to(root).parts[0]
        for number, line in enumerate(path.read_text().splitlines(), 1):
            found = re.match(r'\s*#\s*include\s*[<"]([^>"]+)[>"]', line)
            if not found:
                continue
            header = found.group(1)
            where = f"{path.relative_to(root.parent.parent)}:{number}"
            if header.startswith("vggtcd/"):
                other = header.split("/")[1]
                if other != room and other not in MAY_INCLUDE.get(room, set()):
                    bad.append(f"{where}: {room} may not include {other}")
            if re.match(r"(oneapi/)?dnnl", header) and not (room == "nn" and path.suffix == ".cc"):
                bad.append(f"{where}: oneDNN headers belong in nn/*.cc")
    print("\n".join(bad) if bad else "layers: ok")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
