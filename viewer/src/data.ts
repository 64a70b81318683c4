// SPDX-License-Identifier: Apache-2.0
// The page's data block: its types and how its binary blocks are decoded (docs/formats.md, "report.html").

export type Epoch = 'before' | 'after';
export const kEpochs: readonly Epoch[] = ['before', 'after'];
export const kNoEvidence = 255;  // level of a pixel that says nothing

// Labels of the visibility method; with the distance method there are none.
export const kLabels = ['unchanged', 'removed', 'added', 'unobserved', 'moved'] as const;
export type Label = (typeof kLabels)[number];
export const isChangedLabel = (label: number): boolean => label === 1 || label === 2 || label === 4;

export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };
export type JsonObject = { [key: string]: Json };

export interface CloudHeader {
  epoch: Epoch;
  points: number;         // points of the result
  shown: number;          // of them in this page
  changed: number;
  changed_shown: number;
  far_away: number;       // not in the page: outside the box
  box_min: [number, number, number];
  box_size: [number, number, number];
  position: number;       // block
  color: number;          // block
  level: number;          // block
  label?: number;         // block
}

export interface PhotoHeader {
  epoch: Epoch;
  name: string;
  width: number;
  height: number;
  camera_from_world: number[] | null;  // [R | t], 3 x 4 row-major
  intrinsics: [number, number, number, number] | null;  // fx fy cx cy, px
  image: { type: 'image/jpeg' | 'image/png'; block: number } | null;
  heat: { width: number; height: number; level: number; label?: number } | null;
  pixels: number;   // with evidence
  changed: number;  // of them changed at the threshold of the result
}

export interface Change {
  name?: string;
  epoch?: Epoch;
  class?: string;
  center: [number, number, number];
  size: [number, number, number];
  volume_u3?: number;  // or, in metres:
  volume_m3?: number;
  volume_sigma_u3?: number;
  volume_sigma_m3?: number;
  confidence?: number;
  share?: number;
}

export interface Report {
  format: 'vggt-cd-report';
  version: 1;
  generator: string;
  title: string;
  unit: string;
  scene: { extent: number };
  levels: { count: number; threshold: number; threshold_value: number };
  // above[k]: pixels whose score is above edge k, for k = 0 .. levels.count
  // labels[l]: pixels with label l, where the method gives labels.
  evidence: Record<Epoch, { pixels: number; above: number[]; labels?: number[] }>;
  clouds: CloudHeader[];
  photos: PhotoHeader[];
  summary: JsonObject;
  sim3: JsonObject | null;
  changes?: Change[];
  blocks: string[];
}

export interface Cloud {
  header: CloudHeader;
  positionLevel: Uint16Array;  // [n, 4]: x y z in the box, level
  colorLabel: Uint8Array;      // [n, 4]: r g b, label (255: none)
}

export class ReportError extends Error {}

export function parseReport(text: string): Report {
  let parsed: Report;
  try {
    parsed = JSON.parse(text) as Report;
  } catch {
    throw new ReportError('The data of this page is incomplete or damaged.');
  }
  if (parsed.format !== 'vggt-cd-report' || parsed.version !== 1) {
    throw new ReportError('The data of this page is of another format than the page itself.');
  }
  return parsed;
}

