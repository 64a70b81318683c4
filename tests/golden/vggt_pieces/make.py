#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes pieces.npz: values of parts of the network too small to be seen in its outputs alone.

Usage: make.py FOLDER, with FOLDER/positional.npz and FOLDER/activations.npz as the reference made them. Of
the position grids every fourth channel is kept (channels do not mix).
"""
import pathlib
import sys

import numpy as np


def main():
    source, here = pathlib.Path(sys.argv[1]), pathlib.Path(__file__).parent
    out = {}
    with np.load(source / "positional.npz") as data:
        for key in data.files:
            if key.startswith(("pos_grid", "interp")):
                out[key] = np.ascontiguousarray(data[key][..., ::4])
            elif key.startswith("dpt_pos"):
                out[key] = data[key]
    with np.load(source / "activations.npz") as data:
        out.update({key: data[key] for key in data.files if not key.startswith("pose")})
    np.savez_compressed(here / "pieces.npz", **out)


if __name__ == "__main__":
    main()
