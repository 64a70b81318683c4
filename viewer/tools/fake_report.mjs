// SPDX-License-Identifier: Apache-2.0
// Makes report pages without the program: a ray-cast room whose furniture moved between two walks. A second,
// independent writer of the data block (docs/formats.md), for the page's own tests and benchmarks.
// Usage: node tools/fake_report.mjs TEMPLATE OUT.html [--points N] [--photos N] [--width PX] [--empty]
import { readFileSync, writeFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import { deflateSync, crc32 as zlibCrc32 } from 'node:zlib';

const kLevels = 250;

// --- a scene of axis-aligned boxes and spheres; y points down, as in a camera's axes ---
const box = (min, max, color, pattern = 0) => ({ min, max, color, pattern });
const ball = (center, radius, color) => ({ center, radius, color });
const room = [
  box([-3, 1.5, -0.5], [3, 1.6, 4.5], [150, 122, 96], 1),   // floor
  box([-3, -1.3, 4.4], [3, 1.5, 4.5], [214, 208, 196], 2),  // wall
  box([-3.1, -1.3, -0.5], [-3, 1.5, 4.5], [196, 204, 206], 2),
  box([-2.8, 0.2, 3.4], [-1.2, 1.5, 4.3], [116, 84, 60], 3),  // chest
  box([-0.4, 0.75, 2.2], [1.2, 0.85, 3.4], [176, 140, 92], 1),  // table
  box([-0.35, 0.85, 2.25], [-0.25, 1.5, 2.35], [90, 72, 50]), box([1.05, 0.85, 2.25], [1.15, 1.5, 2.35], [90, 72, 50]),
  box([-0.35, 0.85, 3.25], [-0.25, 1.5, 3.35], [90, 72, 50]), box([1.05, 0.85, 3.25], [1.15, 1.5, 3.35], [90, 72, 50]),
  box([1.9, -0.6, 3.9], [2.8, 1.5, 4.35], [88, 104, 96], 3),  // shelf
  box([-2.2, -0.75, 4.36], [-1.0, -0.05, 4.41], [64, 92, 120], 3),  // picture
];
const scenes = {
  before: [...room, box([-1.3, 0.95, 1.3], [-0.7, 1.5, 1.9], [178, 62, 48], 3), ball([0.75, 0.57, 2.7], 0.18, [222, 176, 62])],
  after: [...room, box([1.75, 0.95, 2.1], [2.35, 1.5, 2.7], [178, 62, 48], 3),
    box([-0.1, 0.5, 2.6], [0.35, 0.75, 2.9], [70, 110, 78], 3), box([-2.3, -0.1, 3.7], [-1.8, 0.2, 4.0], [60, 96, 150], 2)],
};

function random(seed) {  // mulberry32
  let a = seed >>> 0;
  return () => {
    a = (a + 0x6d2b79f5) >>> 0;
    let t = Math.imul(a ^ (a >>> 15), 1 | a);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

function hit(scene, o, d) {
  let best = Infinity, of = null, axisHit = 0;
  for (const s of scene) {
    if (s.center) {
      const m = [0, 1, 2].map((a) => o[a] - s.center[a]);
      const b = m[0] * d[0] + m[1] * d[1] + m[2] * d[2];
      const dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      const disc = b * b - dd * (m[0] * m[0] + m[1] * m[1] + m[2] * m[2] - s.radius * s.radius);
      const t = disc < 0 ? Infinity : (-b - Math.sqrt(disc)) / dd;
      if (t > 1e-6 && t < best) { best = t; of = s; axisHit = 3; }
      continue;
    }
    let near = -Infinity, far = Infinity, axis = 0;
    for (let a = 0; a < 3; ++a) {
      const t1 = (s.min[a] - o[a]) / d[a], t2 = (s.max[a] - o[a]) / d[a];
      const lo = Math.min(t1, t2), hi = Math.max(t1, t2);
      if (lo > near) { near = lo; axis = a; }
      if (hi < far) far = hi;
    }
    if (near < far && near > 1e-6 && near < best) { best = near; of = s; axisHit = axis; }
  }
  if (!of) return null;
  const p = [0, 1, 2].map((a) => o[a] + best * d[a]);
  let shade = axisHit === 3 ? 0.65 + 0.35 * (of.center[1] - p[1]) / of.radius : [0.8, 1, 0.9][axisHit];
  const c = (k) => Math.floor(p[k] * 4 + 1e-4);
  if (of.pattern === 1) shade *= 0.88 + 0.12 * Math.sin(p[0] * 46 + 2 * Math.sin(p[2] * 3));
  if (of.pattern === 2) shade *= 0.97 + 0.03 * Math.sin(p[1] * 25 + p[0] * 2);
  if (of.pattern === 3) shade *= (c(0) + c(1) + c(2)) & 1 ? 0.82 : 1;
  return { t: best, p, color: of.color.map((v) => Math.min(255, v * shade)) };
}

function distanceTo(scene, p) {
  let best = Infinity;
  for (const s of scene) {
    if (s.center) {
      best = Math.min(best, Math.abs(Math.hypot(p[0] - s.center[0], p[1] - s.center[1], p[2] - s.center[2]) - s.radius));
      continue;
    }
    const q = [0, 1, 2].map((a) => Math.max(s.min[a] - p[a], p[a] - s.max[a]));
    const outside = Math.hypot(Math.max(q[0], 0), Math.max(q[1], 0), Math.max(q[2], 0));
    best = Math.min(best, outside > 0 ? outside : -Math.max(q[0], q[1], q[2]));
  }
  return best;
}

function cameraOf(i, n, epoch) {
  const s = n === 1 ? 0.5 : i / (n - 1);
  const center = epoch === 'before' ? [-2.2 + 4.2 * s, -0.1 - 0.2 * Math.sin(3 * s), -0.9 - 0.5 * Math.sin(Math.PI * s)]
    : [2.0 - 4.4 * s, 0.1 + 0.15 * Math.sin(4 * s), -1.2 - 0.3 * Math.cos(Math.PI * s)];
  const target = [0.1, 0.6, 3.1];
  const norm = (v) => { const l = Math.hypot(...v); return v.map((x) => x / l); };
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const z = norm(target.map((x, a) => x - center[a]));
  const x = norm(cross([0, 1, 0], z));
  const y = cross(z, x);
  return { center, rows: [x, y, z] };
}

// --- binary blocks ---
const crcTable = Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; ++k) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n >>> 0;
});
const crc = zlibCrc32 ?? ((bytes) => {
  let c = 0xffffffff;
  for (const b of bytes) c = crcTable[(c ^ b) & 255] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
});
export function png(width, height, rgb) {
  const chunk = (type, data) => {
    const out = Buffer.alloc(12 + data.length);
    out.writeUInt32BE(data.length, 0);
    out.write(type, 4, 'latin1');
    data.copy(out, 8);
    out.writeUInt32BE(crc(out.subarray(4, 8 + data.length)), 8 + data.length);
    return out;
  };
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 2, 0, 0, 0], 8);
  const raw = Buffer.alloc(height * (1 + 3 * width));
  for (let y = 0; y < height; ++y) raw.set(rgb.subarray(3 * width * y, 3 * width * (y + 1)), y * (1 + 3 * width) + 1);
  return Buffer.concat([Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]), chunk('IHDR', head),
    chunk('IDAT', deflateSync(raw)), chunk('IEND', Buffer.alloc(0))]);
}

