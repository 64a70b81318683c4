#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that every test that docs/faults.md names exists."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def unit_tests():
    pattern = re.compile(r"^TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", re.MULTILINE)
    return {f"{suite}.{name}" for path in ROOT.glob("src/vggtcd/*/*_test.cc") for suite, name in pattern.findall(path.read_text())}


def end_to_end_tests(path):
    """Class.test of the classes in a file."""
    names, current = set(), None
    for line in path.read_text().splitlines():
        if match := re.match(r"class (\w+)", line):
            current = match[1]
        elif match := re.match(r"    def (test_\w+)", line):
            names.add(f"{current}.{match[1]}")
    return names


def main():
    tests = unit_tests()
    for path in ROOT.glob("tests/e2e/*_test.py"):
        tests |= {f"{path.stem.removesuffix('_test')}: {name}" for name in end_to_end_tests(path)}
    text = (ROOT / "docs" / "faults.md").read_text()
    held = text[text.index("## "):]
    named = set(re.findall(r"`((?:\w+: \w+\.test_\w+)|(?:[A-Z]\w+\.[A-Z]\w+))`", held))
    missing = sorted(named - tests)
    for name in missing:
        print(f"docs/faults.md: expected a test called {name}, found none; name the test that holds the row", file=sys.stderr)
    rows = [line for line in held.splitlines() if line.startswith("|") and not line.startswith(("|---", "| situation"))]
    untested = [row for row in rows if not re.search(r"\| `[^|]+ \|$", row)]
    for row in untested:
        print(f"docs/faults.md: expected a test in the last column, found {row}", file=sys.stderr)
    return 1 if missing or untested or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
