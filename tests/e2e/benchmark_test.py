#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs `benchmark` as a user does: `--suite wat` on a generated scene in WAT layout, from weights, again, and from
the predictions that the first run kept; and a generated scene, whose figures must be those of `detect`.

Usage: benchmark_test.py PROGRAM RECIPE_WEIGHTS [unittest arguments]
"""
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from running import HANG_S

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
RECIPE_WEIGHTS = pathlib.Path(sys.argv.pop(1)).resolve()
USAGE = 2  # exit status, docs/formats.md


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments), "--progress", "none"], capture_output=True, text=True,
                          timeout=HANG_S)


def registration(out):
    """The table without the seconds, which no two runs share."""
    with open(out / "benchmark.csv", newline="") as file:
        return [{key: value for key, value in row.items() if key != "seconds"} for row in csv.DictReader(file)]


class WatFromWeights(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        cls.weights = cls.root / "tiny.safetensors"
        subprocess.run([RECIPE_WEIGHTS, "tiny", "1", cls.weights], check=True)
        done = run("synthesize", cls.root / "scene", "--scene", "desk", "--seed", 5, "--frames", 4, "--width", 64,
                   "--photo-scale", 2, "--samples", 1)
        assert done.returncode == 0, done.stderr
        cls.data = cls.root / "scene" / "wat"
        cls.out = cls.root / "out"
        cls.arguments = ["benchmark", "--suite", "wat", "--data", cls.data, "--no-rivals", "--keyframes", 2]
        cls.done = run(*cls.arguments, "--weights", cls.weights, "--max-photos", 3, "-o", cls.out)
        cls.predictions = cls.out / "predictions"

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_predicts_from_the_photos_and_reports(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr)
        for name in ["t1.npz", "t2.npz", "joint.npz", "joint_all.npz"]:
            self.assertTrue((self.predictions / "desk" / name).exists(), name)
        with np.load(self.predictions / "desk" / "t1.npz") as arrays:
            self.assertEqual(arrays["depth"].shape[0], 3)  # --max-photos
        rows = {row["method"]: row for row in registration(self.out)}
        for method in ["vggt_only", "coarse", "paper", "robust"]:
            self.assertGreater(float(rows[method]["ate_mean"]), 0)
        for words in ["(paper's)", "Number of keyframes", "GeoTransformer: not yet"]:
            self.assertIn(words, self.done.stdout)

    def test_a_second_run_computes_nothing_and_kept_predictions_give_the_same_numbers(self):
        files = sorted(self.predictions.rglob("*.npz"))
        stamps = [file.stat().st_mtime_ns for file in files]
        # The finished scene goes, its predictions stay.
        shutil.rmtree(self.out / "scenes")
        again = run(*self.arguments, "--weights", self.weights, "--max-photos", 3, "-o", self.out)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual([file.stat().st_mtime_ns for file in files], stamps)
        kept = run(*self.arguments, "--predictions", self.predictions, "-o", self.root / "kept")
        self.assertEqual(kept.returncode, 0, kept.stderr)
        self.assertEqual(registration(self.root / "kept"), registration(self.out))

    def test_says_what_it_needs(self):
        for extra, words in [([], "none"), (["--weights", "a", "--predictions", "b"], "both")]:
            done = run(*self.arguments, *extra, "-o", self.root / "usage")
            self.assertEqual(done.returncode, USAGE)
            self.assertIn(words, done.stderr)


class Generated(unittest.TestCase):
    """What the benchmark measures is what the program does with the files of the same scene."""

    def test_the_figures_are_those_of_detect_and_evaluate(self):
        with tempfile.TemporaryDirectory() as temporary:
            root = pathlib.Path(temporary)
            size = ["--frames", 10, "--width", 96]
            for arguments in [
                ["benchmark", "--scenes", "desk", "--seeds", 5, *size, "--no-rivals", "--no-ablation", "-o", root / "benchmark"],
                ["synthesize", root / "desk", "--scene", "desk", "--seed", 5, *size, "--photo-scale", 1, "--samples", 2,
                 "--no-wat", "--no-photos"],
                ["detect", root / "desk" / "t1.npz", root / "desk" / "t2.npz", "--joint", root / "desk" / "joint.npz",
                 "-o", root / "found", "--no-overlays", "--no-page"],
                ["evaluate", "--change", root / "found", "--truth", root / "desk" / "truth.npz", "-o", root / "scores.json"],
            ]:
                done = run(*arguments)
                self.assertEqual(done.returncode, 0, done.stderr)
            scores = json.loads((root / "scores.json").read_text())
            cameras = {row["method"]: row for row in registration(root / "benchmark")}["robust"]
            with open(root / "benchmark" / "change.csv", newline="") as file:
                change = next(row for row in csv.DictReader(file)
                              if (row["method"], row["alignment"], row["unseen_counted"], row["every_pixel"])
                              == ("votes", "robust", "0", "0"))
        # The files round to f32, which moves a few points over the edges of voxels and gates; another
        # start of the refinement, or another ranking, moves the figures by a tenth or more.
        self.assertAlmostEqual(scores["ate_mean"] / float(cameras["ate_mean"]), 1, delta=0.02)
        for ours, theirs in [("f1", "f1"), ("auprc", "auprc"), ("precision", "precision"), ("recall", "recall")]:
            self.assertAlmostEqual(scores["evidence"][ours], float(change[theirs]), delta=0.02)
        self.assertAlmostEqual(scores["evidence_share"], float(change["evidence"]), delta=0.005)


if __name__ == "__main__":
    unittest.main(verbosity=2)
