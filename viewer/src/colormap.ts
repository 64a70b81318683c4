// SPDX-License-Identifier: Apache-2.0
// The colours of change. Below the threshold a point is static and stays in the cold part of the map;
// from the threshold to the end of the scale it runs through the warm part.

import { kNoEvidence, type Label } from './data';

export type Rgb = [number, number, number];
export type MapName = 'spectrum' | 'safe';

interface ColorMap { title: string; still: Rgb[]; changed: Rgb[] }

export const kMaps: Record<MapName, ColorMap> = {
  spectrum: {
    title: 'Blue to red',
    still: [[52, 82, 150], [78, 118, 190], [122, 168, 220]],
    changed: [[70, 176, 92], [232, 207, 58], [226, 120, 44], [200, 32, 38]],
  },
  // One hue axis (blue to yellow) and lightness that only rises: readable with any colour vision, and in grey.
  safe: {
    title: 'Colour-blind safe',
    still: [[0, 34, 78], [38, 60, 108], [72, 84, 110]],
    changed: [[148, 138, 116], [194, 174, 92], [232, 208, 60], [255, 236, 90]],
  },
};

// Grey is what stayed; vermilion, green and purple of Okabe and Ito's set are apart for any colour vision.
export const kLabelColors: Record<Label, Rgb> = {
  unchanged: [164, 173, 186],
  removed: [213, 94, 0],
  added: [0, 158, 115],
  unobserved: [92, 97, 106],
  moved: [190, 100, 160],
};

export const kEpochColors: Record<'before' | 'after', Rgb> = {
  before: [230, 159, 0],
  after: [86, 180, 233],
};

export const css = ([r, g, b]: Rgb): string => `rgb(${Math.round(r)} ${Math.round(g)} ${Math.round(b)})`;

function along(ramp: Rgb[], t: number): Rgb {
  const x = Math.min(Math.max(t, 0), 1) * (ramp.length - 1);
  const i = Math.min(Math.floor(x), ramp.length - 2);
  const a = ramp[i]!;
  const b = ramp[i + 1]!;
  return [0, 1, 2].map((c) => a[c]! + (b[c]! - a[c]!) * (x - i)) as Rgb;
}

// The colour of a level (0 .. count + 1; a level is above edge k when level > k).
export function levelColor(map: MapName, level: number, threshold: number, count: number): Rgb {
  const { still, changed } = kMaps[map];
  if (level <= threshold) return along(still, threshold > 0 ? level / threshold : 0);
  return along(changed, (level - threshold - 1) / Math.max(1, count - threshold));
}

// [256, 4] RGBA by level, for a texture or for painting pixels.
export function levelTable(map: MapName, threshold: number, count: number): Uint8Array<ArrayBuffer> {
  const table = new Uint8Array(256 * 4).fill(kLabelColors.unobserved[1]);  // grey where no distance is known
  for (let level = 0; level < kNoEvidence; ++level) {
    table.set([...levelColor(map, level, threshold, count), 255], 4 * level);
  }
  return table;
}
