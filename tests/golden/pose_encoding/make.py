#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes pose_encoding.json from FOLDER/pose_encoding.npz as the reference made it. Usage: make.py FOLDER."""
import json
import pathlib
import sys

import numpy as np


def main():
    with np.load(pathlib.Path(sys.argv[1]) / "pose_encoding.npz") as data:
        rows = [i for i in range(64) if i < 12 or i % 4 == 0]
        out = {
            key: [[float(f"{v:.9g}") for v in row.reshape(-1)] for row in data[key][rows]]
            for key in ("pose_enc", "extrinsic", "intrinsic_392x518", "intrinsic_70x98")
        }
    text = json.dumps(out).replace("]], ", "]],\n ").replace("], [", "],\n  [")
    (pathlib.Path(__file__).parent / "pose_encoding.json").write_text(text + "\n")


if __name__ == "__main__":
    main()
