#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Photos on the command line: what is refused, and with which sentence; what is planned.

Usage: photos_test.py PROGRAM TEST_MEDIA [unittest arguments]
"""
import fcntl
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from running import HANG_S

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
TEST_MEDIA = pathlib.Path(sys.argv.pop(1)).resolve()


def run(*arguments, **kwargs):
    environment = {**os.environ, "VGGTCD_WEIGHTS": "", "HOME": "/nonexistent", **kwargs.pop("env", {})}
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=HANG_S,
                          env=environment, **kwargs)


def run_bytes(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, timeout=500,
                          env={**os.environ, "VGGTCD_WEIGHTS": "", "HOME": "/nonexistent"})


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


def write_rgb(path, gray):
    path.parent.mkdir(parents=True, exist_ok=True)
    rgb = np.repeat(np.clip(gray, 0, 255).astype("u1")[:, :, None], 3, axis=2)
    path.write_bytes(b"P6 %d %d 255\n" % (gray.shape[1], gray.shape[0]) + rgb.tobytes())


FOCAL, WIDTH, HEIGHT = 500.0, 480, 360


def places(count):
    """Where photos are taken, in metres: a walk to the right, up and down."""
    return [np.array([0.3 * k, 0.15 * (-1) ** k, 0.05 * k]) for k in range(count)]


def wall(rng):
    """A texture of all sizes, 1 cm a pixel."""
    texture = np.zeros((1024, 1024))
    for size in (4, 16, 64, 256, 1024):
        texture += np.kron(rng.uniform(0, 60, (size, size)), np.ones((1024 // size,) * 2))
    return texture


def photo_of_wall(texture, place, yaw=0.0, distance=5.0):
    u, v = np.meshgrid(np.arange(WIDTH) - WIDTH / 2, np.arange(HEIGHT) - HEIGHT / 2)
    c, s = np.cos(yaw), np.sin(yaw)
    ray = np.stack([c * u / FOCAL + s, v / FOCAL, c - s * u / FOCAL])
    scale = (distance - place[2]) / ray[2]
    x, y = (100 * (place[k] + scale * ray[k]) + 400 for k in (0, 1))
    i, j = np.floor(y).astype(int), np.floor(x).astype(int)
    dy, dx = y - i, x - j
    at = lambda a, b: texture[a % 1024, b % 1024]
    return ((1 - dy) * ((1 - dx) * at(i, j) + dx * at(i, j + 1)) +
            dy * ((1 - dx) * at(i + 1, j) + dx * at(i + 1, j + 1)))


def photo_of_stamps(stamps, place):
    """Small textured stamps that hang in the dark at all distances: cameras can be found, depth of the dark cannot."""
    image = np.full((HEIGHT, WIDTH), 20.0)
    for centre, texture in sorted(stamps, key=lambda stamp: -stamp[0][2]):
        x, y, z = centre - place
        half = texture.shape[0] // 2
        u, v = int(round(FOCAL * x / z + WIDTH / 2)), int(round(FOCAL * y / z + HEIGHT / 2))
        if half <= u < WIDTH - half and half <= v < HEIGHT - half:
            image[v - half:v + half, u - half:u + half] = texture
    return image


class BadInput(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.temporary.name)
        for epoch, first in (("before", 1), ("after", 11)):
            for i in range(4):
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
        self.assertIn("the same 4 photos", self.refusal(status=3, after="before"))

    def test_a_photo_of_both_epochs_is_named(self):
        shutil.copy(self.root / "before" / "0.ppm", self.root / "after" / "again.ppm")
        done = run("detect", self.root / "before", self.root / "after", "-o", self.root / "out", "--dry-run")
        self.assertRegex(done.stderr, "photos of .*after that are also in .*before tell of no change: again.ppm")

    def test_one_photo_a_side(self):
        for name in ("1.ppm", "2.ppm", "3.ppm"):
            (self.root / "after" / name).unlink()
        self.assertIn("at least 2 different photos", self.refusal(status=3))

    def test_one_frame_of_many(self):
        self.assertIn("--frames: expected 0 (all photos) or at least 2, found 1", self.refusal("--frames", 1, status=2))

    @unittest.skipUnless(shutil.which("colmap"), "no COLMAP")
    def test_too_few_photos_for_the_classical_reconstruction_are_refused_before_any_work(self):
        for name in ("2.ppm", "3.ppm"):
            (self.root / "after" / name).unlink()
        for arguments in ((), ("--dry-run",)):
            self.assertIn("4 photos before and 2 after, at least 4 of each", self.refusal(*arguments, status=5))

    def test_duplicates_count_once(self):
        for name in ("1.ppm", "2.ppm", "3.ppm"):
            shutil.copy(self.root / "after" / "0.ppm", self.root / "after" / name)
        self.assertIn("found 1", self.refusal(status=3))

    def test_portrait_mixed_with_landscape(self):
        write_photo(self.root / "after" / "3.ppm", 20, width=64, height=96)
        self.assertIn("after/3.ppm is portrait", self.refusal(status=3))

    def test_nothing_in_common(self):
        if not shutil.which("colmap"):
            self.skipTest("no COLMAP")
        self.assertIn("no two of the 8 photos", self.refusal(status=5))

    def write_epochs(self, photo):
        """photo(k) for a walk, every other one into the after epoch."""
        for k in range(12):
            write_rgb(self.root / ("walk_before", "walk_after")[k % 2] / f"{k:02}.ppm", photo(k))

    def walk_refusal(self, side=280):
        return self.refusal("--frame-side", side, status=5, before="walk_before", after="walk_after")

    @unittest.skipUnless(shutil.which("colmap"), "no COLMAP")
    def test_a_flat_wall_does_not_determine_depth(self):
        texture, where = wall(np.random.default_rng(1)), places(12)
        self.write_epochs(lambda k: photo_of_wall(texture, where[k]))
        self.assertIn("a plane explains", self.walk_refusal())

    @unittest.skipUnless(shutil.which("colmap"), "no COLMAP")
    def test_turning_on_the_spot_does_not_determine_depth(self):
        texture = wall(np.random.default_rng(2))
        self.write_epochs(lambda k: photo_of_wall(texture, np.zeros(3), yaw=0.05 * (k - 6)))
        self.assertIn("classical reconstruction refused: ", self.walk_refusal())

    @unittest.skipUnless(shutil.which("colmap"), "no COLMAP")
    def test_photos_without_depth(self):
        rng, where = np.random.default_rng(3), places(12)
        stamps = [(np.array([rng.uniform(-2, 5), rng.uniform(-2, 2), rng.uniform(4, 9)]),
                   np.kron(rng.uniform(0, 255, (4, 4)), np.ones((3, 3)))) for _ in range(24)]
        self.write_epochs(lambda k: photo_of_stamps(stamps, where[k]))
        self.assertIn("photos agree on the depth of", self.walk_refusal(side=476))

    def test_missing_weights(self):
        self.assertIn("--reconstructor classical", self.refusal("--reconstructor", "vggt", status=4))
        line = self.refusal("--weights", self.root / "none.pt", status=4)
        self.assertIn("none.pt: expected network weights, found no such file; detect also works without", line)
        line = self.refusal(status=4, env={"VGGTCD_WEIGHTS": "/nowhere.pt"})
        self.assertIn("VGGTCD_WEIGHTS: /nowhere.pt: expected network weights", line)

    def test_missing_colmap(self):
        self.assertIn("install COLMAP", self.refusal(status=8, env={"PATH": str(self.root)}))

    def test_a_colmap_that_returns_other_photos_is_named(self):
        """A colmap on the PATH that answers with a model of one photo that it was not given."""
        for epoch, first in (("before", 40), ("after", 60)):
            for i in range(4, 12):
                write_photo(self.root / epoch / f"{i}.ppm", first + i)
        model, tools = self.root / "model", self.root / "tools"
        model.mkdir(), tools.mkdir()
        (model / "cameras.bin").write_bytes(struct.pack("<QIiQQ4d", 1, 1, 2, 96, 64, 90, 48, 32, 0))
        (model / "images.bin").write_bytes(
            struct.pack("<QI7dI", 1, 1, 1, 0, 0, 0, 0, 0, 0, 1) + b"other\x1b[31m.pgm\0" + struct.pack("<Q", 0))
        (model / "points3D.bin").write_bytes(struct.pack("<Q", 0))
        colmap = tools / "colmap"
        colmap.write_text(f"""#!/bin/sh
