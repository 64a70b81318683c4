#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs `reconstruct` and `weights` as a user does; reads the results with NumPy, an independent reader.

Usage: reconstruct_test.py PROGRAM RECIPE_WEIGHTS GOLDEN_DIR [unittest arguments]
"""
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

from running import HANG_S, signal_at

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
RECIPE_WEIGHTS = pathlib.Path(sys.argv.pop(1)).resolve()
GOLDEN = pathlib.Path(sys.argv.pop(1)).resolve()
PHOTOS = GOLDEN / "preprocess" / "inputs"

INPUT, WEIGHTS, OUTPUT, USAGE = 3, 4, 6, 2  # exit statuses, docs/formats.md


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=HANG_S)


class WithTinyNetwork(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = pathlib.Path(cls.temporary.name)
        cls.weights = cls.root / "tiny.safetensors"
        subprocess.run([RECIPE_WEIGHTS, "tiny", "1", cls.weights], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def reconstruct(self, *arguments):
        out = self.root / "out.npz"
        done = run("reconstruct", *arguments, "-o", out, "--weights", self.weights)
        self.assertEqual(done.returncode, 0, done.stderr)
        with np.load(out) as arrays:
            return dict(arrays), done

    def assert_fails(self, status, words, *arguments):
        """One line on standard error that has these words; the status; nothing left behind."""
        before = sorted(self.root.rglob("*"))
        done = run(*arguments)
        self.assertEqual(done.returncode, status, done.stderr)
        lines = [line for line in done.stderr.splitlines() if line.startswith("vggt-cd: ")]
        self.assertEqual(len(lines), 1, done.stderr)
        for word in words:
            self.assertIn(word, lines[0])
        self.assertEqual(sorted(self.root.rglob("*")), before)


class Reconstruct(WithTinyNetwork):
    def test_equals_the_reference_on_preprocessed_images(self):
        for case in ("tiny_case_a_s3_70x70.npz", "tiny_case_b_s4_56x84.npz", "tiny_case_c_s1_70x70.npz"):
            found, _ = self.reconstruct(GOLDEN / "vggt" / case, "--precision", "f32", "--point-head")
            expected = np.load(GOLDEN / "vggt" / case)
            compared = 0
            for key in expected.files:
                name = key.removeprefix("SAMPLE__")
                if name not in found:
                    continue
                values = found[name]
                if name != key:  # every STEPth element
                    self.assertEqual(list(values.shape), list(expected[f"SHAPE__{name}"]), name)
                    values = values.reshape(-1)[::expected[f"STEP__{name}"][0]]
                error = np.linalg.norm(values.astype("f8") - expected[key])
                self.assertLessEqual(error, 5e-6 * np.linalg.norm(expected[key].astype("f8")), (case, name))
                compared += 1
            self.assertEqual(compared, 8)

    def test_a_folder_of_photos_becomes_a_prediction_file(self):
        folder = self.root / "photos"
        folder.mkdir()
        for number, name in ((10, "01_rgb_640x480.png"), (9, "06_exif_orientation6_400x300.jpg")):
            shutil.copy(PHOTOS / name, folder / f"photo_{number}{pathlib.Path(name).suffix}")
        found, done = self.reconstruct(folder)
        self.assertEqual(list(found["names"]), ["photo_9.jpg", "photo_10.png"])
        # The first one stands upright: 300 x 400 becomes 518 x 518, the other gets white borders.
        self.assertEqual(found["images"].shape, (2, 3, 518, 518))
        self.assertTrue((found["images"][1, :, :63] == 1).all())
        self.assertIn("white borders", done.stderr)
        self.assertIn("GB of memory", done.stderr)
        self.assertEqual(found["extrinsic"].shape, (2, 3, 4))
        self.assertEqual(found["depth"].shape, (2, 518, 518, 1))
        self.assertTrue((found["depth"] > 0).all() and np.isfinite(found["depth"]).all())
        lying, _ = self.reconstruct(folder, "--no-apply-exif-orientation")
        self.assertEqual(lying["images"].shape, (2, 3, 392, 518))
        shutil.rmtree(folder)

    def test_same_bytes_for_any_number_of_threads(self):
        case = GOLDEN / "vggt" / "tiny_case_b_s4_56x84.npz"
        for precision in ("f32", "auto"):
            files = []
            for threads in (1, 2, 3):
                self.reconstruct(case, "--precision", precision, "--threads", threads)
                files.append((self.root / "out.npz").read_bytes())
            self.assertEqual(files[0], files[1])
            self.assertEqual(files[0], files[2])

    def test_a_converted_file_gives_the_bits_of_the_original_where_it_must(self):
        case = GOLDEN / "vggt" / "tiny_case_b_s4_56x84.npz"
        original, _ = self.reconstruct(case, "--precision", "f32")
        converted = self.root / "same.safetensors"
        self.assertEqual(run("weights", "convert", self.weights, "-o", converted, "--precision", "f32").returncode, 0)
        out = self.root / "converted.npz"
        self.assertEqual(run("reconstruct", case, "-o", out, "--weights", converted, "--precision", "f32").returncode, 0)
        with np.load(out) as found:
            for key in original:
                np.testing.assert_array_equal(found[key], original[key], key)
        converted.unlink()
        out.unlink()

    def test_bad_photos_are_one_clear_line(self):
        out, options = self.root / "never.npz", ("--weights", self.weights)
        folder = self.root / "bad"
        folder.mkdir()
        self.addCleanup(shutil.rmtree, folder)
        def fails(words, *photos, status=INPUT):
            self.assert_fails(status, words, "reconstruct", *photos, "-o", out, *options)
        fails(["no such file", "nowhere"], folder / "nowhere")
        fails([str(folder), "expected photos"], folder)
        fails(["PHOTOS"], status=USAGE)
        page = folder / "page.jpg"
        page.write_text("<!DOCTYPE html><title>404</title>")
        fails(["page.jpg", "web page"], page)
        cut = folder / "cut.jpg"
        cut.write_bytes((PHOTOS / "04_portrait_360x640.jpg").read_bytes()[:9000])
        fails(["cut.jpg", "cut off"], cut)
        empty = folder / "empty.jpg"
        empty.write_bytes(b"")
        fails(["empty.jpg", "empty"], empty)
        np.savez(folder / "odd.npz", images=np.zeros((1, 3, 70, 71), "f4"))
        fails(["multiples of 14"], folder / "odd.npz")
        np.savez(folder / "bytes.npz", images=np.full((1, 3, 70, 70), 255, "f4"))
        fails(["bytes.npz", "[0, 1]"], folder / "bytes.npz")

    def test_unwritable_output_fails_before_the_work(self):
        self.assert_fails(OUTPUT, ["none/out.npz"], "reconstruct", PHOTOS, "-o", self.root / "none" / "out.npz",
                          "--weights", self.weights)

    def test_interrupt_leaves_nothing_behind(self):
        before = sorted(self.root.rglob("*"))
        arguments = [PROGRAM, "reconstruct", *[PHOTOS / "01_rgb_640x480.png"] * 12, "-o", self.root / "x.npz",
                     "--weights", self.weights, "--threads", "1"]
        # The plan is told right before the network starts.
        _, others, status = signal_at(
            arguments, lambda e: e["event"] == "notice" and "GB of memory" in e["message"], signal.SIGINT)
        self.assertEqual((status, others), (130, ["vggt-cd: interrupted\n"]))
        self.assertEqual(sorted(self.root.rglob("*")), before)


class Weights(WithTinyNetwork):
    def test_info_counts_tensors_and_names_what_is_wrong(self):
        done = run("weights", "info", self.weights)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"tensors +375, 7\.69 million values")
        self.assertRegex(done.stdout, r"missing +none")
        header, data = self.parts()
        header["depth_head.norm.wait"] = header.pop("depth_head.norm.weight")
        broken = self.root / "broken.safetensors"
        self.write(broken, header, data)
        done = run("weights", "info", broken)
        self.assertEqual(done.returncode, WEIGHTS)
        self.assertIn("depth_head.norm.weight [256]", done.stdout)
        self.assertIn("depth_head.norm.wait", done.stdout)
        self.assertIn("depth_head has 61 of 62 tensors", done.stderr)
        broken.unlink()

    def test_wrapped_and_sharded_checkpoints_are_the_same_network(self):
        header, data = self.parts()
        meta = header.pop("__metadata__", {})
        ddp, hub = self.root / "ddp.safetensors", self.root / "hub"
        self.write(ddp, {"__metadata__": meta, **{"module._orig_mod." + k: v for k, v in header.items()}}, data)
        hub.mkdir()
        names, where = list(header), {}
        for part, some in enumerate((names[::2], names[1::2]), 1):
            file, shard, bytes_ = f"model-0000{part}-of-00002.safetensors", {"__metadata__": meta}, b""
            for name in some:
                begin, end = header[name]["data_offsets"]
                shard[name] = {**header[name], "data_offsets": [len(bytes_), len(bytes_) + end - begin]}
                bytes_ += data[begin:end]
                where[name] = file
            self.write(hub / file, shard, bytes_)
        index = hub / "model.safetensors.index.json"
        index.write_text(json.dumps({"metadata": {"total_size": len(data)}, "weight_map": where}))
        images = self.root / "images.npz"
        np.savez(images, images=np.random.default_rng(1).random((2, 3, 56, 56), dtype=np.float32))
        results = set()
        for weights in (self.weights, ddp, index, hub):
            out = self.root / "o.npz"
            done = run("reconstruct", images, "-o", out, "--weights", weights)
            self.assertEqual(done.returncode, 0, done.stderr)
            results.add(out.read_bytes())
            out.unlink()
        self.assertEqual(len(results), 1)
        done = run("weights", "info", ddp)
        self.assertRegex(done.stdout, r"prefix +module\._orig_mod\. before every name")
        self.assert_fails(WEIGHTS, ["one of 2 shards"], "weights", "info", hub / "model-00001-of-00002.safetensors")
        (hub / "model-00002-of-00002.safetensors").unlink()
        self.assert_fails(WEIGHTS, ["expected its shard"], "weights", "info", hub)
        shutil.rmtree(hub), ddp.unlink(), images.unlink()

    def test_convert_to_bf16_halves_the_file(self):
        out = self.root / "half.safetensors"
        self.assertEqual(run("weights", "convert", self.weights, "-o", out).returncode, 0)
        self.assertLess(out.stat().st_size, 0.51 * self.weights.stat().st_size)
        done = run("weights", "info", out)
        self.assertRegex(done.stdout, r"bf16 99\.\d+ %, f32 0\.\d+ %")
        out.unlink()

    def test_weights_that_are_none_are_one_clear_line(self):
        bad = self.root / "bad.safetensors"
        def fails(words, content, status=WEIGHTS):
            bad.write_bytes(content)
            for command in (("weights", "info", bad), ("weights", "convert", bad, "-o", self.root / "never"),
                            ("reconstruct", PHOTOS, "-o", self.root / "never", "--weights", bad)):
                self.assert_fails(status, ["bad.safetensors", *words], *command)
            bad.unlink()
        whole = self.weights.read_bytes()
        fails(["web page"], b"<html>")
        fails(["Git LFS"], b"version https://git-lfs.github.com/spec/v1\n")
        fails(["empty"], b"")
        fails(["download it again"], whole[:len(whole) // 2])
        fails(["neither"], bytes(100))
        header, data = self.parts()
        header["aggregator.camera_token"]["shape"] = [1, 2, 1, 129]
        self.write(bad, header, data)
        fails(["aggregator.camera_token"], bad.read_bytes())
        self.assert_fails(WEIGHTS, ["no_file"], "weights", "info", self.root / "no_file")

    def parts(self):
        content = self.weights.read_bytes()
        size = struct.unpack("<Q", content[:8])[0]
        return json.loads(content[8:8 + size]), content[8 + size:]

    def write(self, path, header, data):
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 8)
        path.write_bytes(struct.pack("<Q", len(text)) + text + data)


if __name__ == "__main__":
    unittest.main()
