#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The same work in scipy and numpy, on the points that neighbors_bench wrote; compares the answers and prints the
table of ratios. Usage: neighbors_peer.py DIRECTORY (from bench/run_neighbors)"""
import json
import pathlib
import sys
import time

import numpy as np
from scipy.spatial import cKDTree

# Of the queries, a random share; all points are in the tree.
SAMPLE = 0.02


class Stopwatch:
    """Wall-clock and processor seconds (of all threads)."""

    def __init__(self):
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def cost(self):
        return np.array([time.perf_counter() - self.wall, time.process_time() - self.cpu])


def cost_of(entry):
    return np.array([entry["wall_s"], entry["cpu_s"]])


def read(path, shape=(-1,)):
    return np.fromfile(path, np.float32).reshape(shape)


def bulk(directory, bound):
    """Cost of building; of all queries, scaled from a random sample, asked in the random order and sorted into the order
    of the pixels, which is kind to caches; and the largest difference to our distances relative to the bound."""
    clouds = [read(directory / f"filtered_t{i}.f32", (-1, 3)) for i in (1, 2)]
    ours = [read(directory / f"distance_t{i}.f32") for i in (1, 2)]
    random = np.random.default_rng(1)
    build, in_random_order, in_pixel_order, worst = np.zeros(2), np.zeros(2), np.zeros(2), 0
    for epoch in (0, 1):
        stopwatch = Stopwatch()
        tree = cKDTree(clouds[1 - epoch])
        build += stopwatch.cost()
        points = clouds[epoch]
        sample = random.choice(len(points), int(SAMPLE * len(points)), replace=False)
        for order, cost in ((sample, in_random_order), (np.sort(sample), in_pixel_order)):
            queries = points[order]
            stopwatch = Stopwatch()
            distance, _ = tree.query(queries, k=1, distance_upper_bound=bound, workers=2)
            cost += stopwatch.cost() * len(points) / len(sample)
            worst = max(worst, np.abs(np.minimum(distance, bound) - ours[epoch][order]).max() / bound)
    return build, in_random_order, in_pixel_order, worst


def voxel_representatives(points, confidence, size):
    """Most confident point of each voxel, lowest index first among equals: one packed key, one lexsort."""
    voxel = np.floor(points.astype(np.float64) / size).astype(np.int64)
    voxel -= voxel.min(axis=0)
    shape = voxel.max(axis=0) + 1
    key = (voxel[:, 0] * shape[1] + voxel[:, 1]) * shape[2] + voxel[:, 2]
    order = np.lexsort((-confidence, key))
    key = key[order]
    first = np.concatenate(([True], key[1:] != key[:-1]))
    return order[first]


def downsample(points, confidence):
    keep = confidence > np.median(confidence)
    points, confidence = points[keep], confidence[keep]
    low, high = np.percentile(points, (1, 99), axis=0)
    return points[voxel_representatives(points, confidence, float((high - low).max()) / 200)]


def fine(directory, coarse):
    clouds = [read(directory / f"all_t{i}.f32", (-1, 3)) for i in (1, 2)]
    confidences = [read(directory / f"confidence_t{i}.f32") for i in (1, 2)]
    matrix = np.array(coarse["scaled_rotation"]).reshape(3, 3)
    stopwatch = Stopwatch()
    t1, t2 = (downsample(p, c) for p, c in zip(clouds, confidences))
    turned = t1.astype(np.float64) @ matrix.T
    tree = cKDTree(t2)
    distance, nearest = tree.query(turned + coarse["translation"], workers=2)
    static = distance < 3 * np.median(distance)
    translation = (t2[nearest[static]].astype(np.float64) - turned[static]).mean(axis=0)
    refined, _ = tree.query(turned + translation, workers=2)
    if not np.median(refined) < np.median(distance):
        translation = np.array(coarse["translation"])
    return stopwatch.cost(), [len(t1), len(t2)], int(static.sum()), translation


def row(name, build, query, ours):
    total = build + query
    print(f"  {name:<37}" + "".join(f"{w:8.2f}{c:8.2f}" for w, c in (build, query, total)) +
          f"   {total[0] / ours[0]:6.1f}x {total[1] / ours[1]:6.1f}x")


def main():
    directory = pathlib.Path(sys.argv[1])
    ours = json.loads((directory / "ours.json").read_text())
    bound = ours["bound"]
    mine = cost_of(ours["ours"]["build"]), cost_of(ours["ours"]["query"])
    nanoflann = ours["nanoflann"]
    build, in_random_order, in_pixel_order, worst = bulk(directory, bound)
    points, median = ours["points"], ours["median_of_extent"]
    print(f"Nearest neighbours both ways, {points[0]} against {points[1]} points, bound 0.02 of the extent, "
          f"{ours['threads']} threads, {ours['isa']}")
    print(f"  median distance {100 * median[0]:.2f} % and {100 * median[1]:.2f} % of the extent, "
          f"{100 * ours['beyond_bound'] / sum(points):.1f} % beyond the bound")
    print("  seconds: wall, processor" + " " * 17 + "build         queries           total"
          "      ratio: wall, processor")
    row("vggtcd", *mine, sum(mine))
    row(f"nanoflann, leaves of {nanoflann['leaf_size']}", cost_of(nanoflann["build"]),
        cost_of(nanoflann["query"]), sum(mine))
    row("scipy, random 2 % of the queries", build, in_random_order, sum(mine))
    row("scipy, the same in order of pixels", build, in_pixel_order, sum(mine))
    print(f"  different from brute force (400 samples each way): {ours['differ_from_brute_force']}; "
          f"from nanoflann (all): {ours['differ_from_nanoflann']}; "
          f"largest difference from scipy: {worst:.1e} of the bound")

    cost, points, static, translation = fine(directory, ours["coarse"])
    mine = ours["fine"]
    own = cost_of(mine["cost"])
    print("Fine stage: median confidence filter, voxel grid, Algorithm 1; wall, processor")
    print(f"  vggtcd (unprojection included) {own[0]:.2f} {own[1]:.2f} s, numpy and scipy "
          f"{cost[0]:.2f} {cost[1]:.2f} s: {cost[0] / own[0]:.1f}x {cost[1] / own[1]:.1f}x")
    shift = np.abs(translation - mine["translation"]).max()
    print(f"  points {mine['points']} and {points}, static {mine['static_points']} and {static}, "
          f"translations differ by {shift:.1e}")
    # Ours rounds mapped points to float, scipy does not: a tie or a threshold may fall the other way.
    failed = (ours["differ_from_brute_force"] or ours["differ_from_nanoflann"] or worst > 1e-4 or
              mine["points"] != points or shift > 1e-6)
    sys.exit("the answers differ" if failed else 0)


if __name__ == "__main__":
    main()
