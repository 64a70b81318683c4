#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Kills detect at random moments (SIGKILL) while it works into an OUT that holds earlier results and files of somebody
else. Every time: those files are there with the same bytes, and the next run gives what an undisturbed run gives, and
leaves nothing else behind.

Half of the moments lie anywhere in the run, half within the few milliseconds in which files are put in place (they begin
when the list of results changes). Nothing depends on hitting a certain one: what is checked holds at all of them.

Usage: kill_test.py PROGRAM EXAMPLE_DIR [--moments N] [--photos N] [--seed S]
  --moments N   kills with the bundled predictions (10)
  --photos N    kills with photos of a generated scene, without a network (0)
"""
import argparse
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

FOREIGN = {
    "notes.txt": b"measured on site: 2.40 m\n",
    ".hidden": b"of a file manager",
    "monday/IMG_0001.jpg": b"\xff\xd8 not ours \xff\xd9",
    "overlays/before/annotated.png": b"drawn by hand",
    "overlays/0001.png": b"beside our folders",
    "colmap/database.db": b"of another program" * 1000,
    "summary.json.bak": b"{}",
}


def content(out):
    """The files of OUT by name (not .stages)."""
    files = {}
    for path in sorted(p for p in out.rglob("*") if p.is_file()):
        name = str(path.relative_to(out))
        if not name.startswith(".stages/"):
            files[name] = path.read_bytes()
    return files


def put_foreign(out):
    for name, data in FOREIGN.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(data)


def check_foreign(out, when):
    for name, data in FOREIGN.items():
        path = out / name
        assert path.is_file(), f"{when}: {name} is gone"
        assert path.read_bytes() == data, f"{when}: {name} has changed"


class Job:
    def __init__(self, arguments, out):
        self.command = [*map(str, arguments), "-o", str(out), "--progress", "none"]
        self.out = out
        self.environment = {**os.environ, "VGGTCD_WEIGHTS": "", "HOME": "/nonexistent"}

    def start(self):
        return subprocess.Popen(self.command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=self.environment)

    def finish(self, when):
        process = self.start()
        _, said = process.communicate(timeout=1000)
        assert process.returncode == 0, f"{when}: the next run ended with {process.returncode}: {said.decode()}"

    def kill_after(self, seconds):
        process = self.start()
        try:
            process.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
        process.communicate()
        return process.returncode

    def kill_in_place(self, seconds):
        """Kills so long after the first file of OUT was touched at the end of the run."""
        listed = self.out / ".vggt-cd-results"
        before = listed.stat().st_ino
        process = self.start()
        while listed.stat().st_ino == before and process.poll() is None:
            pass
        until = time.perf_counter() + seconds
        while time.perf_counter() < until:
            pass
        process.kill()
        process.communicate()
        return process.returncode


def run(job, moments, chance, label):
    began = time.perf_counter()
    job.finish(f"{label}: first run")
    undisturbed = content(job.out)
    put_foreign(job.out)
    expected = {**undisturbed, **FOREIGN}
    again = time.perf_counter()
    job.finish(f"{label}: second run")
    whole = time.perf_counter() - (again if job.out.joinpath(".stages").exists() is False else began)
    check_foreign(job.out, f"{label}: second run")
    assert content(job.out) == expected, f"{label}: the second run differs"
    killed = mixed = 0
    for number in range(1, moments + 1):
        if job.out.joinpath(".stages").exists() and chance.random() < 0.5:
            shutil.rmtree(job.out / ".stages")  # the whole job, not only what follows the stages
        in_place = number % 2 == 0
        seconds = 10 ** chance.uniform(-6, -2) if in_place else chance.uniform(0, whole)
        when = f"{label}: kill {number}, {seconds:.6f} s {'into putting in place' if in_place else 'into the run'}"
        status = job.kill_in_place(seconds) if in_place else job.kill_after(seconds)
        killed += status == -9
        check_foreign(job.out, when)
        # Where summary.json is, the results are whole.
        names = set(content(job.out))
        mixed += not set(undisturbed) <= names
        assert "summary.json" not in names or set(undisturbed) <= names, f"{when}: {set(undisturbed) - names} missing"
        job.finish(when)
        check_foreign(job.out, when + ", then a whole run")
        found = content(job.out)
        assert set(found) == set(expected), f"{when}: {set(found) ^ set(expected)}"
        assert found == expected, f"{when}: other bytes in {[n for n in found if found[n] != expected[n]]}"
    print(f"{label}: {killed} of {moments} runs were killed ({mixed} while files were moved), "
          f"all {len(FOREIGN)} foreign files are there, every next run gave the same bytes")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("example", type=pathlib.Path)
    parser.add_argument("--moments", type=int, default=10)
    parser.add_argument("--photos", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program, example = options.program.resolve(), options.example.resolve()
    chance = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as temporary:
        root = pathlib.Path(temporary)
        if options.moments:
            predictions = [example / "t1.npz", example / "t2.npz", "--joint", example / "joint.npz"]
            run(Job([program, "detect", *predictions, "--method", "coarse"], root / "out"), options.moments, chance,
                "predictions")
        if options.photos and shutil.which("colmap"):
            scene = root / "scene"
            subprocess.run([program, "synthesize", scene, "--scene", "kitchen", "--frames", "8", "--width", "168",
                            "--no-wat", "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
            run(Job([program, "detect", scene / "before", scene / "after", "--frame-side", "168"], root / "photos"),
                options.photos, chance, "photos")
        assert sorted(p.name for p in root.iterdir()) == sorted(
            name for name, made in (("out", options.moments), ("photos", options.photos and shutil.which("colmap")),
                                    ("scene", options.photos and shutil.which("colmap"))) if made)
    return 0


if __name__ == "__main__":
    sys.exit(main())
