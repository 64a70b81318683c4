#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""detect on photos with a network: its three passes, end to end. The weights are a recipe's, so the geometry means
nothing; the plumbing does.

Usage: network_test.py PROGRAM RECIPE_WEIGHTS tiny|vggt_1b [unittest arguments]
"""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from running import HANG_S, signal_at

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
RECIPE_WEIGHTS = pathlib.Path(sys.argv.pop(1)).resolve()
NETWORK = sys.argv.pop(1)
SIDE = 168
NEEDED_BYTES = {"tiny": 0, "vggt_1b": 8_500_000_000}[NETWORK]  # 4.8 GB of them are the mapped file's pages


def run(*arguments):
    environment = {**os.environ, "VGGTCD_WEIGHTS": "", "HOME": "/nonexistent"}
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=HANG_S, env=environment)


def available_bytes():
    for line in pathlib.Path("/proc/meminfo").read_text().splitlines():
        if line.startswith("MemAvailable:"):
            return 1024 * int(line.split()[1])
    return 0


class Network(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if available_bytes() < NEEDED_BYTES:
            raise unittest.SkipTest(f"needs {NEEDED_BYTES} bytes of memory")
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        if shutil.disk_usage(cls.root).free < NEEDED_BYTES:
            cls.temporary.cleanup()
            raise unittest.SkipTest(f"needs {NEEDED_BYTES} bytes in {cls.root.parent}")
        cls.weights = cls.root / "weights.safetensors"
        subprocess.run([RECIPE_WEIGHTS, NETWORK, "7", cls.weights], check=True)
        cls.scene = cls.root / "kitchen"
        done = run("synthesize", cls.scene, "--scene", "kitchen", "--frames", "4", "--width", SIDE, "--no-wat")
        assert done.returncode == 0, done.stderr
        for folder in ("before", "after"):
            (cls.scene / folder / "0003.jpg").unlink()
        cls.options = ("--weights", cls.weights, "--keyframes", "2", "--frame-side", SIDE, "--accept-alignment")
        cls.out = cls.root / "out"
        cls.done = run("detect", cls.scene / "before", cls.scene / "after", "-o", cls.out, *cls.options,
                       "--progress", "json")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def stages(self, done):
        return [e["stage"] for e in map(json.loads, done.stderr.splitlines()) if e["event"] == "stage_finished"]

    def kept(self, out):
        (folder,) = (out / ".stages").glob("vggt-*")
        return folder

    def test_epochs_that_do_not_fit_together_are_refused_with_a_question(self):
        options = [option for option in self.options if option != "--accept-alignment"]
        done = run("detect", self.scene / "before", self.scene / "after", "-o", self.out, *options)
        self.assertEqual(done.returncode, 9, done.stderr)
        self.assertIn("do both sets of photos show one place", done.stderr)
        self.assertTrue((self.out / "report.html").exists())  # the results of before are still there

    def test_three_passes_and_all_results(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr)
        stages = self.stages(self.done)
        self.assertEqual(stages.count("weights"), 1)
        for one in ("before", "after", "joint"):
            self.assertEqual([s for s in stages if s.startswith(one + ": ")].count(one + ": cameras"), 1)
        self.assertIn("Reconstructed by VGGT: 3 photos before, 3 photos after, 2 + 2 keyframes.", self.done.stdout)
        for name in ("report.html", "before_aligned.ply", "after.ply", "change.npz", "sim3.json", "summary.json",
                     "cameras_before.tum", "cameras_after.tum", "colmap/images.txt", "overlays/before/0000.png",
                     "overlays/after/0002.png"):
            self.assertTrue((self.out / name).is_file(), name)
        change = np.load(self.out / "change.npz")
        for epoch in ("t1", "t2"):
            score = change[f"score_{epoch}"]
            self.assertEqual(score.shape, (3, 126, SIDE))
            self.assertGreater(np.isfinite(score).mean(), 0.3)  # half are above the median confidence
        summary = json.loads((self.out / "summary.json").read_text())
        self.assertEqual(summary["inputs"]["joint"]["keyframes_t1"], [0, 2])
        self.assertEqual(summary["alignment"]["initial_source"], "joint pass")
        self.assertIn("label_t1", change.files)

    def test_each_pass_is_the_one_that_reconstruct_makes(self):
        kept = self.kept(self.out)
        self.assertEqual(sorted(p.name for p in kept.iterdir()),
                         [".kept", "after.npz", "before.npz", "joint.npz", "reconstruction.json"])
        before, joint = np.load(kept / "before.npz"), np.load(kept / "joint.npz")
        self.assertEqual(before["depth"].shape, (3, 126, SIDE, 1))
        self.assertEqual(joint["depth"].shape, (4, 126, SIDE, 1))
        self.assertEqual(list(joint["names"]), ["0000.jpg", "0002.jpg", "0000.jpg", "0002.jpg"])
        np.testing.assert_array_equal(joint["images"][1], before["images"][2])
        images = before["images"].transpose(0, 3, 1, 2).astype("f4") / 255
        np.savez(self.root / "images.npz", images=images)
        out = self.root / "reconstruct.npz"
        done = run("reconstruct", self.root / "images.npz", "-o", out, "--weights", self.weights)
        self.assertEqual(done.returncode, 0, done.stderr)
        alone = np.load(out)
        np.testing.assert_array_equal(alone["depth"], before["depth"])
        np.testing.assert_allclose(alone["extrinsic"], before["extrinsic"], atol=1e-6)  # f32 there, f64 here

    def test_a_pass_that_is_there_is_not_made_again(self):
        out = self.root / "interrupted"
        shutil.copytree(self.out, out)
        for name in ("joint.npz", "reconstruction.json"):
            (self.kept(out) / name).unlink()
        done = run("detect", self.scene / "before", self.scene / "after", "-o", out, *self.options,
                   "--progress", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        stages = self.stages(done)
        self.assertIn("joint: cameras", stages)
        self.assertFalse([s for s in stages if s.startswith("before: ") or s.startswith("after: ")])
        for name in ("change.npz", "sim3.json", "after.ply"):
            self.assertEqual((out / name).read_bytes(), (self.out / name).read_bytes(), name)
        done = run("detect", self.scene / "before", self.scene / "after", "-o", out, *self.options,
                   "--progress", "json")
        self.assertNotIn("weights", self.stages(done))

    def test_a_prediction_on_one_side_takes_part_in_the_joint_pass(self):
        given = self.kept(self.out) / "before.npz"
        out = self.root / "given"
        done = run("detect", given, self.scene / "after", "-o", out, *self.options, "--progress", "json")
        self.assertEqual(done.returncode, 0, done.stderr)
        stages = self.stages(done)
        self.assertFalse([s for s in stages if s.startswith("before: ")])
        self.assertIn("after: cameras", stages)
        kept = self.kept(out)
        self.assertFalse((kept / "before.npz").exists())
        # The same images: the same passes, whoever gave the first one.
        for name in ("after.npz", "joint.npz"):
            self.assertEqual((kept / name).read_bytes(), (self.kept(self.out) / name).read_bytes(), name)
        self.assertEqual((out / "sim3.json").read_bytes(), (self.out / "sim3.json").read_bytes())

    def test_a_prediction_of_an_odd_size_is_refused_with_the_remedy(self):
        size = (60, 90)
        poses = np.tile(np.eye(4)[:3], (3, 1, 1))
        intrinsic = np.tile(np.array([[80.0, 0, 45], [0, 80, 30], [0, 0, 1]]), (3, 1, 1))
        depth = np.ones((3, *size), "f4")
        images = np.random.default_rng(1).integers(0, 256, (3, *size, 3), "u1")
        np.savez(self.root / "odd.npz", extrinsic=poses, intrinsic=intrinsic, depth=depth, depth_conf=depth,
                 images=images)
        done = run("detect", self.root / "odd.npz", self.scene / "after", "-o", self.root / "odd", *self.options)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("multiples of 14", done.stderr)

    def test_the_plan_names_passes_and_memory(self):
        done = run("detect", self.scene / "before", self.scene / "after", "-o", self.root / "plan", *self.options,
                   "--dry-run")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"vggt: \d+\.\d TFLOP in 3 passes")
        self.assertIn(f"{SIDE} x 126 px", done.stdout)
        self.assertFalse((self.root / "plan").exists())

    def test_interrupted_by_ctrl_c_it_says_so(self):
        out = self.root / "ctrl_c"
        arguments = [PROGRAM, "detect", self.scene / "before", self.scene / "after", "-o", out, *self.options]
        _, others, status = signal_at(
            arguments, lambda e: e["event"] == "stage_finished" and e["stage"] == "read photos", signal.SIGINT)
        self.assertEqual((status, others), (130, ["vggt-cd: interrupted\n"]))
        self.assertFalse((out / "summary.json").exists())


if __name__ == "__main__":
    unittest.main()