function encodeCloud(epoch, points, addBlock, totals) {
  const n = points.length / 7;  // x y z r g b level
  const min = [0, 1, 2].map((a) => { let m = Infinity; for (let i = 0; i < n; ++i) m = Math.min(m, points[7 * i + a]); return n ? m : 0; });
  const size = [0, 1, 2].map((a) => { let m = -Infinity; for (let i = 0; i < n; ++i) m = Math.max(m, points[7 * i + a]); return n ? Math.max(m - min[a], 1e-6) : 1; });
  const position = Buffer.alloc(6 * n), color = Buffer.alloc(3 * n), level = Buffer.alloc(n);
  for (let a = 0; a < 3; ++a) {
    let lastQ = 0, lastC = 0;
    for (let i = 0; i < n; ++i) {
      const q = Math.round(((points[7 * i + a] - min[a]) / size[a]) * 65535);
      const d = ((q - lastQ) << 16) >> 16;
      const z = ((d << 1) ^ (d >> 15)) & 0xffff;
      position[2 * a * n + i] = z & 255;
      position[(2 * a + 1) * n + i] = z >> 8;
      lastQ = q;
      const c = points[7 * i + 3 + a] >> 2;
      color[a * n + i] = (c - lastC) & 63;
      lastC = c;
    }
  }
  for (let i = 0; i < n; ++i) level[i] = points[7 * i + 6];
  return { epoch, points: totals?.points ?? n, shown: n, changed: totals?.changed ?? 0, changed_shown: totals?.changed ?? 0,
    far_away: 0, box_min: min, box_size: size, position: addBlock(deflateSync(position, { level: 6 })),
    color: addBlock(deflateSync(color, { level: 6 })), level: addBlock(deflateSync(level, { level: 6 })) };
}

