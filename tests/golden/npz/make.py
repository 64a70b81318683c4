#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the files of this folder with NumPy and Python's zipfile: what our readers are held against.
Usage: make.py (with python3-numpy); then git diff shows whether anything changed."""
import json
import pathlib
import zipfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
EPOCH = (1980, 1, 1, 0, 0, 0)


def save(name, arrays, deflate=False, zip64=False, version=None):
    """As numpy.savez does, but with a fixed time stamp; zip64 writes ZIP64 records for small members."""
    limit = zipfile.ZIP64_LIMIT
    if zip64:
        zipfile.ZIP64_LIMIT = 16
    method = zipfile.ZIP_DEFLATED if deflate else zipfile.ZIP_STORED
    with zipfile.ZipFile(HERE / name, "w", method, allowZip64=True) as archive:
        for key, array in arrays.items():
            info = zipfile.ZipInfo(key + ".npy", EPOCH)
            info.compress_type = method
            with archive.open(info, "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(array), version=version)
    zipfile.ZIP64_LIMIT = limit


def types():
    """Every type of element; the test knows the formulas."""
    ramp = np.arange(12).reshape(3, 4)
    arrays = {
        "f16": (ramp * 0.25 - 1).astype("<f2"), "f32": (ramp * 0.1).astype("<f4"), "f64": ramp / 7.0,
        "i8": (ramp - 5).astype("i1"), "i16": (ramp * -1000).astype("<i2"),
        "i32": (ramp * 100000000).astype("<i4"), "i64": ramp * 10**17,
        "u8": (ramp * 20).astype("u1"), "u16": (ramp * 5000).astype("<u2"),
        "u32": (ramp * 300000000).astype("<u4"), "u64": np.array([1, 2**63], "<u8"),
        "bool": ramp % 3 == 0,
        "scalar": np.float32(2.5), "empty": np.zeros((0, 5), "<f4"), "line": np.arange(5, dtype="<f4"),
        "fortran": np.asfortranarray(np.arange(24, dtype="<f4").reshape(2, 3, 4)),
        "fortran_f64": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        "big": ramp.astype(">f4"), "complex": ramp.astype("<c8"),
        "struct": np.zeros(2, [("a", "<f4"), ("b", "<i4", (2,))]),
        "object": np.array([None, {"a": 1}], dtype=object), "none": np.array(None, dtype=object),
        "text": np.array(["a.jpg", "Stra\u00dfe \u6771\u4eac \U0001f600", ""]),
        "bytes": np.array([b"left", b"r"]),
    }
    save("types_stored.npz", arrays)
    save("types_deflated_zip64.npz", arrays, deflate=True, zip64=True)
    plain = {key: arrays[key] for key in ("f32", "fortran", "text")}
    save("version_2.npz", plain, version=(2, 0))
    save("version_3.npz", plain, version=(3, 0))


def scene():
    """Four cameras around a bumpy depth map, H x W = 6 x 8, as the programs save it."""
    rng = np.random.default_rng(5)
    s, h, w = 4, 6, 8
    camera_from_world = np.zeros((s, 4, 4))
    for i in range(s):
        a, b = 0.4 * i, -0.1 * i
        ry = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
        rx = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
        camera_from_world[i] = np.eye(4)
        camera_from_world[i, :3, :3] = rx @ ry
        camera_from_world[i, :3, 3] = [0.5 * i, -0.2 * i, 0.3 * i * i]
    intrinsic = np.tile(np.array([[9.0, 0, 4], [0, 8.5, 3], [0, 0, 1]]), (s, 1, 1))
    intrinsic[:, 0, 0] += np.arange(s)
    depth = 2 + rng.random((s, h, w))
    confidence = 1 + rng.exponential(size=(s, h, w))
    image = rng.integers(0, 256, (s, h, w, 3)).astype(np.uint8)
    v, u = np.mgrid[0:h, 0:w]
    points = np.zeros((s, h, w, 3))
    for i in range(s):
        rays = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(intrinsic[i]).T
        x_in_camera = rays * depth[i][..., None]
        rotation, translation = camera_from_world[i, :3, :3], camera_from_world[i, :3, 3]
        points[i] = (x_in_camera - translation) @ rotation
    f4 = lambda array: array.astype("<f4")
    vggt = {
        "pose_enc": f4(np.zeros((s, 9))), "depth": f4(depth)[..., None], "depth_conf": f4(confidence),
        "world_points": f4(points + 0.01 * rng.standard_normal(points.shape)),
        "world_points_conf": f4(confidence), "images": f4(image.transpose(0, 3, 1, 2) / 255.0),
        "extrinsic": f4(camera_from_world[:, :3]), "intrinsic": f4(intrinsic),
        "world_points_from_depth": f4(points), "pose_enc_list": np.array(None, dtype=object),
    }
    save("vggt.npz", vggt)
    mask = np.ones((s, h, w), bool)
    mask[1, 2, 3:5] = False
    save("mapanything.npz", {
        "extrinsic": f4(np.linalg.inv(camera_from_world)), "intrinsic": f4(intrinsic),
        "world_points": f4(points), "depth": f4(depth)[..., None], "images": f4(image / 255.0),
        "final_mask": mask, "conf": f4(confidence)}, deflate=True)
    save("depth_anything_3.npz", {
        "image": image, "depth": f4(depth), "conf": f4(confidence),
        "extrinsics": f4(camera_from_world[:, :3]), "intrinsics": f4(intrinsic)}, deflate=True)
    half = {key: value.astype("<f2") for key, value in vggt.items()
            if key in ("depth", "depth_conf", "images", "extrinsic", "intrinsic", "world_points_from_depth")}
    save("vggt_half.npz", half, deflate=True)
    save("truth.npz", {"points": points, "camera_from_world": camera_from_world, "intrinsic": intrinsic,
                       "depth": depth, "confidence": confidence, "image": image})


if __name__ == "__main__":
    types()
    scene()
    np.save(HERE / "f32_2x3.npy", np.arange(6, dtype="<f4").reshape(2, 3))
    np.save(HERE / "f64_fortran_4x3x4.npy", np.asfortranarray(np.arange(48.0).reshape(4, 3, 4)))
    (HERE / "manifest.json").write_text(json.dumps({
        "types_*.npz, version_*.npz, *.npy": "arrays of every type and header version; the formulas are in make.py",
        "vggt.npz, vggt_half.npz, mapanything.npz, depth_anything_3.npz":
            "one small scene as the four programs save it",
        "truth.npz": "that scene in double precision, with its points",
        "made_by": f"tests/golden/npz/make.py with NumPy {np.__version__}",
        "read_by": [f"src/vggtcd/io/{name}_test.cc" for name in ("npy", "npz", "predictions")],
    }, indent=1) + "\n")
