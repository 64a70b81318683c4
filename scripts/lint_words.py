#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every source file starts with its licence; no tracked text names a path of one machine. Exits 1 otherwise."""
import pathlib
import re
import subprocess
import sys

MACHINE_PATH = re.compile(r"(?<![\w.])/(work|root|home/\w+|Users/\w+)/")
SOURCE = {".h", ".cc", ".py", ".ts", ".mjs"}
TEXT = SOURCE | {".md", ".txt", ".json", ".cmake", ".html", ".css", ""}


def main() -> int:
    root = pathlib.Path(__file__).resolve().parent.parent
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, check=True).stdout
    bad = []
    for name in listed.decode().split("\0"):
        path = root / name
        if not name or not path.is_file() or path.suffix not in TEXT or path == pathlib.Path(__file__).resolve():
            continue
        try:
            text = path.read_text()
        except UnicodeDecodeError:
            continue
        if path.suffix in SOURCE and "SPDX-License-Identifier: Apache-2.0" not in text[:400]:
            bad.append(f"{name}: no SPDX line at the top")
        for number, line in enumerate(text.splitlines(), 1):
            if MACHINE_PATH.search(line):
                bad.append(f"{name}:{number}: a path of one machine")
    print("\n".join(bad) if bad else "words: ok")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
