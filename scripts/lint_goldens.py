#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every folder of tests/golden has a manifest.json and is named by a test; exits 1 otherwise."""
import json
import pathlib
import subprocess
import sys


def main() -> int:
    root = pathlib.Path(__file__).resolve().parent.parent
    golden = root / "tests" / "golden"
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "*_test.cc"],
                            cwd=root, capture_output=True, text=True, check=True).stdout.split()
    sources = "\n".join((root / name).read_text() for name in listed if (root / name).exists())
    bad = []
    for case in sorted(p for p in golden.iterdir() if p.is_dir()) if golden.is_dir() else []:
        manifest = case / "manifest.json"
        if not manifest.is_file():
            bad.append(f"tests/golden/{case.name}: no manifest.json that says what made it")
        else:
            json.loads(manifest.read_text())
        if f"golden/{case.name}" not in sources:
            bad.append(f"tests/golden/{case.name}: no test names it")
    print("\n".join(bad) if bad else "goldens: ok")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
