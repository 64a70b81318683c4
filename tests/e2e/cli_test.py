#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the program as a user does and reads what it wrote with NumPy, an independent reader.

Usage: cli_test.py PROGRAM EXAMPLE_DIR [unittest arguments]
"""
import csv
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile

import numpy as np

from running import HANG_S, signal_at

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
EXAMPLE = pathlib.Path(sys.argv.pop(1)).resolve()


def run(*arguments, **kwargs):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=HANG_S,
                          errors="surrogateescape", **kwargs)


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

    def test_by_default_the_robust_alignment_and_votes(self):
        out = self.root / "default"
        done = run(*self.inputs, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        sim3 = json.loads((out / "sim3.json").read_text())
        self.assertEqual(sim3["chosen"], "robust")
        self.assertEqual(sim3["scale"], sim3["robust"]["scale"])
        # Cameras and surfaces have a similarity each; with one method that has one, it is the same.
        self.assertNotEqual(sim3["surfaces"]["translation"], sim3["translation"])
        paper = json.loads((self.out / "sim3.json").read_text())
        self.assertEqual(paper["surfaces"]["translation"], paper["translation"])
        # The coarse stage is the paper's in either case.
        self.assertEqual(sim3["coarse"]["scale"],
                         json.loads((self.out / "sim3.json").read_text())["coarse"]["scale"])
        alignment = json.loads((out / "summary.json").read_text())["alignment"]
        robust = alignment["robust"]
        self.assertIn(robust["compared_by"], ("tie_points", "surfaces"))
        self.assertLessEqual(robust["ties_used"], robust["ties"])
        costs = {candidate["name"]: candidate["cost"] for candidate in alignment["candidates"]}
        self.assertEqual(min(costs, key=costs.get), "robust")
        change = np.load(out / "change.npz")
        for epoch, changed_label in (("t1", 1), ("t2", 2)):
            label = change["label_" + epoch]
            np.testing.assert_array_equal(change["changed_" + epoch], label == changed_label)
            self.assertGreater((label == 3).sum(), 0)
        self.assertNotIn("label_t1", np.load(self.out / "change.npz"))

    def test_the_sky_is_no_surface_and_nothing_changes_there(self):
        scene, out = self.root / "sky", self.root / "sky_results"
        self.assertEqual(run("synthesize", scene, "--scene", "barbecue", "--seed", "3", "--frames", "8", "--width", "160",
                             "--photo-scale", "1", "--samples", "1", "--no-photos", "--no-wat").returncode, 0)
        done = run("detect", scene / "t1.npz", scene / "t2.npz", "--joint", scene / "joint.npz", "-o", out, "--no-page",
                   "--no-overlays")
        self.assertEqual(done.returncode, 0, done.stderr)
        inputs = json.loads((out / "summary.json").read_text())["inputs"]
        change, truth = np.load(out / "change.npz"), np.load(scene / "truth.npz")
        for epoch, name in (("t1", "before"), ("t2", "after")):
            sky = truth["instance_" + epoch] == 0
            self.assertGreater(sky.mean(), 0.02)
            self.assertAlmostEqual(inputs[name]["sky_share"], sky.mean(), delta=0.02)
            self.assertLess(change["changed_" + epoch][sky].mean(), 0.01)
            self.assertGreater((change["label_" + epoch][sky] == 255).mean(), 0.95)

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

    def test_json_lines_tell_the_time_and_memory_of_each_stage(self):
        done = run(*self.arguments, "-o", self.root / "told", "--progress", "json")
        finished = [e for e in map(json.loads, done.stderr.splitlines()) if e["event"] == "stage_finished"]
        self.assertGreater(len(finished), 3)
        for stage in finished:
            self.assertGreaterEqual(stage["seconds"], 0)
            self.assertGreater(stage["peak_memory_bytes"], 0)

    def test_same_bytes_for_any_number_of_threads(self):
        other = self.root / "one_thread"
        self.assertEqual(run(*self.arguments, "-o", other, "--threads", "1").returncode, 0)
        for path in sorted(p for p in self.out.rglob("*") if p.is_file()):
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

    def test_register_sends_photos_to_detect(self):
        self.expect_failure(2, ["photos", "prediction files (.npz)", "are for detect"], "register", self.root / "photos",
                            EXAMPLE / "t2.npz")

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

    # --- what the program did not write stays ---

    def tree(self, root):
        return {str(p.relative_to(root)): p.read_bytes() for p in root.rglob("*") if p.is_file()}

    def refused(self, words, *arguments):
        before = self.tree(self.root)
        done = run(*arguments, "--progress", "plain")
        self.assertEqual(done.returncode, 6, done.stderr)
        self.assertIn(words, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)  # no stage was run
        self.assertEqual(self.tree(self.root), before)

    def test_an_output_that_stands_on_an_input_is_refused_before_any_work(self):
        site = self.root / "site"
        shutil.copytree(self.out, site)
        for name in ("t1.npz", "t2.npz", "joint.npz"):
            shutil.copy(EXAMPLE / name, site / name)
        t1, t2, joint = (site / name for name in ("t1.npz", "t2.npz", "joint.npz"))
        far = [EXAMPLE / "t1.npz", EXAMPLE / "t2.npz"]
        for command in ("detect", "register"):
            self.refused("it holds the input", command, t1, EXAMPLE / "t2.npz", "--joint", EXAMPLE / "joint.npz", "-o", site)
            self.refused("it holds the input", command, *far, "--joint", joint, "-o", site)
            self.refused("it holds the input", command, *far, "--initial-sim3", site / "sim3.json", "-o", site)
            self.refused("it holds the input", command, *far, "--joint", EXAMPLE / "joint.npz", "--reference",
                         site / "colmap", "-o", site)
        self.refused("it holds the input", "detect", *far, "--joint", joint, "--dry-run", "-o", site)
        photos = self.root / "photos_apart"
        photos.mkdir()
        for name in ("a.jpg", "b.jpg"):
            (photos / name).write_bytes(b"not read")
        self.refused("it lies in the input", "detect", photos, t2, "-o", photos / "out")
        self.refused("it is the input", "detect", photos, t2, "-o", photos)
        self.refused("it lies in the input", "benchmark", "--suite", "wat", "--data", photos, "--predictions", site, "-o",
                     photos / "out")
        self.refused("it holds the input", "benchmark", "--suite", "wat", "--data", photos, "--predictions", t1, "-o", site)
        weights = self.root / "weights.safetensors"
        weights.write_bytes(b"not read")
        self.refused("it is the input", "weights", "convert", weights, "-o", weights)
        self.refused("it is the input", "reconstruct", t1, "-o", t1)
        self.refused("it is the input", "reconstruct", photos / "*.jpg", "-o", photos / "a.jpg")
        self.refused("it lies in the input", "reconstruct", photos, "-o", photos / "a.jpg")
        self.refused("it is the input", "reconstruct", t1, "--weights", weights, "-o", weights)
        tum = site / "cameras_before.tum"
        self.refused("it is the input", "evaluate", tum, tum, "--truth-before", tum, "--truth-after", tum, "-o", tum)
        self.refused("it is one of the results", "evaluate", "--change", site, "--truth", EXAMPLE / "truth.npz", "-o",
                     site / "summary.json")
        self.refused("it is one of the results", "view", site, "-o", site / "after.ply")

    def test_foreign_files_stay_and_what_stands_in_the_way_is_named(self):
        site = self.root / "foreign"
        shutil.copytree(self.out, site)
        (site / "notes.txt").write_text("2.40 m")
        (site / "overlays" / "before" / "mine.png").write_text("drawn")
        done = run(*self.inputs, "--method", "coarse", "--no-page", "-o", site)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((site / "notes.txt").read_text(), "2.40 m")
        self.assertEqual((site / "overlays" / "before" / "mine.png").read_text(), "drawn")
        self.assertFalse((site / "report.html").exists())  # of the first run, and not of this one
        with open(site / "after.ply", "ab") as cloud:
            cloud.write(b"edited")
        self.refused("after.ply: stands where results go, and is not as vggt-cd wrote it there; move it away",
                     *self.inputs, "-o", site)
        self.refused('it holds what vggt-cd lists there as "results", expected "scene"', "synthesize", site, "--frames", "3")

    def test_view_replaces_its_own_page_only(self):
        site = self.root / "viewed"
        shutil.copytree(self.out, site)
        done = run("view", site, "--max-points", "1000")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotEqual((site / "report.html").read_bytes(), (self.out / "report.html").read_bytes())
        self.assertEqual(run(*self.arguments, "-o", site).returncode, 0)  # the page is still one of the results
        (site / "report.html").write_text("mine")
        self.refused("report.html: stands where results go", "view", site)
        self.assertEqual(run("view", site, "-o", site / "small.html").returncode, 0)

    def test_out_is_a_link_to_nowhere_or_a_mount_point(self):
        link = self.root / "dangling"
        link.symlink_to("made/later")
        self.assertEqual(run(*self.arguments, "--no-page", "-o", link).returncode, 0)
        self.assertTrue((self.root / "made" / "later" / "summary.json").exists())
        self.assertTrue(link.is_symlink())
        unshare = ["unshare", "--mount", "--propagation", "private", *([] if os.geteuid() == 0 else ["--user", "--map-root-user"])]
        mounted = self.root / "mounted"
        mounted.mkdir()
        script = 'mount -t tmpfs -o size=100m none "$0" || exit 77; "$@" || exit $?; ls "$0"'
        done = subprocess.run([*unshare, "sh", "-c", script, mounted, PROGRAM, *map(str, self.arguments), "--no-page", "-o",
                               mounted], capture_output=True, text=True, timeout=300)
        if done.returncode in (1, 77) and "vggt-cd" not in done.stderr:
            self.skipTest("cannot mount a small file system")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("summary.json", done.stdout)

    def test_a_limit_on_the_size_of_files_is_an_output_error(self):
        out = self.root / "limited"
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100 << 10, resource.RLIM_INFINITY))
        done = run(*self.arguments, "-o", out, preexec_fn=limit)
        self.assertEqual(done.returncode, 6, done.stderr)
        self.assertIn("File too large", done.stderr)
        self.assertEqual([p.name for p in self.root.iterdir() if "limited" in p.name], [])

    def test_interrupt_leaves_nothing(self):
        out = self.root / "interrupted"
        _, others, status = signal_at([PROGRAM, *self.arguments, "-o", out],
                                      lambda e: e["event"] == "stage_finished", signal.SIGINT)
        self.assertEqual((status, others), (130, ["vggt-cd: interrupted\n"]))
        self.assertEqual([p for p in self.root.iterdir() if "interrupted" in p.name], [])


class Metres(unittest.TestCase):
    """The bundled kitchen: its truth is in metres."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        cls.truth = np.load(EXAMPLE / "truth.npz")
        cls.inputs = ["detect", EXAMPLE / "t1.npz", EXAMPLE / "t2.npz", "--joint", EXAMPLE / "joint.npz", "--no-overlays"]
        cls.metres_per_unit = 1 / json.loads((EXAMPLE / "truth.json").read_text())["t2_from_world"]["scale"]

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def true_points(self, epoch, frame):
        """[H, W, 3] in metres; NaN where there is only sky."""
        depth = self.truth[f"depth_{epoch}"][frame].astype(float)
        depth[depth <= 0] = np.nan
        k, extrinsic = self.truth[f"intrinsic_{epoch}"][frame], self.truth[f"extrinsic_{epoch}"][frame]
        v, u = np.mgrid[: depth.shape[0], : depth.shape[1]]
        rays = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1], np.ones_like(depth)], -1)
        return (depth[..., None] * rays - extrinsic[:, 3]) @ extrinsic[:, :3]

    def distance(self, epoch, frame, a, b):
        """The arguments for a distance between two pixels, true to the millimetre."""
        points = self.true_points(epoch, frame)
        name = {"t1": "before", "t2": "after"}[epoch]
        length = np.linalg.norm(points[a[1], a[0]] - points[b[1], b[0]])
        return ["--known-distance", f"{a[0]},{a[1]},{name}/{frame}", f"{b[0]},{b[1]},{name}/000{frame}.jpg", f"{length:.3f}"]

    def detect(self, name, *arguments):
        out = self.root / name
        done = run(*self.inputs, *arguments, "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        return out, done.stdout

    def test_known_distances_give_metres(self):
        plain, said = self.detect("plain")
        self.assertIn("Lengths are in scene units", said)
        known = [*self.distance("t2", 0, (40, 40), (160, 100)), *self.distance("t1", 2, (30, 110), (170, 60)),
                 *self.distance("t2", 4, (60, 120), (150, 30))]
        out, said = self.detect("known", *known)
        self.assertRegex(said, r"1 scene unit is \d\.\d+ m \(standard error [\d.]+ %\), from 3 known distances")
        metric = json.loads((out / "summary.json").read_text())["metric"]
        # The reconstruction bends its world by about a per cent; three of its lengths average that.
        self.assertAlmostEqual(metric["metres_per_unit"] / self.metres_per_unit, 1, delta=0.03)
        self.assertGreater(metric["relative_sigma"], 0)
        self.assertEqual(len(metric["known_distances"]), 3)
        into = json.loads((out / "sim3.json").read_text())["metres_from_t2"]
        self.assertEqual(into["scale"], metric["metres_per_unit"])
        self.assertEqual(into["translation"], [0, 0, 0])
        # Every length of the results is that of the plain ones times the scale.
        s = into["scale"]
        for name in ("before_aligned", "after"):
            a, b = read_ply(plain / f"{name}.ply"), read_ply(out / f"{name}.ply")
            for field in ("x", "y", "z", "scalar_change_distance", "scalar_level_of_detection"):
                np.testing.assert_allclose(b[field], s * a[field], rtol=1e-5, atol=1e-6)
            np.testing.assert_array_equal(a["scalar_label"], b["scalar_label"])
        self.assertIn(b"comment frame: T2, unit: m\n", (out / "after.ply").read_bytes()[:400])
        a, b = np.load(plain / "change.npz"), np.load(out / "change.npz")
        self.assertEqual((a["unit"].tolist(), b["unit"].tolist()), (["u"], ["m"]))
        for field in ("score", "gap", "level_of_detection"):
            np.testing.assert_allclose(b[f"{field}_t1"], s * a[f"{field}_t1"], rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(a["instance_t2"], b["instance_t2"])
        a, b = (json.loads((d / "changes.json").read_text()) for d in (plain, out))
        self.assertEqual((a["unit"], b["unit"]), ("u", "m"))
        for plain_thing, thing in zip(a["changes"], b["changes"], strict=True):
            self.assertAlmostEqual(thing["volume_m3"], s ** 3 * plain_thing["volume_u3"])
            # The scale's own uncertainty comes on top, where there is a volume to scale.
            wider = self.assertGreater if thing["volume_m3"] > 0 else self.assertGreaterEqual
            wider(thing["volume_sigma_m3"], s ** 3 * plain_thing["volume_sigma_u3"])
            np.testing.assert_allclose(thing["center"], s * np.array(plain_thing["center"]))
        header = (out / "changes.csv").read_text().splitlines()[0]
        self.assertIn("volume_m3", header)
        self.assertNotIn("_u", header.replace("_unit", ""))
        self.assertIn('"unit":"m"', (out / "report.html").read_text().replace('": ', '":'))

    def test_reference_cameras_give_their_frame(self):
        lines = ["photo,x,y,z"]
        for epoch, name in (("t1", "before"), ("t2", "after")):
            for frame, pose in enumerate(self.truth[f"extrinsic_{epoch}"]):
                center = -pose[:, :3].T @ pose[:, 3]
                lines.append(f"{name}/{frame:04d}.jpg," + ",".join(f"{c:.4f}" for c in center))
        table = self.root / "cameras.csv"
        table.write_text("\n".join(lines) + "\n")
        out, said = self.detect("reference", "--reference", table)
        self.assertIn("from 12 reference cameras", said)
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual(summary["inputs"]["reference"], "cameras.csv")
        self.assertEqual(summary["change"]["frame"], "reference")
        # The cameras of the results fit the table as well as they can: what Kabsch's rotation, the ratio of spreads and
        # the difference of means would still change is nothing.
        ours = np.concatenate([np.loadtxt(out / f"cameras_{name}.tum")[:, 1:4] for name in ("before", "after")])
        theirs = np.array([line.split(",")[1:] for line in lines[1:]], float)
        np.testing.assert_allclose(ours.mean(0), theirs.mean(0), atol=1e-5)
        a, b = ours - ours.mean(0), theirs - theirs.mean(0)
        u, d, vt = np.linalg.svd(b.T @ a)
        np.testing.assert_allclose(u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt, np.eye(3), atol=1e-5)
        self.assertAlmostEqual(d.sum() / (a ** 2).sum(), 1, places=4)
        rms = np.sqrt(((ours - theirs) ** 2).sum(-1).mean())
        self.assertAlmostEqual(summary["metric"]["rms_residual_m"], rms, places=5)
        # Points lie in the true room as well as the walk (2.9 m long, 0.2 m wide) can tell: three deviations of a turn
        # about it at the room's distance.
        ply, change = read_ply(out / "after.ply"), np.load(out / "change.npz")
        true = np.stack([self.true_points("t2", frame) for frame in range(6)])[change["label_t2"] != 255]
        off = np.linalg.norm(np.stack([ply["x"], ply["y"], ply["z"]], -1) - true, axis=-1)
        self.assertLess(np.nanmedian(off), 3 * np.radians(summary["metric"]["rotation_sigma_deg"]) * 2.5)
        # A TUM file of T2's cameras, as another program would write it.
        tum = self.root / "cameras.tum"
        tum.write_text("".join(f"{i}.0 {' '.join(line.split(',')[1:])} 0 0 0 1\n" for i, line in enumerate(lines[7:])))
        out, said = self.detect("tum", "--reference", tum)
        self.assertIn("from 6 reference cameras", said)

    def test_register_tells_the_metre(self):
        out = self.root / "register"
        done = run("register", *self.inputs[1:-1], *self.distance("t2", 0, (40, 40), (160, 100)), "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        into = json.loads((out / "sim3.json").read_text())["metres_from_t2"]
        self.assertAlmostEqual(into["scale"] / self.metres_per_unit, 1, delta=0.05)
        self.assertIsNone(into["scale_sigma_relative"])

    def test_what_cannot_be_is_one_line(self):
        out = self.root / "bad"
        table = self.root / "two.txt"
        table.write_text("after/0 0 0 0\nafter/1 1 0 0\n")
        for status, word, arguments in (
                (2, "expected one of them", ["--known-distance", "1,1,after/0", "9,9,after/0", "1", "--reference", table]),
                (2, "number of metres", ["--known-distance", "1,1,after/0", "9,9,after/0", "2.4m"]),
                (2, "no photo", ["--known-distance", "1,1,after/9", "9,9,after/0", "1"]),
                (3, "at least 3 cameras", ["--reference", table]),
                (3, "nowhere.txt", ["--reference", self.root / "nowhere.txt"]),
                (5, "contradict", ["--known-distance", "40,40,after/0", "160,100,after/0", "1",
                                   "--known-distance", "40,40,after/0", "160,100,after/0", "3"])):
            done = run(*self.inputs, *arguments, "-o", out)
            self.assertEqual(done.returncode, status, done.stderr)
            lines = [line for line in done.stderr.splitlines() if line.startswith("vggt-cd:")]
            self.assertEqual(len(lines), 1, done.stderr)
            self.assertIn(word, lines[0])
            self.assertFalse(out.exists())


class Numbers(unittest.TestCase):
    """Neither a stray pixel nor the unit nor the origin of a prediction decides what has changed."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        cls.inputs = {name: dict(np.load(EXAMPLE / f"{name}.npz")) for name in ("t1", "t2", "joint")}
        cls.plain = cls.root / "plain"
        done = cls.detect(cls.plain, cls.inputs)
        assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def detect(cls, out, inputs, *arguments, joint=True):
        for name, arrays in inputs.items():
            np.savez(cls.root / f"{name}.npz", **arrays)
        return run("detect", cls.root / "t1.npz", cls.root / "t2.npz",
                   *(["--joint", cls.root / "joint.npz"] if joint else []), *arguments, "-o", out, "--no-overlays")

    def expect_same(self, out, other, done):
        """As a random choice of other point pairs would leave it."""
        self.assertEqual(done.returncode, 0, done.stderr)
        change, expected = (json.loads((path / "summary.json").read_text())["change"] for path in (out, other))
        for epoch in ("t1", "t2"):
            self.assertAlmostEqual(change[epoch]["points"], expected[epoch]["points"], delta=5)
            self.assertAlmostEqual(change[epoch]["changed_share"], expected[epoch]["changed_share"], delta=2e-3)

    def test_one_pixel_decides_nothing(self):
        for depth in (10, 1e8, 1e30, 1e-30):
            arrays = {key: array.copy() for key, array in self.inputs["t1"].items()}
            arrays["depth"] = arrays["depth"].astype("f4")
            arrays["depth_conf"] = arrays["depth_conf"].astype("f4")
            arrays["depth"][2, 5, 100], arrays["depth_conf"][2, 5, 100] = depth, 2 * arrays["depth_conf"].max()
            out = self.root / f"pixel_{depth}"
            done = self.detect(out, {**self.inputs, "t1": arrays})
            self.expect_same(out, self.plain, done)
            self.assertIn("t1.npz: 1 of 188496 pixels are ignored: their depth is far", done.stderr)

    def test_the_unit_means_nothing(self):
        for unit in (1e-9, 1e-6, 1e9):
            inputs = {}
            for name, arrays in self.inputs.items():
                inputs[name] = {**arrays, "depth": (arrays["depth"].astype("f8") * unit).astype("f4"),
                                "extrinsic": arrays["extrinsic"] * np.array([1, 1, 1, unit])}
            out = self.root / f"unit_{unit}"
            self.expect_same(out, self.plain, self.detect(out, inputs))
            sim3, expected = (json.loads((path / "sim3.json").read_text()) for path in (out, self.plain))
            self.assertAlmostEqual(sim3["scale"], expected["scale"], delta=1e-3)

    def in_one_frame(self, origin):
        """Both epochs in T2's frame, whose origin is moved."""
        sim3 = json.loads((self.plain / "sim3.json").read_text())
        scale, rotation, translation = sim3["scale"], np.array(sim3["rotation"]), np.array(sim3["translation"])
        inputs = {}
        for name in ("t1", "t2"):
            arrays = {key: array.copy() for key, array in self.inputs[name].items()}
            arrays["extrinsic"] = arrays["extrinsic"].astype("f8")
            for pose in arrays["extrinsic"]:
                turn = np.linalg.svd(pose[:, :3])
                turn, center = turn[0] @ turn[2], -pose[:, :3].T @ pose[:, 3]
                if name == "t1":
                    turn, center = turn @ rotation.T, scale * rotation @ center + translation
                pose[:, :3], pose[:, 3] = turn, -turn @ (center + origin)
            arrays["depth"] = arrays["depth"].astype("f4") * np.float32(scale if name == "t1" else 1)
            inputs[name] = arrays
        return inputs

    def test_the_origin_means_nothing(self):
        origins = {"near": np.zeros(3), "far": np.array([691234.0, 5334321.0, 512.0])}
        for name, origin in origins.items():
            done = self.detect(self.root / name, self.in_one_frame(origin), "--aligned", joint=False)
            self.expect_same(self.root / name, self.root / "near", done)
        # Floats at the scene's size; T1 also moved by the refinement, whose static set differs by a few points.
        for name, tolerance in (("before_aligned.ply", 1e-4), ("after.ply", 1e-6)):
            near, far = (read_ply(self.root / place / name) for place in origins)
            self.assertEqual((near["x"].dtype, far["x"].dtype), (np.float32, np.float64))
            self.assertEqual(len(near), len(far))
            for axis, offset in zip("xyz", origins["far"]):
                np.testing.assert_allclose(far[axis] - offset, near[axis], atol=tolerance)
        cameras = [np.loadtxt(self.root / place / "cameras_after.tum") for place in origins]
        np.testing.assert_allclose(cameras[1][:, 1:4] - origins["far"], cameras[0][:, 1:4], atol=1e-7)
        sim3 = json.loads((self.root / "far" / "sim3.json").read_text())
        moved = sim3["scale"] * np.array(sim3["rotation"]) @ origins["far"] + sim3["translation"] - origins["far"]
        self.assertLess(np.linalg.norm(moved), 0.1)
        things = [json.loads((self.root / place / "changes.json").read_text())["changes"] for place in origins]
        np.testing.assert_allclose(np.array(things[1][0]["center"]) - origins["far"], things[0][0]["center"], atol=0.01)

    def test_a_reference_far_away_keeps_millimetres(self):
        poses = np.load(EXAMPLE / "truth.npz")
        origins = {"local": np.zeros(3), "utm": np.array([500123.0, 4649776.0, 100.0])}
        clouds = []
        for name, origin in origins.items():
            with open(self.root / f"{name}.csv", "w") as table:
                for epoch, key in (("before", "extrinsic_t1"), ("after", "extrinsic_t2")):
                    for number, pose in enumerate(poses[key]):
                        center = -pose[:, :3].T @ pose[:, 3] + origin
                        table.write(f"{epoch}/{number:04d}.jpg,{center[0]:.4f},{center[1]:.4f},{center[2]:.4f}\n")
            done = self.detect(self.root / f"at_{name}", self.inputs, "--reference", self.root / f"{name}.csv")
            self.assertEqual(done.returncode, 0, done.stderr)
            clouds.append(read_ply(self.root / f"at_{name}" / "after.ply"))
        for axis, offset in zip("xyz", origins["utm"]):
            np.testing.assert_allclose(clouds[1][axis] - offset, clouds[0][axis], atol=1e-3)
        # The page is drawn about a place nearby.
        page = (self.root / "at_utm" / "report.html").read_text()
        data = json.loads(re.search(r'id="report-data">(.*?)</script>', page, re.S)[1])
        summary = json.loads((self.root / "at_utm" / "summary.json").read_text())
        self.assertEqual(data["origin"], summary["change"]["origin_m"])
        for cloud in data["clouds"]:
            self.assertLess(np.abs(cloud["box_min"]).max(), 50)
        for thing in data["changes"]:
            self.assertLess(np.abs(thing["center"]).max(), 50)


class Explain(unittest.TestCase):
    """What --explain prints and writes agrees with change.npz and with the photos."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        cls.inputs = ["detect", EXAMPLE / "t1.npz", EXAMPLE / "t2.npz", "--joint", EXAMPLE / "joint.npz",
                      "--no-overlays", "--no-page"]
        done = run(*cls.inputs, "-o", cls.root / "plain")
        assert done.returncode == 0, done.stderr
        cls.change = np.load(cls.root / "plain" / "change.npz")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def pixel_with(self, epoch, label, least_confidence):
        sure = np.nan_to_num(self.change[f"confidence_{epoch}"], nan=1.0) >= least_confidence
        frame, y, x = np.argwhere((self.change[f"label_{epoch}"] == label) & sure)[0]
        return int(frame), int(x), int(y)

    def test_the_reasons_are_those_of_the_answer(self):
        for name, epoch, label, word in (("before", "t1", 1, "removed"), ("after", "t2", 2, "added"),
                                         ("before", "t1", 0, "unchanged"), ("after", "t2", 3, "unobserved")):
            frame, x, y = self.pixel_with(epoch, label, 0.6)
            out = self.root / word
            done = run(*self.inputs, "--explain", f"{x},{y},{name}/{frame}", "-o", out)
            self.assertEqual(done.returncode, 0, done.stderr)
            why = json.loads((out / "explain.json").read_text())
            self.assertEqual((why["photo"], why["pixel"], why["label"]), (f"{name}/{frame:04d}.jpg", [x, y], word))
            self.assertIn(why["sentence"], done.stdout)
            self.assertIn(word, why["sentence"])
            for key in ("confidence", "gap_u", "level_of_detection_u"):
                value = self.change[f"{key.removesuffix('_u')}_{epoch}"][frame, y, x]
                self.assertEqual(why[key], None if np.isnan(value) else value)
            votes = [photo for photo in why["photos"] if photo["weight"] > 0]
            self.assertTrue(all(photo["vote"] in ("sees", "looks_through") for photo in votes))
            for photo in why["photos"]:
                self.assertIn(photo["photo"], done.stdout)
                self.assertTrue(photo["photo"].startswith("after/" if name == "before" else "before/"))
            if word in ("removed", "added"):
                self.assertGreaterEqual(why["through_share"], why["min_through_share"])

    def test_asking_does_not_change_the_answer(self):
        out = self.root / "asked"
        self.assertEqual(run(*self.inputs, "--explain", "50,50,after/2", "-o", out).returncode, 0)
        self.assertEqual((out / "change.npz").read_bytes(), (self.root / "plain" / "change.npz").read_bytes())

    def test_in_metres_when_metres_are_known(self):
        out = self.root / "metres"
        frame, x, y = self.pixel_with("t2", 2, 0.6)
        done = run(*self.inputs, "--explain", f"{x},{y},after/{frame}", "--known-distance", "40,40,after/0",
                   "160,100,after/0", "3", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        why = json.loads((out / "explain.json").read_text())
        self.assertEqual(why["unit"], "m")
        scale = json.loads((out / "sim3.json").read_text())["metres_from_t2"]["scale"]
        self.assertAlmostEqual(why["gap_m"], scale * float(self.change["gap_t2"][frame, y, x]), delta=1e-5)
        self.assertRegex(why["sentence"], r"mean gap [\d.e-]+ m,")

    def test_a_question_without_an_answer_is_one_line(self):
        for word, arguments in (("no photo", ["--explain", "1,1,after/x.jpg"]), ("outside", ["--explain", "999,1,after/0"]),
                                ("expected X,Y", ["--explain", "1,1"]),
                                ("free_space", ["--explain", "1,1,after/0", "--method", "paper"])):
            done = run(*self.inputs, *arguments, "-o", self.root / "bad")
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(word, done.stderr)
            self.assertFalse((self.root / "bad").exists())


class UnusualNames(unittest.TestCase):
    """Names of photos are kept to the byte for use and escaped for display."""

    NAMES = ["a\n.jpg", "a\n.png", "caf\udce9.jpg"]  # a byte that is not UTF-8 as os.fsdecode has it

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.temporary.name)
        arrays = np.load(EXAMPLE / "t1.npz")
        for name in ("t1", "t2"):
            np.savez(self.root / f"{name}.npz", names=np.array(self.NAMES),
                     **{key: arrays[key][:3] for key in ("extrinsic", "intrinsic", "depth", "images")})
        self.arguments = ["detect", self.root / "t1.npz", self.root / "t2.npz", "--aligned", "--accept-alignment"]

    def tearDown(self):
        self.temporary.cleanup()

    def test_name_results_and_find_them(self):
        out = self.root / "out"
        for name in self.NAMES:
            done = run(*self.arguments, "-o", out, "--explain", "50,50,before/" + name)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertNotIn("a\n.", done.stdout + done.stderr)
            self.assertNotIn("\udce9", done.stdout + done.stderr)
            self.assertIn("caf\\xe9.jpg", done.stdout)
        for epoch in ("before", "after"):
            self.assertEqual(sorted(os.listdir(os.fsencode(out / "overlays" / epoch))),
                             [b"a\\x0a.jpg.png", b"a\\x0a.png.png", b"caf\xe9.jpg.png"])
        images = (out / "colmap" / "images.txt").read_bytes()
        self.assertIn(b" before/a\\x0a.jpg\n", images)
        self.assertIn(b" after/caf\xe9.jpg\n", images)
        shutil.rmtree(out / "overlays" / "after")
        page = (out / "report.html").stat().st_size
        done = run("view", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess((out / "report.html").stat().st_size, page)  # it found the overlays under these names


class FieldFiles(unittest.TestCase):
    """Files as programs and people of the field save them."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        cls.t1 = dict(np.load(EXAMPLE / "t1.npz"))

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def save(self, name, **changes):
        np.savez(self.root / name, **{**self.t1, **changes})
        return self.root / name

    def register(self, t1, name):
        out = self.root / name
        done = run("register", t1, EXAMPLE / "t2.npz", "--joint", EXAMPLE / "joint.npz", "-o", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads((out / "sim3.json").read_text()), done.stderr

    def test_side_members_and_names_that_are_no_text_change_nothing(self):
        frames = len(self.t1["extrinsic"])
        plain, _ = self.register(EXAMPLE / "t1.npz", "plain")
        latin = [b"K\xfcche_%d.jpg" % i for i in range(frames)]
        saved = self.save("latin.npz", names=np.array([n.decode("utf-8", "surrogateescape") for n in latin]))
        packed = self.root / "packed.npz"
        with zipfile.ZipFile(saved) as a, zipfile.ZipFile(packed, "w") as b:
            for name in a.namelist():
                b.writestr(name, a.read(name))
                b.writestr("__MACOSX/._" + name, b"\0\5\x16\7\0\2\0\0Mac OS X        " + bytes(80))
        self.assertEqual(self.register(packed, "packed")[0], plain)

    def test_frames_that_tracking_lost_are_left_out_and_named(self):
        joint = np.load(EXAMPLE / "joint.npz")
        lost = next(i for i in range(len(self.t1["extrinsic"])) if i not in joint["keyframes_t1"])
        poses = self.t1["extrinsic"].copy()
        poses[lost] = -np.inf
        sim3, notices = self.register(self.save("lost.npz", extrinsic=poses), "lost")
        self.assertRegex(notices, r"lost\.npz: frames whose pose .* are left out: \S+")
        whole, _ = self.register(EXAMPLE / "t1.npz", "whole")
        self.assertAlmostEqual(sim3["scale"] / whole["scale"], 1, delta=0.02)

    def test_intrinsics_of_the_full_size_photos_are_named(self):
        k = self.t1["intrinsic"].copy()
        k[:, :2] *= 20
        done = run("detect", self.save("full.npz", intrinsic=k), EXAMPLE / "t2.npz", "--aligned", "-o", self.root / "x")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertRegex(done.stderr, r"^vggt-cd: .*full\.npz: intrinsic: expected intrinsics in pixels of the frames")

    def test_names_with_spaces_reach_colmap(self):
        names = np.array([f"photo ({i + 1}).jpg" for i in range(len(self.t1["extrinsic"]))])
        out = self.root / "spaces"
        done = run("detect", self.save("spaces.npz", names=names), EXAMPLE / "t2.npz", "--joint",
                   EXAMPLE / "joint.npz", "-o", out, "--no-page")
        self.assertEqual(done.returncode, 0, done.stderr)
        binary = (out / "colmap" / "images.bin").read_bytes()
        for name in names:
            self.assertIn(b"before/" + name.encode() + b"\0", binary)

    def test_text_models_and_time_stamps_are_paired_as_they_are_meant(self):
        rng = np.random.default_rng(1)
        centers = rng.normal(size=(12, 3))

        def tum(name, order, stamp=lambda i: f"{1305031102 + i / 30:.6f}"):
            lines = [f"{stamp(i)} {' '.join(repr(float(v)) for v in centers[i])} 0 0 0 1\n" for i in order]
            (self.root / name).write_text("".join(lines))
            return self.root / name

        def ate(before, after, *truth):
            done = run("evaluate", before, after, *truth, "-o", self.root / "scores.json")
            self.assertEqual(done.returncode, 0, done.stderr)
            scores = json.loads((self.root / "scores.json").read_text())
            self.assertLess(scores["ate_mean"], 1e-9)
            return scores["frames"], done.stderr

        truth = tum("truth.tum", range(12))
        both = ("--truth-before", truth, "--truth-after", truth)
        self.assertEqual(ate(truth, tum("joined.tum", [*range(6, 12), *range(6)]), *both)[0], 24)
        frames, notices = ate(truth, tum("lost_first.tum", range(1, 12)), "--truth-before", truth,
                              "--truth-after", tum("lost_last.tum", range(11)))
        self.assertEqual(frames, 12 + 10)
        self.assertIn("lost_first.tum: 1 of 11 poses have no partner", notices)
        numbered = tum("numbered.tum", range(12), str)
        self.assertEqual(ate(numbered, numbered, *both)[0], 24)
        self.assertEqual(run("evaluate", numbered, numbered, "--truth-before", truth,
                             "--truth-after", self.root / "joined.tum").returncode, 3)
        # Image ids as COLMAP gives them, names as ffmpeg counts; frame_2 comes before frame_10.
        model = self.root / "model"
        model.mkdir()
        (model / "images.txt").write_text("".join(
            f"{first - i} 1 0 0 0 {' '.join(repr(float(-v)) for v in centers[i])} 1 {e}/frame_{i + 1}.jpg\n\n"
            for e, first in (("before", 100), ("after", 50)) for i in range(12)))
        self.assertEqual(ate(numbered, numbered, "--truth", model)[0], 24)

    def test_numbers_that_no_place_has_are_named(self):
        good = self.root / "good.tum"
        good.write_text("".join(f"{i} {i * 0.1} {i * i * 0.01} 0 0 0 0 1\n" for i in range(6)))
        for number in ("1e308", "-1.7e308"):
            bad = self.root / "bad.tum"
            bad.write_text(good.read_text().replace("0.2 ", number + " ", 1))
            done = run("evaluate", bad, good, "--truth-before", good, "--truth-after", good)
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertIn(f"bad.tum:3: expected coordinates from -1e13 to 1e13, found {number}", done.stderr)


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
