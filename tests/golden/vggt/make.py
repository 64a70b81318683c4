#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the cases of this folder from complete outputs of the reference PyTorch network.

Usage: make.py FOLDER, with FOLDER/tiny/case_*.npz (case_a_half_weights.npz without its images) and FOLDER/full/case_*.npz: one array per stage, in
f32. Inputs and small results are kept whole; of every other array a sample: elements 0, step, 2*step, ..
in C order, with a step that is odd and has no factor in common with the array's dimensions, so that every
frame, token and channel has its share. SAMPLE__name is the sample, SHAPE__name the shape of the whole and
STEP__name the step.
"""
import math
import pathlib
import sys

import numpy as np

WHOLE = {"images", "pose_enc", "extrinsic", "intrinsic"} | {f"pose_enc_iter{i}" for i in range(4)}
LEFT_OUT = {"unprojected_points"}  # tested where unprojection is


def coprime_step(shape, wanted):
    numel = math.prod(shape)
    step = max(1, numel // wanted) | 1
    while math.gcd(step, math.prod(shape)) != 1:
        step += 2
    return step


def reduce_case(source, target, wanted, images_from=None):
    out = {}
    if images_from is not None:
        with np.load(images_from) as data:
            out["images"] = data["images"]
    with np.load(source) as data:
        for key in data.files:
            value = data[key]
            assert value.dtype == np.float32
            if key in LEFT_OUT:
                continue
            if key in WHOLE:
                out[key] = value
                continue
            step = coprime_step(value.shape, wanted)
            out[f"SAMPLE__{key}"] = value.reshape(-1)[::step]
            out[f"SHAPE__{key}"] = np.array(value.shape, np.int64)
            out[f"STEP__{key}"] = np.array([step], np.int64)
    np.savez_compressed(target, **out)
    print(target.name, target.stat().st_size)


def main():
    source, here = pathlib.Path(sys.argv[1]), pathlib.Path(__file__).parent
    for path in sorted((source / "tiny").glob("case_?_s*.npz")):
        reduce_case(path, here / f"tiny_{path.name}", 3000)
    tiny = source / "tiny"
    reduce_case(tiny / "case_a_half_weights.npz", here / "tiny_case_a_half_weights.npz", 3000,
                tiny / "case_a_s3_70x70.npz")
    for path in sorted((source / "full").glob("case_*.npz")):
        reduce_case(path, here / f"full_{path.name}", 6000)


if __name__ == "__main__":
    main()
