#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The program in poor surroundings: streams that are closed or full, few threads, little memory, pipes and devices as
files, folders that may not be entered. It goes on, or says what is wrong in one line; it never hangs and never aborts.

Usage: surroundings_test.py PROGRAM EXAMPLE_DIR [unittest arguments]
"""
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import unittest

from running import HANG_S

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
EXAMPLE = pathlib.Path(sys.argv.pop(1)).resolve()
KITCHEN = [EXAMPLE / "t1.npz", EXAMPLE / "t2.npz", "--joint", EXAMPLE / "joint.npz"]
INPUT, WEIGHTS, OUTPUT, MEMORY = 3, 4, 6, 7  # exit statuses, docs/formats.md
KIB = 1024


def run(*arguments, prepare=None, env=None, **streams):
    """prepare is called in the child, before the program."""
    environment = {**os.environ, "VGGTCD_WEIGHTS": "", "HOME": "/nonexistent", **(env or {})}
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
    return subprocess.run([PROGRAM, *map(str, arguments)], text=True, timeout=HANG_S, env=environment,
                          preexec_fn=prepare, **streams)


def limit(what, amount):
    return lambda: resource.setrlimit(what, (amount, amount))


def write_photos(folder, first, count=4, width=96, height=64):
    folder.mkdir()
    for i in range(count):
        pixels = bytes((first + i) * (k + 1) * 2654435761 >> 24 & 0xFF for k in range(3 * width * height))
        (folder / f"{i}.ppm").write_bytes(b"P6 %d %d 255\n" % (width, height) + pixels)


class Surroundings(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.temporary.name)

    def tearDown(self):
        self.temporary.cleanup()

    def line(self, done, status):
        """The one line in which a run fails."""
        self.assertEqual(done.returncode, status, done.stderr)
        lines = [line for line in done.stderr.splitlines() if not line.startswith("note: ")]
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertTrue(lines[0].startswith("vggt-cd: "), done.stderr)
        return lines[0]

    def content(self, out):
        """The bytes of all results that hold no times."""
        files = {str(p.relative_to(out)): p.read_bytes() for p in out.rglob("*") if p.is_file()}
        for name in ("summary.json", "report.html", ".vggt-cd-results"):  # the list has their hashes
            files.pop(name)
        return files


class Streams(Surroundings):
    def closed(self, *numbers):
        return lambda: [os.close(number) for number in numbers]

    def test_closed_ones_change_nothing_and_no_file_takes_their_place(self):
        self.assertEqual(run("detect", *KITCHEN, "-o", self.root / "normal").returncode, 0)
        for numbers in ((2,), (1,), (0, 1, 2)):
            out = self.root / f"closed{len(numbers)}{numbers[0]}"
            done = run("detect", *KITCHEN, "-o", out, prepare=self.closed(*numbers), stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
            self.assertEqual(done.returncode, 0)
            self.assertEqual(self.content(out), self.content(self.root / "normal"))

    def test_a_full_standard_error_changes_no_status(self):
        with open("/dev/full", "w") as full:
            for mode in ("plain", "json"):
                out = self.root / mode
                done = run("detect", *KITCHEN, "-o", out, "--progress", mode, stderr=full)
                self.assertEqual(done.returncode, 0)
                self.assertTrue((out / "report.html").exists())
            done = run("detect", EXAMPLE / "t1.npz", "nothing.npz", "--aligned", "-o", self.root / "bad", stderr=full)
            self.assertEqual(done.returncode, INPUT)
        self.assertEqual(sorted(p.name for p in self.root.iterdir()), ["json", "plain"])

    def test_an_answer_that_is_lost_is_an_error(self):
        tum = self.root / "cameras.tum"
        tum.write_text("".join(f"{i} {0.1 * i} {0.01 * i * i} 0 0 0 0 1\n" for i in range(6)))
        with open("/dev/full", "w") as full:
            for arguments in (["evaluate", tum, tum, "--truth", EXAMPLE / "truth.npz"], ["--version"], ["detect", "--help"],
                              ["synthesize", "--list"], ["detect", *KITCHEN, "-o", self.root / "o", "--dry-run"],
                              ["register", *KITCHEN, "-o", self.root / "out"]):
                line = self.line(run(*arguments, "--progress", "none", stdout=full) if arguments[-1] not in
                                 ("--version", "--help") else run(*arguments, stdout=full), OUTPUT)
                self.assertIn("standard output cannot be written: No space left on device", line)
        self.assertTrue((self.root / "out" / "sim3.json").exists())  # the results are not lost with it

    def test_a_reader_that_goes_away_ends_no_run(self):
        there, here = os.pipe()
        os.close(there)
        done = run("detect", *KITCHEN, "-o", self.root / "out", "--progress", "plain", stderr=here)
        os.close(here)
        self.assertEqual(done.returncode, 0)
        self.assertTrue((self.root / "out" / "report.html").exists())


class Limits(Surroundings):
    def test_with_fewer_threads_than_asked_for_the_bytes_are_the_same(self):
        self.assertEqual(run("detect", *KITCHEN, "-o", self.root / "normal").returncode, 0)
        done = run("detect", *KITCHEN, "-o", self.root / "few", "--threads", "1000", "--progress", "none",
                   prepare=limit(resource.RLIMIT_AS, 3 * KIB**3))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"^note: the system does not give 1000 threads .*; going on with \d+\n$")
        self.assertEqual(self.content(self.root / "few"), self.content(self.root / "normal"))

    def test_a_limit_on_processes_is_survived(self):
        # Root has no such limit; another user may not read this program, so it is copied. OpenBLAS, which comes with
        # OpenCV, ends a process before its main() where it cannot have its threads; that is not ours to mend.
        if os.geteuid() != 0:
            self.skipTest("needs root to become a user without processes")
        self.root.chmod(0o755)
        shutil.copy(PROGRAM, self.root / "program")
        (self.root / "data").mkdir()
        for file in ("t1", "t2", "joint"):
            shutil.copy(EXAMPLE / f"{file}.npz", self.root / "data")
        (self.root / "out").mkdir()
        (self.root / "out").chmod(0o777)

        def become(processes):
            os.setgroups([])
            os.setgid(23456)
            resource.setrlimit(resource.RLIMIT_NPROC, (processes, processes))
            os.setuid(23456)

        for processes in (1, 4, 20):
            done = subprocess.run(
                [self.root / "program", "detect", "data/t1.npz", "data/t2.npz", "--joint", "data/joint.npz", "-o",
                 f"out/{processes}", "--threads", "64", "--progress", "none"], cwd=self.root, capture_output=True,
                text=True, timeout=HANG_S, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"}, preexec_fn=lambda: become(processes))
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stderr, r"^note: the system does not give 64 threads .*; going on with \d+\n$")

    def test_little_memory_is_one_line(self):
        # From what the program needs to start, in steps, to where it suffices: every failure in between is the same.
        def works(kib, *arguments):
            return run(*arguments, prepare=limit(resource.RLIMIT_AS, kib * KIB))

        base = 100_000
        while works(base, "--version").returncode != 0:
            base += 10_000
            self.assertLess(base, 4_000_000)
        failures = 0
        for step in (*range(1, 40, 3), *range(40, 400, 15)):
            done = works(base + 2000 * step, "detect", *KITCHEN, "-o", self.root / "out", "--threads", "1", "--progress",
                         "none")
            if done.returncode == 0:
                break
            failures += 1
            self.assertIn("out of memory", self.line(done, MEMORY))
            self.assertEqual(list(self.root.iterdir()), [])
        self.assertEqual(done.returncode, 0)
        self.assertGreater(failures, 5)


class Files(Surroundings):
    def test_pipes_and_devices_are_refused_at_once(self):
        os.mkfifo(self.root / "pipe")
        os.mkfifo(self.root / "pipe.jpg")
        os.mkfifo(self.root / "pipe.npz")
        os.mkfifo(self.root / "pipe.mp4")
        write_photos(self.root / "photos", 1)
        write_photos(self.root / "others", 11)
        out = ["-o", self.root / "out"]
        pairs = [EXAMPLE / "t1.npz", EXAMPLE / "t2.npz"]
        truth = ["--truth", EXAMPLE / "truth.npz"]
        for file in (self.root / "pipe", "/dev/zero"):
            for status, arguments in ((INPUT, ["detect", *pairs, "--initial-sim3", file, *out]),
                                      (INPUT, ["evaluate", file, file, *truth]),
                                      (INPUT, ["detect", *KITCHEN, "--reference", file, *out]),
                                      (INPUT, ["detect", file, self.root / "photos", *out]),
                                      (WEIGHTS, ["weights", "info", file]),
                                      (WEIGHTS, ["detect", self.root / "photos", self.root / "others", "--weights", file,
                                                 *out])):
                line = self.line(run(*arguments, "--progress", "none"), status)
                self.assertIn(f"{file}: expected ", line)
                self.assertIn("a pipe or a device, no ordinary file", line)
        for name in ("pipe.jpg", "pipe.npz", "pipe.mp4"):
            line = self.line(run("detect", self.root / name, self.root / "photos", *out, "--progress", "none"), INPUT)
            self.assertIn(name, line)
        self.assertFalse((self.root / "out").exists())

    @unittest.skipUnless(shutil.which("colmap"), "no COLMAP")
    def test_links_that_lead_nowhere_are_left_out(self):
        write_photos(self.root / "before", 1, 5)
        write_photos(self.root / "after", 11, 5)
        (self.root / "before" / "loop.jpg").symlink_to("loop.jpg")
        (self.root / "before" / "gone.jpg").symlink_to("nowhere.jpg")
        os.mkfifo(self.root / "before" / "pipe.jpg")
        done = run("detect", self.root / "before", self.root / "after", "-o", self.root / "out", "--dry-run")
        self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("loop.jpg", "gone.jpg", "pipe.jpg"):
            self.assertIn(f"{name} is left out: it is a", done.stderr)
        self.assertIn("5 before, 5 after", done.stdout)

    @unittest.skipUnless(shutil.which("colmap"), "no COLMAP")
    def test_a_home_that_cannot_be_entered_has_no_weights(self):
        write_photos(self.root / "before", 1, 5)
        write_photos(self.root / "after", 11, 5)
        (self.root / "loop").symlink_to("loop")
        homes = [self.root / "loop"]
        if os.geteuid() != 0:
            (self.root / "closed").mkdir(mode=0)
            homes.append(self.root / "closed")
        for home in homes:
            done = run("detect", self.root / "before", self.root / "after", "-o", self.root / "out", "--dry-run",
                       env={"HOME": str(home)})
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("classical", done.stdout)

    def test_a_working_folder_that_is_gone_is_named(self):
        gone = self.root / "gone"
        gone.mkdir()

        def leave():
            os.chdir(gone)
            gone.rmdir()

        done = run("detect", *KITCHEN, "-o", "out", "--progress", "none", prepare=leave)
        self.assertIn("out: cannot be written", self.line(done, OUTPUT))
        gone.mkdir()
        done = run("detect", *KITCHEN, "-o", self.root / "absolute", "--progress", "json", prepare=leave)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(all(json.loads(line) for line in done.stderr.splitlines()))


if __name__ == "__main__":
    unittest.main()