function fromBase64(text: string): Uint8Array<ArrayBuffer> {
  const modern = Uint8Array as unknown as { fromBase64?: (text: string) => Uint8Array<ArrayBuffer> };
  if (modern.fromBase64) return modern.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

async function inflate(report: Report, block: number, size: number): Promise<Uint8Array> {
  if (typeof DecompressionStream === 'undefined') {
    throw new ReportError('This browser is too old to unpack points and heat maps (no DecompressionStream).');
  }
  const packed = fromBase64(report.blocks[block] ?? '');
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  if (bytes.length !== size) {
    throw new ReportError(`Block ${block} of this page has ${bytes.length} bytes instead of ${size}.`);
  }
  return bytes;
}

export async function decodeCloud(report: Report, header: CloudHeader): Promise<Cloud> {
  const n = header.shown;
  const [position, color, level, label] = await Promise.all([
    inflate(report, header.position, 6 * n),
    inflate(report, header.color, 3 * n),
    inflate(report, header.level, n),
    header.label === undefined ? null : inflate(report, header.label, n),
  ]);
  const positionLevel = new Uint16Array(4 * n);
  for (let axis = 0; axis < 3; ++axis) {
    const low = position.subarray(2 * axis * n, (2 * axis + 1) * n);
    const high = position.subarray((2 * axis + 1) * n, (2 * axis + 2) * n);
    let value = 0;
    for (let i = 0; i < n; ++i) {
      const zigzag = low[i]! | (high[i]! << 8);
      value = (value + ((zigzag >> 1) ^ -(zigzag & 1))) & 0xffff;
      positionLevel[4 * i + axis] = value;
    }
  }
  const colorLabel = new Uint8Array(4 * n);
  for (let channel = 0; channel < 3; ++channel) {
    const plane = color.subarray(channel * n, (channel + 1) * n);
    let value = 0;
    for (let i = 0; i < n; ++i) {
      value = (value + plane[i]!) & 63;
      colorLabel[4 * i + channel] = (value << 2) | (value >> 4);
    }
  }
  for (let i = 0; i < n; ++i) {
    positionLevel[4 * i + 3] = level[i]!;
    colorLabel[4 * i + 3] = label ? label[i]! : 255;
  }
  return { header, positionLevel, colorLabel };
}

export interface Heat {
  width: number;
  height: number;
  level: Uint8Array;
  label: Uint8Array | null;
}

export async function decodeHeat(report: Report, photo: PhotoHeader): Promise<Heat | null> {
  if (!photo.heat) return null;
  const { width, height, level, label } = photo.heat;
  return {
    width, height,
    level: await inflate(report, level, width * height),
    label: label === undefined ? null : await inflate(report, label, width * height),
  };
}

// An address of the photo that is good until the page is closed; made once, on first use.
const urls = new Map<PhotoHeader, string>();
export function photoUrl(report: Report, photo: PhotoHeader): string | null {
  if (!photo.image) return null;
  let url = urls.get(photo);
  if (!url) {
    const type = photo.image.type === 'image/png' ? 'image/png' : 'image/jpeg';
    url = URL.createObjectURL(new Blob([fromBase64(report.blocks[photo.image.block] ?? '')], { type }));
    urls.set(photo, url);
  }
  return url;
}

// The score at edge k, in scene units.
export const edgeValue = (report: Report, k: number): number =>
  report.levels.threshold_value * (k / report.levels.threshold);

export interface ChangedCount { changed: number; pixels: number }

// Counted on every pixel of the result, not on the points that the page holds.
export function changedPixels(report: Report, k: number, epochs: readonly Epoch[] = kEpochs): ChangedCount {
  let changed = 0;
  let pixels = 0;
  for (const epoch of epochs) {
    changed += report.evidence[epoch].above[k] ?? 0;
    pixels += report.evidence[epoch].pixels;
  }
  return { changed, pixels };
}

export const hasLabels = (report: Report): boolean => kEpochs.some((epoch) => report.evidence[epoch].labels !== undefined);

// Pixels by label. Unobserved ones are no evidence either way: shares are of the pixels that were judged.
export interface LabelCount { byLabel: Record<Label, number>; changed: number; judged: number; all: number }
export function labelledPixels(report: Report, epochs: readonly Epoch[] = kEpochs): LabelCount {
  const byLabel = { unchanged: 0, removed: 0, added: 0, unobserved: 0, moved: 0 };
  for (const epoch of epochs) {
    kLabels.forEach((label, i) => { byLabel[label] += report.evidence[epoch].labels?.[i] ?? 0; });
  }
  const changed = byLabel.removed + byLabel.added + byLabel.moved;
  const judged = changed + byLabel.unchanged;
  return { byLabel, changed, judged, all: judged + byLabel.unobserved };
}

// The centre of a camera in the world and its axes (columns: right, down, forward).
export interface Pose { center: [number, number, number]; rotation: number[] }
export function poseOf(photo: PhotoHeader): Pose | null {
  const m = photo.camera_from_world;
  if (!m || m.length !== 12 || m.some((value) => !Number.isFinite(value))) return null;
  const r = [m[0]!, m[1]!, m[2]!, m[4]!, m[5]!, m[6]!, m[8]!, m[9]!, m[10]!];
  const t = [m[3]!, m[7]!, m[11]!];
  const center = [0, 1, 2].map((c) => -(r[c]! * t[0]! + r[3 + c]! * t[1]! + r[6 + c]! * t[2]!));
  return { center: center as [number, number, number], rotation: r };
}
