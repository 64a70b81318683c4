#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Photos on the command line: what is refused, with which sentence, and that an interrupted job continues.

Usage: photos_test.py PROGRAM [unittest arguments]
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()


def run(*arguments, **kwargs):
    environment = {**os.environ, "VGGTCD_WEIGHTS": "", "HOME": "/nonexistent", **kwargs.pop("env", {})}
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=500,
                          env=environment, **kwargs)


def write_photo(path, seed, width=96, height=64):
    """A PPM of noise: small, and no two alike."""
    value, pixels = seed * 2654435761 % 2**32 or 1, bytearray()
    for _ in range(width * height * 3):
        value ^= value << 13 & 0xFFFFFFFF
        value ^= value >> 17
        value ^= value << 5 & 0xFFFFFFFF
        pixels.append(value & 0xFF)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"P6 %d %d 255\n" % (width, height) + pixels)


class BadInput(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.temporary.name)
        for epoch, first in (("before", 1), ("after", 11)):
            for i in range(3):
                write_photo(self.root / epoch / f"{i}.ppm", first + i)

    def tearDown(self):
        self.temporary.cleanup()

    def refusal(self, *arguments, status, before="before", after="after", **kwargs):
        done = run("detect", self.root / before, self.root / after, "-o", self.root / "out", *arguments, **kwargs)
        self.assertEqual(done.returncode, status, done.stderr)
        lines = [line for line in done.stderr.splitlines() if line.startswith("vggt-cd: ")]
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertFalse((self.root / "out" / "summary.json").exists())
        return lines[0]

    def test_identical_folders(self):
        self.assertIn("the same 3 photos", self.refusal(status=3, after="before"))

    def test_one_photo_a_side(self):
        for name in ("1.ppm", "2.ppm"):
            (self.root / "after" / name).unlink()
        self.assertIn("at least 2 different photos", self.refusal(status=3))

    def test_duplicates_count_once(self):
        for name in ("1.ppm", "2.ppm"):
            shutil.copy(self.root / "after" / "0.ppm", self.root / "after" / name)
        self.assertIn("found 1", self.refusal(status=3))

    def test_portrait_mixed_with_landscape(self):
        write_photo(self.root / "after" / "3.ppm", 20, width=64, height=96)
        self.assertIn("3.ppm is portrait", self.refusal(status=3))

    def test_nothing_in_common(self):
        if not shutil.which("colmap"):
            self.skipTest("no COLMAP")
        self.assertIn("no two of the 6 photos", self.refusal(status=5))

    def test_missing_weights(self):
        self.assertIn("--reconstructor classical", self.refusal("--reconstructor", "vggt", status=4))
        self.assertIn("no such file", self.refusal("--weights", self.root / "none.pt", status=4))

    def test_missing_colmap(self):
        self.assertIn("install COLMAP", self.refusal(status=8, env={"PATH": str(self.root)}))

    def test_a_video_without_frames(self):
        (self.root / "broken.mp4").write_bytes(b"nothing")
        self.assertIn("broken.mp4", self.refusal(status=3, after="broken.mp4"))

    def test_photos_on_one_side_and_predictions_on_the_other(self):
        self.assertIn("both sides", self.refusal(status=3, after="after.npz"))

    def test_joint_is_for_predictions(self):
        self.assertIn("leave the option out", self.refusal("--joint", "x.npz", status=2))

    def test_dry_run_writes_nothing(self):
        done = run("detect", self.root / "before", self.root / "after", "-o", self.root / "out", "--dry-run")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("3 before, 3 after", done.stdout)
        self.assertFalse((self.root / "out").exists())


if __name__ == "__main__":
    unittest.main()
