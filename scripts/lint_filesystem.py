#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""No call of std::filesystem that throws, no file opened past io/input_file.h. Exits 1 and names every line.

A path that may not be reached is an answer or an Error with a sentence (io/file_system.h), never an exception of the
standard library; a pipe or a device is refused, not waited for.
"""
import pathlib
import re
import sys

# Of each function, how many arguments the form that throws has at least; the error code is one more, and the last.
CALLS = re.compile(
    r"\b(?:fs|(?:std::)?filesystem)::"
    r"(absolute|canonical|weakly_canonical|relative|proximate|copy|copy_file|copy_symlink|create_director(?:y|ies)|"
    r"create_(?:directory_)?symlink|create_hard_link|current_path|equivalent|exists|file_size|hard_link_count|"
    r"is_(?:block_file|character_file|directory|empty|fifo|other|regular_file|socket|symlink)|last_write_time|"
    r"permissions|read_symlink|remove|remove_all|rename|resize_file|space|status|symlink_status|temp_directory_path|"
    r"directory_iterator|recursive_directory_iterator)(?=\s+\w+\(|\()[^(]*\(")
ERROR_CODE = re.compile(r"\b(error|failed|ignored|ec)\s*$")
STATUS = re.compile(r"^\s*\w*status\s*$")  # asks what is known already
MEMBER = re.compile(r"\.(is_directory|is_regular_file|is_symlink|file_size|last_write_time|symlink_status)\(\)")
STREAM = re.compile(r"\bstd::i?fstream\b|\bcv::imread\b|\bfopen\([^;]*\"r")
OPENS_ITSELF = {"core/timer.cc"}  # /proc


def arguments(text: str, begin: int) -> list[str]:
    """The arguments of the call whose bracket opens before begin."""
    depth, parts = 0, [""]
    for c in text[begin:]:
        if c in ")]}" and depth == 0:
            return parts
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += c
    return parts


def faults(name: str, text: str) -> list[str]:
    bare = re.sub(r"//[^\n]*", "", text)
    found = []

    def add(at: int, what: str) -> None:
        found.append(f"{name}:{bare.count(chr(10), 0, at) + 1}: {what}")

    for call in CALLS.finditer(bare):
        given = arguments(bare, call.end())
        if given == [""] and "iterator" in call[1]:
            continue  # the end of a listing
        if not (ERROR_CODE.search(given[-1]) or (len(given) == 1 and STATUS.match(given[0]))):
            add(call.start(), f"{call[1]} throws; take an error code, or io/file_system.h")
    for loop in re.finditer(r"for \([^;{]*\s:\s[^;{]*directory_iterator", bare):
        add(loop.start(), "the step of this loop throws; use list_folder() of io/file_system.h")
    for member in MEMBER.finditer(bare):
        add(member.start(), f"{member[1]}() throws; take an error code, or io/file_system.h")
    if name not in OPENS_ITSELF:
        for stream in STREAM.finditer(bare):
            add(stream.start(), f"{stream[0]} waits for pipes; use InputFile of io/input_file.h")
    return found


def main() -> int:
    root = pathlib.Path(__file__).resolve().parent.parent / "src" / "vggtcd"
    bad = []
    for path in sorted(root.rglob("*")):
        if path.suffix in {".h", ".cc"} and not path.stem.endswith("_test"):
            bad += faults(str(path.relative_to(root)), path.read_text())
    # What the lint must see, so that it cannot pass because it reads nothing.
    examples = ["fs::exists(path)", "std::filesystem::remove_all(a / f(b, error))", "entry.is_directory()",
                "for (const auto& entry : fs::directory_iterator(folder, error))", "std::ifstream file(path);",
                "fs::directory_iterator entry(folder);"]
    bad += [f"not seen: {example}" for example in examples if not faults("example.cc", example)]
    good = ["fs::exists(path, error)", "fs::exists(status)", "fs::directory_iterator entry(folder, failed);",
            "entry != fs::directory_iterator()", "// fs::exists(path)"]
    bad += [f"seen, but right: {example}" for example in good if faults("example.cc", example)]
    print("\n".join(bad) if bad else "file system: ok")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
