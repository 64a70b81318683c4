// SPDX-License-Identifier: Apache-2.0
// Places of change to fly to: the changed points of an epoch, grouped where their voxels touch. Used when
// the result brings no list of changes of its own.
import type { Cloud, Epoch } from './data';

export interface Region {
  epoch: Epoch;
  points: number;
  center: [number, number, number];
  size: [number, number, number];
}

export type IsChanged = (level: number, label: number) => boolean;

export function findRegions(cloud: Cloud, isChanged: IsChanged, voxel: number): Region[] {
  const { box_min, box_size, epoch } = cloud.header;
  const q = cloud.positionLevel;
  const step = box_size.map((size) => size / 65535);
  const dims = box_size.map((size) => Math.floor(size / voxel) + 3);
  const key = (x: number, y: number, z: number): number => (x * dims[1]! + y) * dims[2]! + z;

  // Sums per voxel: count, x y z, min and max.
  const cells = new Map<number, number[]>();
  for (let i = 0; i < q.length; i += 4) {
    if (!isChanged(q[i + 3]!, cloud.colorLabel[i + 3]!)) continue;
    const p = [q[i]! * step[0]!, q[i + 1]! * step[1]!, q[i + 2]! * step[2]!];
    const k = key(Math.floor(p[0]! / voxel) + 1, Math.floor(p[1]! / voxel) + 1,
      Math.floor(p[2]! / voxel) + 1);
    const cell = cells.get(k);
    if (!cell) {
      cells.set(k, [1, ...p, ...p, ...p] as number[]);
    } else {
      cell[0]! += 1;
      for (let a = 0; a < 3; ++a) {
        cell[1 + a]! += p[a]!;
        cell[4 + a] = Math.min(cell[4 + a]!, p[a]!);
        cell[7 + a] = Math.max(cell[7 + a]!, p[a]!);
      }
    }
  }
  // Voxels with a single point or two are noise that would join everything to everything.
  for (const [k, cell] of cells) if (cell[0]! < 3) cells.delete(k);

  const regions: Region[] = [];
  const open = new Set(cells.keys());
  for (const seed of cells.keys()) {
    if (!open.delete(seed)) continue;
    const stack = [seed];
    const sum = [0, 0, 0, 0];
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    while (stack.length > 0) {
      const k = stack.pop()!;
      const cell = cells.get(k)!;
      for (let a = 0; a < 4; ++a) sum[a]! += cell[a]!;
      for (let a = 0; a < 3; ++a) {
        low[a] = Math.min(low[a]!, cell[4 + a]!);
        high[a] = Math.max(high[a]!, cell[7 + a]!);
      }
      for (let dx = -1; dx <= 1; ++dx) {
        for (let dy = -1; dy <= 1; ++dy) {
          for (let dz = -1; dz <= 1; ++dz) {
            const next = k + key(dx, dy, dz);
            if (open.delete(next)) stack.push(next);
          }
        }
      }
    }
    const n = sum[0]!;
    regions.push({
      epoch, points: n,
      center: [0, 1, 2].map((a) => box_min[a]! + sum[1 + a]! / n) as [number, number, number],
      size: [0, 1, 2].map((a) => high[a]! - low[a]!) as [number, number, number],
    });
  }
  return regions;
}

// The largest places of both epochs, largest first; specks below half a percent of the change are left out.
export function largestRegions(clouds: Cloud[], isChanged: IsChanged, extent: number, most: number): Region[] {
  const all = clouds.flatMap((cloud) => findRegions(cloud, isChanged, extent / 64));
  const total = all.reduce((sum, region) => sum + region.points, 0);
  return all.filter((region) => region.points >= Math.max(20, 0.005 * total))
    .sort((a, b) => b.points - a.points).slice(0, most);
}
