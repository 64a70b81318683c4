#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the program as a user does and reads what it wrote with NumPy, an independent reader.

Usage: cli_test.py PROGRAM EXAMPLE_DIR [unittest arguments]
"""
import csv
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy as np

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
EXAMPLE = pathlib.Path(sys.argv.pop(1)).resolve()


def run(*arguments, **kwargs):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=300, **kwargs)


def read_ply(path):
    """A binary little-endian PLY with one element of scalar properties, as a structured array."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    types = {"float": "<f4", "uchar": "u1", "double": "<f8", "int": "<i4", "uint": "<u4"}
    fields, count = [], 0
    for line in data[:end].decode().splitlines():
        words = line.split()
        if words[0] == "element":
            count = int(words[2])
        elif words[0] == "property":
            fields.append((words[2], types[words[1]]))
    table = np.frombuffer(data, np.dtype(fields), count, end)
    assert len(data) == end + table.nbytes, "PLY has trailing or missing bytes"
    return table


class Detect(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        cls.out = cls.root / "out"
        cls.inputs = ["detect", EXAMPLE / "t1.npz", EXAMPLE / "t2.npz", "--joint", EXAMPLE / "joint.npz"]
        cls.arguments = [*cls.inputs, "--method", "paper"]
        done = run(*cls.arguments, "-o", cls.out)
        assert done.returncode == 0, done.stderr
        cls.stdout = done.stdout

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_names_the_verdict_and_the_files(self):
        self.assertRegex(self.stdout, r"(Refined|Kept)")
        self.assertIn("overlays", self.stdout)

    def test_by_default_the_papers_alignment_and_votes(self):
        out = self.root / "default"
        done = run(*self.inputs, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads((out / "sim3.json").read_text())["scale"],
                         json.loads((self.out / "sim3.json").read_text())["scale"])
        change = np.load(out / "change.npz")
        for epoch, changed_label in (("t1", 1), ("t2", 2)):
            label = change["label_" + epoch]
            np.testing.assert_array_equal(change["changed_" + epoch], label == changed_label)
            self.assertGreater((label == 3).sum(), 0)
        self.assertNotIn("label_t1", np.load(self.out / "change.npz"))

    def test_sim3_maps_the_points_of_t1_onto_the_ply(self):
        sim3 = json.loads((self.out / "sim3.json").read_text())
        rotation = np.array(sim3["rotation"])
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        self.assertAlmostEqual(np.linalg.det(rotation), 1.0, places=12)
        t1 = np.load(EXAMPLE / "t1.npz")
        ply = read_ply(self.out / "before_aligned.ply")
        change = np.load(self.out / "change.npz")
        frame, row, column = np.argwhere(~np.isnan(change["score_t1"]))[0]
        depth = np.squeeze(t1["depth"])[frame, row, column]
        k = t1["intrinsic"][frame]
        ray = np.array([(column - k[0, 2]) / k[0, 0], (row - k[1, 2]) / k[1, 1], 1.0])
        extrinsic = t1["extrinsic"][frame]
        x_t1 = extrinsic[:, :3].T @ (depth * ray - extrinsic[:, 3])
        x_t2 = sim3["scale"] * rotation @ x_t1 + np.array(sim3["translation"])
        first = np.array([ply["x"][0], ply["y"][0], ply["z"][0]])
        np.testing.assert_allclose(first, x_t2, rtol=1e-5, atol=1e-5 * np.abs(x_t2).max())

    def test_change_arrays_agree_with_each_other_and_the_ply(self):
        change = np.load(self.out / "change.npz")
        summary = json.loads((self.out / "summary.json").read_text())
        for epoch, name in (("t1", "before_aligned"), ("t2", "after")):
            score, changed = change[f"score_{epoch}"], change[f"changed_{epoch}"]
            self.assertEqual(score.dtype, np.float32)
            self.assertEqual(changed.dtype, np.bool_)
            evidence = ~np.isnan(score)
            tau = np.float32(summary["change"]["threshold_u"])
            np.testing.assert_array_equal(changed, np.where(evidence, score > tau, False))
            ply = read_ply(self.out / f"{name}.ply")
            self.assertEqual(len(ply), evidence.sum())
            np.testing.assert_array_equal(np.sort(ply["scalar_change_distance"]), np.sort(score[evidence]))
            self.assertEqual(int(ply["scalar_changed"].sum()), int(changed.sum()))

    def test_changed_things_agree_with_their_pixels(self):
        things = json.loads((self.out / "changes.json").read_text())["changes"]
        change = np.load(self.out / "change.npz")
        self.assertGreater(len(things), 2)
        for number, thing in enumerate(things, 1):
            self.assertEqual(thing["id"], number)
            self.assertIn(thing["class"], ["added", "removed", "moved"])
            for part, epoch in (("before", "t1"), ("after", "t2")):
                pixels = change[f"instance_{epoch}"] == number
                self.assertEqual(pixels.sum(), thing[part]["pixels"] if part in thing else 0)
                self.assertTrue(change[f"changed_{epoch}"][pixels].all())
                for photo in thing.get(part, {}).get("photos", []):
                    self.assertEqual(pixels[photo["frame"]].sum(), photo["pixels"])
        ranks = [thing["volume_u3"] * thing["confidence"] for thing in things]
        self.assertEqual(ranks, sorted(ranks, reverse=True))
        with open(self.out / "changes.csv", newline="") as table:
            rows = list(csv.DictReader(table))
        self.assertEqual([float(row["volume_u3"]) for row in rows], [t["volume_u3"] for t in things])

    def test_every_photo_has_an_overlay(self):
        frames = np.load(EXAMPLE / "t1.npz")["depth"].shape[0]
        pictures = sorted((self.out / "overlays" / "before").glob("*.png"))
        self.assertEqual(len(pictures), frames)
        self.assertEqual(pictures[0].read_bytes()[:8], b"\x89PNG\r\n\x1a\n")

    def test_trajectories_have_one_line_per_photo(self):
        for name, epoch in (("before", "t1"), ("after", "t2")):
            table = np.loadtxt(self.out / f"cameras_{name}.tum")
            frames = np.load(EXAMPLE / f"{epoch}.npz")["depth"].shape[0]
            self.assertEqual(table.shape, (frames, 8))
            np.testing.assert_allclose(np.linalg.norm(table[:, 4:], axis=1), 1.0, atol=1e-6)
        # T2 is the common frame: its camera centres are those of the input.
        extrinsic = np.load(EXAMPLE / "t2.npz")["extrinsic"][:, :3]
        centers = -np.einsum("nji,nj->ni", extrinsic[:, :, :3], extrinsic[:, :, 3])
        np.testing.assert_allclose(table[:, 1:4], centers, atol=1e-5)

    def test_summary_says_what_was_done(self):
        summary = json.loads((self.out / "summary.json").read_text())
        self.assertEqual(summary["options"]["alignment"]["method"], "paper")
        self.assertIn(summary["alignment"]["verdict"],
                      ["refined", "kept_coarse_residual", "kept_coarse_few_static"])
        for stage in summary["stages"]:
            self.assertGreaterEqual(stage["seconds"], 0)
            self.assertGreater(stage["peak_memory_bytes"], 0)

    def test_same_bytes_for_any_number_of_threads(self):
        other = self.root / "one_thread"
        self.assertEqual(run(*self.arguments, "-o", other, "--threads", "1").returncode, 0)
        for path in sorted(p for p in self.out.rglob("*") if p.is_file()):
            if path.name in ("summary.json", "report.html"):  # they hold times
                continue
            twin = other / path.relative_to(self.out)
            self.assertEqual(path.read_bytes(), twin.read_bytes(), path.name)

    def test_aligned_epochs_need_no_joint_pass(self):
        out = self.root / "aligned"
        done = run("detect", EXAMPLE / "t1.npz", EXAMPLE / "t1.npz", "--aligned", "--method", "coarse", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        change = np.load(out / "change.npz")
        self.assertEqual(np.nanmax(change["score_t1"]), 0)
        self.assertFalse(change["changed_t2"].any())

    def test_votes_give_labels_that_decide(self):
        out = self.root / "votes"
        done = run(*self.arguments, "--change-method", "free_space", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("Not seen by the other epoch", done.stdout)
        change = np.load(out / "change.npz")
        truth = np.load(EXAMPLE / "truth.npz")
        for epoch, code, name in (("t1", 1, "before_aligned"), ("t2", 2, "after")):
            label, changed = change[f"label_{epoch}"], change[f"changed_{epoch}"]
            self.assertTrue(set(np.unique(label)) <= {0, code, 3, 255})
            np.testing.assert_array_equal(changed, label == code)
            judged = (label == 0) | (label == code)
            for name_of in ("gap", "evidence", "confidence", "level_of_detection"):
                np.testing.assert_array_equal(np.isfinite(change[f"{name_of}_{epoch}"]), judged)
            ply = read_ply(out / f"{name}.ply")
            np.testing.assert_array_equal(ply["scalar_label"] == code, ply["scalar_changed"] == 1)
            # Few alarms: the paper's distance calls most of this surface changed.
            unseen = truth[f"unseen_by_other_{epoch}"] & (truth[f"changed_{epoch}"] == 0) & (label != 255)
            self.assertLess(changed[unseen].mean(), 0.1)

    def test_initial_sim3_is_read_back(self):
        out = self.root / "given"
        done = run("register", EXAMPLE / "t1.npz", EXAMPLE / "t2.npz", "--initial-sim3", self.out / "sim3.json",
                   "--method", "coarse", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        given = json.loads((self.out / "sim3.json").read_text())
        kept = json.loads((out / "sim3.json").read_text())
        for key in ("scale", "rotation", "translation"):
            np.testing.assert_allclose(given[key], kept[key], rtol=1e-14, atol=1e-14)

    def test_authors_layout_has_their_shapes(self):
        out = self.root / "authors"
        done = run("register", *self.arguments[1:], "-o", out, "--authors-layout")
        self.assertEqual(done.returncode, 0, done.stderr)
        fine = np.load(out / "fine_sim3.npz")
        self.assertEqual((fine["s"].shape, fine["R"].shape, fine["t"].shape), ((), (3, 3), (3,)))
        poses = np.load(out / "pred_poses_t1.npy")
        np.testing.assert_allclose(poses[:, :3], np.load(EXAMPLE / "t1.npz")["extrinsic"], atol=1e-7)
        np.testing.assert_array_equal(poses[:, 3], np.tile([0, 0, 0, 1], (len(poses), 1)))
        self.assertIn("coarse", json.loads((out / "timing.json").read_text()))

    # --- bad input: one line, a distinct status, nothing left behind ---

    def expect_failure(self, status, words, *arguments):
        out = self.root / "bad"
        done = run(*arguments, "-o", out)
        self.assertEqual(done.returncode, status, done.stderr)
        lines = [line for line in done.stderr.splitlines() if line.startswith("vggt-cd:")]
        self.assertEqual(len(lines), 1, done.stderr)
        for word in words:
            self.assertIn(word, lines[0])
        self.assertFalse(out.exists())
        leftovers = [p.name for p in self.root.iterdir() if "bad" in p.name]
        self.assertEqual(leftovers, [])

    def test_missing_file(self):
        self.expect_failure(3, ["nowhere.npz"], "detect", self.root / "nowhere.npz", EXAMPLE / "t2.npz", "--aligned")

    def test_truncated_file(self):
        whole = (EXAMPLE / "t1.npz").read_bytes()
        broken = self.root / "truncated.npz"
        broken.write_bytes(whole[: len(whole) // 2])
        self.expect_failure(3, ["truncated.npz"], "detect", broken, EXAMPLE / "t2.npz", "--aligned")

    def test_nothing_brings_the_epochs_together(self):
        self.expect_failure(2, ["--joint", "--aligned"], "detect", EXAMPLE / "t1.npz", EXAMPLE / "t2.npz")

    def test_out_of_range_option(self):
        self.expect_failure(2, ["--static-factor: expected"], *self.arguments, "--static-factor", "-1")

    # --- alignments that nobody would want the changes of ---

    def joint_with(self, name, **changed):
        arrays = dict(np.load(EXAMPLE / "joint.npz"))
        arrays.update(changed)
        np.savez(self.root / name, **arrays)
        return self.root / name

    def sim3_with(self, name, **changed):
        sim3 = json.loads((self.out / "sim3.json").read_text())
        sim3.update({key: change(sim3[key]) for key, change in changed.items()})
        (self.root / name).write_text(json.dumps(sim3))
        return self.root / name

    def test_reversed_keyframes_are_refused(self):
        joint = np.load(EXAMPLE / "joint.npz")
        path = self.joint_with("reversed.npz", keyframes_t1=joint["keyframes_t1"][::-1])
        self.expect_failure(9, ["before epoch", "--accept-alignment"], "detect", EXAMPLE / "t1.npz",
                            EXAMPLE / "t2.npz", "--joint", path)

    def test_a_wrong_similarity_is_refused_unless_accepted(self):
        path = self.sim3_with("thrice.json", scale=lambda scale: 3 * scale)
        arguments = ("register", EXAMPLE / "t1.npz", EXAMPLE / "t2.npz", "--initial-sim3", path)
        self.expect_failure(9, ["--accept-alignment"], *arguments)
        out = self.root / "accepted"
        done = run(*arguments, "--accept-alignment", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        verdict = json.loads((out / "summary.json").read_text())["alignment"]["plausibility"]
        self.assertIn(verdict["verdict"], ("surfaces_disagree", "no_overlap"))

    def test_frames_that_are_not_common_are_refused(self):
        self.expect_failure(9, ["--joint"], "detect", EXAMPLE / "t1.npz", EXAMPLE / "t2.npz", "--aligned")

    def test_unwritable_output(self):
        done = run(*self.arguments, "-o", "/proc/nowhere/out")
        self.assertEqual(done.returncode, 6, done.stderr)
        self.assertIn("/proc/nowhere", done.stderr)

    def test_full_disk(self):
        if os.geteuid() != 0 or not os.path.exists("/bin/mount"):
            self.skipTest("needs root to mount a small file system")
        small = self.root / "small"
        small.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", small], capture_output=True)
        if mounted.returncode != 0:
            self.skipTest("cannot mount a small file system")
        try:
            done = run(*self.arguments, "-o", small / "out")
            self.assertEqual(done.returncode, 6, done.stderr)
            self.assertEqual(list(small.iterdir()), [])
        finally:
            subprocess.run(["umount", small], check=True)

    def test_interrupt_leaves_nothing(self):
        out = self.root / "interrupted"
        process = subprocess.Popen([PROGRAM, *map(str, self.arguments), "-o", out, "--progress", "plain"],
                                   stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        process.stderr.readline()  # the first stage is done
        process.send_signal(2)
        process.communicate(timeout=60)
        if process.returncode == 0:
            self.skipTest("finished before the interrupt arrived")
        self.assertEqual(process.returncode, 130)
        self.assertEqual([p for p in self.root.iterdir() if "interrupted" in p.name], [])


class Help(unittest.TestCase):
    def test_every_level_explains_itself(self):
        top = run("--help")
        self.assertEqual(top.returncode, 0)
        for command in ("detect", "register"):
            self.assertIn(command, top.stdout)
            help_text = run(command, "--help")
            self.assertEqual(help_text.returncode, 0)
            self.assertIn("Example", help_text.stdout)

    def test_version(self):
        self.assertRegex(run("--version").stdout, r"^vggt-cd \d+\.\d+\.\d+")

    def test_unknown_command_is_a_usage_error(self):
        done = run("dettect")
        self.assertEqual(done.returncode, 2)
        self.assertIn("found dettect", done.stderr)


if __name__ == "__main__":
    unittest.main()
