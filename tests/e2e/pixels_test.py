#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""detect on the photos of a generated kitchen, without a network: what it finds, and that it survives being killed.

Usage: pixels_test.py PROGRAM TEST_MEDIA [unittest arguments]
"""
import json
import os
import pathlib
import pty
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

import numpy as np

from running import HANG_S, signal_at

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
TEST_MEDIA = pathlib.Path(sys.argv.pop(1)).resolve()
ENVIRONMENT = {**os.environ, "VGGTCD_WEIGHTS": "", "HOME": "/nonexistent"}
SIZE = ("--frame-side", "168")


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=HANG_S,
                          env=ENVIRONMENT)


def must(*arguments):
    done = run(*arguments)
    assert done.returncode == 0, done.stderr
    return done


def scores(out, truth):
    path = out.with_suffix(".json")
    must("evaluate", "--change", out, "--truth", truth, "-o", path)
    return json.loads(path.read_text())


def content(out):
    """Every file of the results by its name."""
    return {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}


def kill_at(arguments, wanted):
    events, _, status = signal_at([PROGRAM, *arguments], wanted, signal.SIGKILL, ENVIRONMENT)
    return events, status


@unittest.skipUnless(shutil.which("colmap"), "no COLMAP")
class Pixels(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        cls.scene = cls.root / "kitchen"
        must("synthesize", cls.scene, "--scene", "kitchen", "--frames", "8", "--width", "168", "--no-wat")
        cls.photos = (cls.scene / "before", cls.scene / "after")
        cls.out = cls.root / "undisturbed"
        cls.done = must("detect", *cls.photos, "-o", cls.out, *SIZE)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_all_photos_are_placed_and_the_changes_found(self):
        found = scores(self.out, self.scene / "truth.npz")
        self.assertEqual((found["frames_t1"], found["frames_t2"]), (8, 8))
        # Half of what is called changed is right, and half of what changed is called so: at 168 px
        # this is what plane sweep gives with room to spare, and far from what chance would give
        # (a fifth of the pixels changed).
        self.assertGreater(found["evidence"]["precision"], 0.5)
        self.assertGreater(found["evidence"]["recall"], 0.5)
        self.assertLess(found["ate_relative"], 0.02)
        self.assertLess(found["unseen_called_changed"], 0.1)

    def test_says_that_it_is_the_fallback(self):
        self.assertIn("no network weights", self.done.stderr)
        self.assertIn("Classical reconstruction (no network)", self.done.stdout)
        self.assertIn("Classical", json.loads((self.out / "summary.json").read_text())["reconstruction"])

    def kill_after(self, stage, out):
        """Starts, kills when the stage is reported finished; the stages that were finished by then."""
        events, status = kill_at(["detect", *self.photos, "-o", out, *SIZE],
                                 lambda e: e["event"] == "stage_finished" and e["stage"] == stage)
        self.assertEqual(status, -signal.SIGKILL, stage)
        return [e["stage"] for e in events if e["event"] == "stage_finished"]

    def test_killed_after_every_stage_it_goes_on_to_the_same_bytes(self):
        out = self.root / "killed"
        kept = ["matching", "structure from motion", "before: depth", "after: depth"]
        stages = ["read photos", "key points", *kept, "read predictions", "coarse alignment",
                  "change detection", "free-space votes", "changed things", "write results"]
        for number, stage in enumerate(stages):
            finished = self.kill_after(stage, out)
            for earlier in set(stages[:number]) & set(kept):
                self.assertNotIn(earlier, finished, f"made again before {stage}")
        done = must("detect", *self.photos, "-o", out, *SIZE)
        self.assertIn("used again", done.stderr)
        self.assertEqual([p.name for p in self.root.iterdir() if "partial" in p.name], [])
        killed, undisturbed = content(out), content(self.out)
        self.assertEqual(killed.keys(), undisturbed.keys())
        for name in undisturbed:
            self.assertEqual(killed[name], undisturbed[name], name)

    def test_killed_in_the_middle_of_a_stage_it_goes_on_to_the_same_bytes(self):
        for stage in ("structure from motion", "before: depth", "free-space votes", "write results"):
            out = self.root / ("within " + stage.replace(": ", " "))
            if stage in ("free-space votes", "write results"):  # what comes before is kept, and tested above
                shutil.copytree(self.out, out)
            _, status = kill_at(["detect", *self.photos, "-o", out, *SIZE],
                                lambda e, stage=stage: e["event"] == "stage_advanced" and e["stage"] == stage)
            self.assertEqual(status, -signal.SIGKILL, stage)
            for kept in (out / ".stages").glob("classical-*"):  # what a kill within a file would leave
                if not (kept / "reconstruction.json").exists():
                    (kept / "joint.npz.iwuxtg").write_bytes(b"PK")
                    (kept / "reconstruction.json.partial-1").write_text("{")
            must("detect", *self.photos, "-o", out, *SIZE)
            self.assertEqual(content(out), content(self.out))

    def test_a_terminal_shows_the_time_left_of_the_stage_and_of_the_job(self):
        out = self.root / "terminal"
        shutil.copytree(self.out, out)
        ours, theirs = pty.openpty()
        process = subprocess.Popen(list(map(str, [PROGRAM, "detect", *self.photos, "-o", out, *SIZE])), stderr=theirs,
                                   stdout=subprocess.DEVNULL, env=ENVIRONMENT)
        os.close(theirs)
        shown = b""
        try:
            while chunk := os.read(ours, 65536):
                shown += chunk
        except OSError:  # Linux: the other end is closed
            pass
        os.close(ours)
        self.assertEqual(process.wait(timeout=HANG_S), 0)
        self.assertIn(b"; about ", shown)
        self.assertIn(b" s to go", shown)
        live = [line for line in shown.replace(b"\n", b"\r").split(b"\r") if line.startswith(b"\x1b[K")]
        self.assertGreater(len(live), 8)
        self.assertTrue(all(len(line) < 83 for line in live), live)  # 80 columns, else it would wrap

    def test_the_plan_of_the_job_names_its_stages_in_order(self):
        out = self.root / "planned"
        done = must("detect", *self.photos, "-o", out, *SIZE, "--progress", "json")
        events = [json.loads(line) for line in done.stderr.splitlines()]
        plans = [[stage["stage"] for stage in e["stages"]] for e in events if e["event"] == "job_planned"]
        finished = [e["stage"] for e in events if e["event"] == "stage_finished"]
        self.assertEqual(plans[0], finished)
        self.assertEqual(plans[1], finished[finished.index("coarse alignment"):])
        self.assertTrue(all("job_seconds_left" in e for e in events if e["event"] == "stage_advanced"))

    def test_a_second_run_reconstructs_nothing(self):
        out = self.root / "twice"
        shutil.copytree(self.out, out)
        plan = must("detect", *self.photos, "-o", out, *SIZE, "--dry-run").stdout
        self.assertIn("Reconstructor: none: reconstruction of an earlier run is used again", plan)
        done = run("detect", *self.photos, "-o", out, *SIZE, "--progress", "plain")
        self.assertIn("used again", done.stderr)
        self.assertNotIn("matching", done.stderr)
        self.assertEqual(content(out), content(self.out))

    def test_what_the_machine_did_to_colmap_is_said_and_not_kept(self):
        """A mapper that is killed, as the kernel does when memory is short; then one that fails with a full disk."""
        out, real, tools = self.root / "mapper", shutil.which("colmap"), self.root / "tools"
        tools.mkdir()
        script = tools / "colmap"
        for end, words in (("kill -9 $$", "colmap mapper: expected exit status 0, found it was ended by signal 9"),
                           ("echo disk full; exit 1", "colmap mapper: expected exit status 0, found exit status 1"),
                           ("exit 137", "found exit status 137 (of a script: signal 9, Killed)")):
            script.write_text(f'#!/bin/sh\n[ "$1" = mapper ] && {{ {end}; }}\nexec {real} "$@"\n')
            script.chmod(0o755)
            done = subprocess.run([PROGRAM, *map(str, ["detect", *self.photos, "-o", out, *SIZE])], capture_output=True,
                                  text=True, timeout=500, env={**ENVIRONMENT, "PATH": f"{tools}:{os.environ['PATH']}"})
            self.assertEqual(done.returncode, 8, done.stderr)
            self.assertIn(words, done.stderr)
            self.assertIn("run it again", done.stderr)
        done = must("detect", *self.photos, "-o", out, *SIZE, "--progress", "plain")
        self.assertNotIn("matching", done.stderr)  # the finished stages are used
        self.assertEqual(content(out), content(self.out))

    def test_damaged_stages_are_made_again(self):
        out = self.root / "damaged"
        shutil.copytree(self.out, out)
        kept = next((out / ".stages").glob("classical-*"))
        for name in ("before.npz", "joint.npz", "reconstruction.json", ".kept"):
            data = bytearray((kept / name).read_bytes())
            if name == "joint.npz":
                data[len(data) // 2] ^= 1  # as long, another byte
            else:
                del data[len(data) // 2:]
            (kept / name).write_bytes(data)
            done = must("detect", *self.photos, "-o", out, *SIZE, "--progress", "plain")
            self.assertIn(f"{name}: is damaged and made again", done.stderr)
            self.assertEqual(content(out), content(self.out))

    def test_photos_in_out_are_refused_before_any_work(self):
        """OUT was written by synthesize: its photos are in its list, and are the input."""
        scene = self.root / "in_out"
        shutil.copytree(self.scene, scene)
        before = content(scene)
        for arguments in ((), ("--dry-run",)):
            done = run("detect", scene / "before", scene / "after", "-o", scene, *SIZE, *arguments)
            self.assertEqual(done.returncode, 6, done.stderr)
            self.assertIn(f"it holds the input {scene / 'before'}; name another directory, outside of it", done.stderr)
            self.assertEqual(content(scene), before)

    def test_a_video_before_and_a_folder_after(self):
        video = self.root / "before.avi"
        made = subprocess.run([TEST_MEDIA, "video", video, *sorted(self.photos[0].iterdir())])
        if made.returncode == 77:
            self.skipTest("OpenCV cannot write videos here")
        out = self.root / "video"
        must("detect", video, self.photos[1], "-o", out, "--frames", "7", *SIZE)
        overlays = sorted(p.name for p in (out / "overlays" / "before").iterdir())
        self.assertEqual(len(overlays), 7)
        self.assertTrue(all(name.startswith("before") for name in overlays), overlays)

    def test_a_prediction_before_and_photos_after(self):
        out = self.root / "prediction"
        done = must("detect", self.scene / "t1.npz", self.photos[1], "-o", out, *SIZE)
        self.assertIn("given frames placed", done.stdout)
        # Before is the prediction, in its own scale: the joint reconstruction has found the way.
        found = scores(out, self.scene / "truth.npz")
        self.assertEqual((found["frames_t1"], found["frames_t2"]), (8, 8))
        self.assertLess(found["ate_relative"], 0.05)
        self.assertGreater(found["evidence"]["recall"], 0.5)
        given = np.load(self.scene / "t1.npz")["extrinsic"]
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual(summary["inputs"]["before"]["file"], "t1.npz")
        self.assertEqual(summary["inputs"]["before"]["frames"], len(given))

    def test_photos_before_and_a_prediction_after(self):
        out = self.root / "prediction_after"
        must("detect", self.photos[0], self.scene / "t2.npz", "-o", out, *SIZE)
        self.assertLess(scores(out, self.scene / "truth.npz")["ate_relative"], 0.05)


if __name__ == "__main__":
    unittest.main()