[ "$1" = mapper ] || exit 0
while [ "$1" != --output_path ]; do shift; done
cp -r {model} "$2/0"
""")
        colmap.chmod(0o755)
        line = self.refusal("--frame-side", 56, status=8, env={"PATH": f"{tools}:{os.environ['PATH']}"})
        self.assertIn(r'"other\x1b[31m.pgm"', line)
        self.assertIn("colmap: expected each of the 24 photos", line)

    def test_a_video_without_frames(self):
        (self.root / "broken.mp4").write_bytes(b"nothing")
        self.assertIn("broken.mp4", self.refusal(status=3, after="broken.mp4"))

    def test_two_places_or_no_overlap_of_the_epochs(self):
        if not shutil.which("colmap"):
            self.skipTest("no COLMAP")
        for scene in ("kitchen", "courtyard"):
            done = run("synthesize", self.root / scene, "--scene", scene, "--frames", "6", "--width", "168", "--no-wat")
            self.assertEqual(done.returncode, 0, done.stderr)
        line = self.refusal("--frame-side", "168", status=5, before="kitchen/before", after="courtyard/after")
        self.assertIn("are these two sets of the same place, with overlapping views?", line)

    def prediction(self, name, **arrays):
        poses = np.tile(np.eye(4)[:3], (4, 1, 1))
        intrinsic = np.tile(np.array([[80.0, 0, 48], [0, 80, 32], [0, 0, 1]]), (4, 1, 1))
        depth = np.ones((4, 64, 96), "f4")
        np.savez(self.root / name, extrinsic=poses, intrinsic=intrinsic, depth=depth, depth_conf=depth, **arrays)

    def test_a_prediction_without_images_on_one_side(self):
        self.prediction("after.npz")
        self.assertIn("expected images in the prediction file", self.refusal(status=3, after="after.npz"))

    def test_a_prediction_of_nothing_that_the_photos_show(self):
        if not shutil.which("colmap"):
            self.skipTest("no COLMAP")
        noise = np.random.default_rng(1).integers(0, 256, (4, 64, 96, 3), "u1")
        self.prediction("after.npz", images=noise)
        self.assertIn("no two of the 8 photos", self.refusal(status=5, after="after.npz"))

    def test_a_photo_that_is_none_is_named(self):
        (self.root / "after" / "3.jpg").write_text("<html>404</html>")
        self.assertIn("3.jpg: not a readable photo: found a web page", self.refusal(status=3))

    def test_a_second_run_into_the_same_directory_waits_its_turn(self):
        stages = self.root / "out" / ".stages"
        stages.mkdir(parents=True)
        (self.root / "out" / ".vggt-cd-results").write_text("")
        with open(stages / "lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.assertIn("another vggt-cd is working there", self.refusal(status=6))

    def test_joint_is_for_predictions(self):
        self.assertIn("leave the option out", self.refusal("--joint", "x.npz", status=2))

    def test_a_dry_run_says_what_is_wrong_with_the_photos(self):
        write_photo(self.root / "after" / "3.ppm", 20, width=64, height=96)
        line = self.refusal("--dry-run", status=3)
        self.assertIn("after/3.ppm is portrait and before/0.ppm is landscape; expected photos of one orientation: turn", line)
        (self.root / "after" / "3.ppm").write_bytes(b"P6 96 64 255\n")
        self.assertIn("3.ppm: not a readable photo", self.refusal("--dry-run", status=3))
        self.assertFalse((self.root / "out").exists())

    def test_a_line_is_one_line_and_acts_on_no_terminal_whatever_names_hold(self):
        names = (b"y\nvggt-cd: all is well.ppm", b"x\033]0;title\007\033[2J.ppm", b"caf\351.ppm", "é.ppm".encode())
        photo = (self.root / "after" / "3.ppm").read_bytes()
        for name in names:
            path = os.path.join(os.fsencode(self.root / "after"), name)
            for content in (photo, photo[:200]):  # the same as another one, then cut off
                with open(path, "wb") as file:
                    file.write(content)
                done = run_bytes("detect", self.root / "before", self.root / "after", "-o", self.root / "out", "--dry-run")
                self.assertEqual(done.returncode, 0 if content == photo else 3, done.stderr)
                self.assertEqual(re.findall(rb"[\x00-\x09\x0b-\x1f\x7f]", done.stdout + done.stderr), [])
                for line in done.stderr.decode().splitlines():  # raises where a byte is not UTF-8
                    self.assertRegex(line, "^(vggt-cd|note|read photos): ")
                    self.assertNotRegex(line, "^vggt-cd: all")
            os.remove(path)

    def test_what_decoders_say_is_told_by_the_program_once_for_each_photo(self):
        subprocess.run([PROGRAM, "synthesize", self.root / "scene", "--frames", "4", "--width", "112", "--no-wat"],
                       check=True, capture_output=True)
        jpeg = (self.root / "scene" / "before" / "0001.jpg").read_bytes()
        (self.root / "scene" / "before" / "0001.jpg").write_bytes(jpeg[:len(jpeg) // 2] + b"\xff\xd9")
        for arguments in (("--progress", "json"), ("--progress", "plain")):
            done = run("detect", self.root / "scene/before", self.root / "scene/after", "-o", self.root / "out",
                       "--dry-run", *arguments)
            self.assertEqual(done.returncode, 0, done.stderr)
            lines = done.stderr.splitlines()
            if "json" in arguments:
                lines = [json.loads(line).get("message", "") for line in lines]
            about = [line for line in lines if "0001.jpg" in line]
            self.assertEqual(len(about), 1, done.stderr)
            self.assertRegex(about[0], "before/0001.jpg: part of the picture is damaged or missing")
            self.assertNotIn("Corrupt", done.stderr)

    def test_odd_sizes(self):
        self.assertIn("multiple of 14", self.refusal("--frame-side", "150", status=2))


class DryRun(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.temporary.name)

    def tearDown(self):
        self.temporary.cleanup()

    def plan(self, before, after, *arguments):
        done = run("detect", before, after, "-o", self.root / "out", "--dry-run", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertFalse((self.root / "out").exists())
        seconds = re.search(r"Time: about (\d+) (s|min)", done.stdout)
        return done.stdout, int(seconds[1]) * (60 if seconds[2] == "min" else 1)

    def test_says_frames_sizes_memory_and_time_that_grow_with_the_photos(self):
        for i in range(24):
            write_photo(self.root / "all" / f"{i}.ppm", i + 1)
        after = self.root / "all"
        for i in range(4):
            write_photo(self.root / "before" / f"{i}.ppm", 100 + i)
        text, few = self.plan(self.root / "before", after, "--frames", "4")
        self.assertIn("4 before, 4 after, 8 in the joint", text)
        self.assertIn("518 x 350 px", text)
        self.assertRegex(text, r"Memory: about \d+\.\d GB \(\d+\.\d GB available\)")
        text, many = self.plan(self.root / "before", after)
        self.assertIn("4 before, 24 after, 9 in the joint", text)
        self.assertGreater(many, 3 * few)

    def test_predictions_are_planned_from_their_headers(self):
        poses = np.tile(np.eye(4)[:3], (5, 1, 1))
        intrinsic = np.tile(np.array([[80.0, 0, 48], [0, 80, 32], [0, 0, 1]]), (5, 1, 1))
        for name, frames in (("t1", 3), ("t2", 5)):
            depth = np.ones((frames, 64, 96), "f4")
            np.savez(self.root / f"{name}.npz", extrinsic=poses[:frames], intrinsic=intrinsic[:frames], depth=depth,
                     depth_conf=depth)
        text, _ = self.plan(self.root / "t1.npz", self.root / "t2.npz", "--aligned")
        self.assertIn("3 frames before, 5 after", text)
        self.assertIn("96 x 64 px before, 96 x 64 px after", text)
        self.assertRegex(text, r"Memory: about \d+\.\d GB")

    def test_masks_and_second_formats_are_not_counted(self):
        for i in range(4):
            write_photo(self.root / "before" / f"{i}.ppm", i + 1)
            write_photo(self.root / "before" / f"{i}_mask.ppm", i + 31)
            write_photo(self.root / "after" / f"{i}.ppm", i + 11)
            ppm = (self.root / "after" / f"{i}.ppm").read_bytes()
            (self.root / "after" / f"{i}.pgm").write_bytes(b"P6 96 64 255 " + ppm[-96 * 64 * 3:])  # told by content
        text, _ = self.plan(self.root / "before", self.root / "after")
        self.assertIn("4 before, 4 after", text)

    def test_memory_counts_what_decoding_takes(self):
        def planned(width, height):
            for epoch in ("before", "after"):
                for i in range(4):
                    write_photo(self.root / epoch / f"{i}.ppm", i + 1 + 10 * (epoch == "after"))
            (self.root / "before" / "large.ppm").write_bytes(
                b"P6 %d %d 255\n" % (width, height) + bytes(width * height * 3))
            text, _ = self.plan(self.root / "before", self.root / "after", "--frame-side", "98", "--threads", "1")
            return float(re.search(r"Memory: about (\d+\.\d) GB", text)[1])
        self.assertLess(planned(96, 64), 0.5)
        self.assertGreater(planned(6000, 5000), 0.6)  # 11 bytes a pixel and what is there anyway

    def test_a_video_beside_a_folder(self):
        for i in range(12):
            write_photo(self.root / "frames" / f"{i:02}.ppm", i + 1)
        video = self.root / "walk.avi"
        made = subprocess.run([TEST_MEDIA, "video", video, *sorted((self.root / "frames").iterdir())])
        if made.returncode == 77:
            self.skipTest("OpenCV cannot write videos here")
        self.assertEqual(made.returncode, 0)
        text, _ = self.plan(video, self.root / "frames", "--frames", "5")
        self.assertIn("5 before, 5 after", text)

    def test_heic_beside_ppm(self):
        for i in range(4):
            write_photo(self.root / "before" / f"{i}.ppm", i + 1)
            write_photo(self.root / "other" / f"{i}.ppm", i + 11)
            made = subprocess.run([TEST_MEDIA, "heic", self.root / f"{i}.heic", self.root / "other" / f"{i}.ppm"])
            if made.returncode == 77:
                self.skipTest("libheif or its encoder is not here")
            self.assertEqual(made.returncode, 0)
        text, _ = self.plan(self.root / "*.heic", self.root / "before")  # the first photo gives the size
        self.assertIn("4 before, 4 after", text)
        self.assertIn("518 x 350 px", text)


if __name__ == "__main__":
    unittest.main()