// points: of both clouds together; photos: of each epoch; name(epoch, i): names of photos.
export function fakeReport({ points = 200000, photos = 12, width = 320, seed = 1, title = 'before → after',
  name = (epoch, i) => `IMG_${epoch === 'before' ? 2041 + i : 3317 + i}.jpg`, summary = {}, labels = false } = {}) {
  const blocks = [];
  const addBlock = (bytes) => blocks.push(bytes.toString('base64')) - 1;
  const next = random(seed);
  const extent = 7.2, tau = 0.01 * extent, bound = 0.02 * extent, thresholdLevel = 125;
  const levelOf = (score) => {
    let c = 0;
    const guess = Math.ceil((score / tau) * thresholdLevel);
    for (c = Math.max(0, guess - 2); c <= kLevels && score > Math.fround((tau * c) / thresholdLevel); ++c);
    return c;
  };
  const height = Math.round(width * 0.75);
  const evidence = {}, clouds = [], photoHeaders = [];
  for (const epoch of ['before', 'after']) {
    const other = scenes[epoch === 'before' ? 'after' : 'before'];
    const above = new Array(kLevels + 1).fill(0);
    let pixels = 0, changedPoints = 0;
    const perPhoto = photos > 0 ? points / 2 / photos : 0;
    const cast = photos > 0 ? Math.max(8, Math.ceil(Math.sqrt((perPhoto * 4) / 3) * 1.02)) : 0;
    const list = [];
    for (let i = 0; i < photos; ++i) {
      const { center, rows } = cameraOf(i, photos, epoch);
      const trace = (w, h, visit) => {
        const f = 0.8 * w, cx = (w - 1) / 2, cy = (h - 1) / 2;
        for (let v = 0; v < h; ++v) for (let u = 0; u < w; ++u) {
          const c = [(u - cx) / f, (v - cy) / f, 1];
          const d = [0, 1, 2].map((a) => rows[0][a] * c[0] + rows[1][a] * c[1] + rows[2][a] * c[2]);
          visit(u, v, hit(scenes[epoch], center, d), d);
        }
      };
      const rgb = new Uint8Array(3 * width * height).fill(24);
      const heat = new Uint8Array(width * height).fill(255);
      let own = 0, ownChanged = 0;
      trace(width, height, (u, v, h) => {
        if (!h) return;
        rgb.set(h.color.map((x) => Math.min(255, x + 10 * (next() - 0.5))), 3 * (v * width + u));
        if (next() < 0.04) return;
        const score = Math.fround(Math.min(bound, Math.abs(distanceTo(other, h.p)) + 0.012 * (next() + next()) * (1 + h.t * 0.1)));
        const level = levelOf(score);
        heat[v * width + u] = level;
        for (let k = 0; k < level && k <= kLevels; ++k) ++above[k];
        ++own;
        if (level > thresholdLevel) ++ownChanged;
      });
      pixels += own;
      trace(cast, Math.ceil(cast * 0.75), (u, v, h, d) => {
        if (!h || list.length / 7 >= (i + 1) * perPhoto) return;
        const noise = 0.006 * h.t * (next() + next() - 1);
        const p = h.p.map((x, a) => x + noise * d[a]);
        const level = levelOf(Math.min(bound, Math.abs(distanceTo(other, p)) + 0.01 * next()));
        if (level > thresholdLevel) ++changedPoints;
        list.push(p[0], p[1], p[2], h.color[0], h.color[1], h.color[2], level);
      });
      const t = rows.map((r) => -(r[0] * center[0] + r[1] * center[1] + r[2] * center[2]));
      photoHeaders.push({ epoch, name: name(epoch, i), width, height,
        camera_from_world: rows.flatMap((r, a) => [...r, t[a]]),
        intrinsics: [0.8 * width, 0.8 * width, (width - 1) / 2, (height - 1) / 2],
        image: { type: 'image/png', block: addBlock(png(width, height, rgb)) },
        heat: { width, height, level: addBlock(deflateSync(Buffer.from(heat))) }, pixels: own, changed: ownChanged });
    }
    evidence[epoch] = { pixels, above };
    clouds.push(encodeCloud(epoch, list, addBlock, { points: list.length / 7, changed: changedPoints }));
  }
  if (labels) {
    for (const cloud of clouds) {
      cloud.label = addBlock(deflateSync(Buffer.alloc(cloud.shown, cloud.epoch === 'before' ? 1 : 2)));
      const { pixels } = evidence[cloud.epoch];
      const tenth = Math.floor(pixels / 10);
      evidence[cloud.epoch].labels = cloud.epoch === 'before' ? [pixels - 4 * tenth, tenth, 0, 3 * tenth, 0]
        : [pixels - 3 * tenth, 0, 2 * tenth, tenth, 0];
    }
  }
  return { format: 'vggt-cd-report', version: 1, generator: 'vggt-cd 0.1.0 (generated example)', title, unit: 'u',
    scene: { extent }, levels: { count: kLevels, threshold: thresholdLevel, threshold_value: tau }, evidence, clouds,
    photos: photoHeaders, sim3: { scale: 1.7312, rotation: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], translation: [0.1, 0, 0] },
    summary: { version: '0.1.0', method: 'paper', alignment: { verdict: 'refined',
      explanation: 'Refined: the median residual fell from 0.0192 to 0.0071 over 61204 static points.',
      median_residual_coarse_u: 0.0192, median_residual_fine_u: 0.0071 },
    options: { method: 'paper', coarse: { max_correspondences: 5000, seed: 0 }, fine: { grid_resolution: 200, static_factor: 3 } },
    ...summary }, blocks };
}

// The same escaping as the program's: nothing in the text can end the element or open another.
export const fill = (template, report) => template.replace('@VGGTCD_REPORT_DATA@',
  () => JSON.stringify(report).replace(/[<>&]/g, (c) => `\\u00${c.charCodeAt(0).toString(16)}`));

if (import.meta.url === pathToFileURL(process.argv[1] ?? '').href) {
  const [template, out] = process.argv.slice(2);
  const flag = (name, fallback) => { const i = process.argv.indexOf(name); return i < 0 ? fallback : Number(process.argv[i + 1]); };
  const report = fakeReport({ points: flag('--points', 200000), photos: flag('--photos', 12), width: flag('--width', 320) });
  writeFileSync(out, fill(readFileSync(template, 'utf8'), report));
}
