// SPDX-License-Identifier: Apache-2.0
// What lies under the pointer, by projecting everything: some milliseconds a million points, only on a click.
import * as THREE from 'three';
import type { Cloud } from '../data';
import type { Frustum } from './frustums';

export interface PickedPoint { position: THREE.Vector3; level: number; epoch: 'before' | 'after' }

// The frontmost point within radiusPx of the pointer (nearness to the pointer breaks near ties in depth).
export function pickPoint(clouds: { cloud: Cloud; accepts: (level: number, label: number) => boolean }[],
                          camera: THREE.PerspectiveCamera, xPx: number, yPx: number, width: number,
                          height: number, radiusPx: number): PickedPoint | null {
  let best: PickedPoint | null = null;
  let bestCost = Infinity;
  const clipFromWorld = new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix,
    camera.matrixWorldInverse);
  for (const { cloud, accepts } of clouds) {
    const { box_min, box_size, epoch } = cloud.header;
    const m = clipFromWorld.clone()
      .multiply(new THREE.Matrix4().makeTranslation(...box_min))
      .multiply(new THREE.Matrix4().makeScale(box_size[0] / 65535, box_size[1] / 65535,
        box_size[2] / 65535)).elements;
    const q = cloud.positionLevel;
    for (let i = 0; i < q.length; i += 4) {
      const x = q[i]!, y = q[i + 1]!, z = q[i + 2]!;
      const w = m[3]! * x + m[7]! * y + m[11]! * z + m[15]!;
      if (w <= camera.near) continue;
      const dx = ((m[0]! * x + m[4]! * y + m[8]! * z + m[12]!) / w * 0.5 + 0.5) * width - xPx;
      const dy = (0.5 - (m[1]! * x + m[5]! * y + m[9]! * z + m[13]!) / w * 0.5) * height - yPx;
      const r2 = dx * dx + dy * dy;
      if (r2 > radiusPx * radiusPx) continue;
      const cost = w * (1 + 0.02 * Math.sqrt(r2) / radiusPx);
      if (cost >= bestCost || !accepts(q[i + 3]!, cloud.colorLabel[i + 3]!)) continue;
      bestCost = cost;
      best = {
        position: new THREE.Vector3(box_min[0] + (x * box_size[0]) / 65535,
          box_min[1] + (y * box_size[1]) / 65535, box_min[2] + (z * box_size[2]) / 65535),
        level: q[i + 3]!, epoch,
      };
    }
  }
  return best;
}

// The nearest pyramid whose picture or apex is under the pointer.
export function pickFrustum(frustums: Frustum[], camera: THREE.PerspectiveCamera, xPx: number, yPx: number,
                            width: number, height: number): Frustum | null {
  let best: Frustum | null = null;
  let bestDepth = Infinity;
  const project = (p: THREE.Vector3): { x: number; y: number; depth: number } => {
    const depth = -p.clone().applyMatrix4(camera.matrixWorldInverse).z;
    const ndc = p.clone().project(camera);
    return { x: (ndc.x * 0.5 + 0.5) * width, y: (0.5 - ndc.y * 0.5) * height, depth };
  };
  for (const frustum of frustums) {
    const apex = project(frustum.apex);
    const corners = frustum.corners.map(project);
    if (apex.depth <= camera.near || corners.some((c) => c.depth <= camera.near)) continue;
    let inside = Math.hypot(apex.x - xPx, apex.y - yPx) < 8;
    let crossings = false;
    for (let i = 0, j = 3; i < 4; j = i++) {
      const a = corners[i]!, b = corners[j]!;
      if ((a.y > yPx) !== (b.y > yPx) && xPx < ((b.x - a.x) * (yPx - a.y)) / (b.y - a.y) + a.x) {
        crossings = !crossings;
      }
    }
    inside ||= crossings;
    if (inside && apex.depth < bestDepth) {
      bestDepth = apex.depth;
      best = frustum;
    }
  }
  return best;
}
