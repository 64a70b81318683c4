#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the files of this folder with Python's struct from the published format descriptions of COLMAP
and PLY: what our readers are held against. Usage: make.py"""
import json
import pathlib
import struct

HERE = pathlib.Path(__file__).resolve().parent

CAMERAS = {1: ("PINHOLE", 1, 640, 480, [500.0, 510.0, 320.5, 240.5]),
           7: ("OPENCV", 4, 800, 600, [700.0, 701.0, 400.0, 300.0, 0.1, -0.05, 0.001, 0.002])}
# id: quaternion w x y z, translation, camera, name
IMAGES = {3: ([0.5, 0.5, 0.5, 0.5], [1.0, 2.0, 3.0], 1, "b with space.jpg"),
          12: ([0.8, 0.0, -0.6, 0.0], [-1.0, 0.25, 0.0], 7, "a.jpg"),
          5: ([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1, "c.jpg")}
# position, colour, error, track (image id, 2D point)
POINTS = {9: ([0.5, -1.5, 2.5], [10, 20, 255], 0.75, [(3, 0), (12, 1)]), 4: ([1.0, 1.0, 1.0], [0, 0, 0], 0.0, [])}
POINTS_2D = {3: [(1.5, 2.5, 9), (3.0, 4.0, -1)], 12: [(5.0, 6.0, -1), (7.0, 8.0, 9)], 5: []}


def colmap():
    with open(HERE / "colmap_bin/cameras.bin", "wb") as f:
        f.write(struct.pack("<Q", len(CAMERAS)))
        for key, (_, model, w, h, params) in CAMERAS.items():
            f.write(struct.pack("<IiQQ", key, model, w, h) + struct.pack(f"<{len(params)}d", *params))
    with open(HERE / "colmap_bin/images.bin", "wb") as f:
        f.write(struct.pack("<Q", len(IMAGES)))
        for key, (q, t, camera, name) in IMAGES.items():
            f.write(struct.pack("<I7dI", key, *q, *t, camera) + name.encode() + b"\0")
            f.write(struct.pack("<Q", len(POINTS_2D[key])))
            for x, y, point in POINTS_2D[key]:
                f.write(struct.pack("<ddq", x, y, point))
    with open(HERE / "colmap_bin/points3D.bin", "wb") as f:
        f.write(struct.pack("<Q", len(POINTS)))
        for key, (x, rgb, error, track) in POINTS.items():
            f.write(struct.pack("<Q3d3Bd", key, *x, *rgb, error) + struct.pack("<Q", len(track)))
            for pair in track:
                f.write(struct.pack("<II", *pair))
    words = lambda *values: " ".join(str(v) for v in values) + "\n"
    with open(HERE / "colmap_txt/cameras.txt", "w") as f:
        f.write("# Camera list with one line of data per camera:\n")
        for key, (name, _, w, h, params) in CAMERAS.items():
            f.write(words(key, name, w, h, *params))
    with open(HERE / "colmap_txt/images.txt", "w") as f:
        f.write("# Image list with two lines of data per image:\n")
        for key, (q, t, camera, name) in IMAGES.items():
            f.write(words(key, *q, *t, camera, name))
            f.write(words(*[v for point in POINTS_2D[key] for v in point]))
    with open(HERE / "colmap_txt/points3D.txt", "w") as f:
        for key, (x, rgb, error, track) in POINTS.items():
            f.write(words(key, *x, *rgb, error, *[v for pair in track for v in pair]))


def ply():
    header = ["ply", "format binary_little_endian 1.0", "comment made by Python", "element vertex 3",
              "property double x", "property double y", "property double z", "property float scalar_score",
              "property uchar red", "property uchar green", "property uchar blue", "property int label",
              "property ushort level", "property char sign", "element face 1", "property list uchar int vertex_indices",
              "end_header"]
    with open(HERE / "mixed.ply", "wb") as f:
        f.write(("\n".join(header) + "\n").encode())
        for i in range(3):
            f.write(struct.pack("<dddfBBBiHb", i, -0.5 * i, 2.0 ** i, i / 4, i, 10 * i, 255 - i, -i * 1000, 60000 + i, -i))
        f.write(struct.pack("<Biii", 3, 0, 1, 2))


if __name__ == "__main__":
    colmap()
    ply()
    (HERE / "manifest.json").write_text(json.dumps({
        "colmap_bin, colmap_txt": "one small COLMAP model in both forms; the values are in make.py",
        "mixed.ply": "three vertices with properties of every kind, and a face after them",
        "made_by": "tests/golden/geometry_files/make.py, Python's struct",
        "read_by": ["src/vggtcd/io/colmap_test.cc", "src/vggtcd/io/ply_test.cc"]}, indent=1) + "\n")
