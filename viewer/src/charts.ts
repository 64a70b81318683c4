// SPDX-License-Identifier: Apache-2.0
// The histogram of distances and the map of the trajectories, as SVG.
import { css, kEpochColors, levelColor, type MapName } from './colormap';
import { edgeValue, kEpochs, poseOf, type Epoch, type Report } from './data';
import { svg } from './dom';
import { count, number } from './format';

// Pixels per bin of a few edges, stacked over both epochs; heights are square roots, so that the thin tail
// beyond the threshold stays visible next to the static bulk.
export class Histogram {
  readonly root: SVGSVGElement;
  private readonly bars: { rect: SVGRectElement; level: number }[] = [];
  private readonly line: SVGLineElement;
  private readonly bins = 50;
  private readonly width = 500;

  constructor(private readonly report: Report, height: number) {
    this.root = svg('svg', { viewBox: `0 0 ${this.width} ${height}`, preserveAspectRatio: 'none',
      class: 'histogram', role: 'img', 'aria-label': 'Histogram of distances of both epochs' });
    const { count: levels } = report.levels;
    const heights: number[] = [];
    for (let bin = 0; bin < this.bins; ++bin) {
      const from = Math.round((bin * levels) / this.bins);
      const to = Math.round(((bin + 1) * levels) / this.bins);
      const last = bin === this.bins - 1;
      let pixels = 0;
      for (const epoch of kEpochs) {
        const { above, pixels: all } = report.evidence[epoch];
        // The first bin also holds exact zeros, the last one all that is beyond the scale.
        pixels += (bin === 0 ? all : above[from] ?? 0) - (last ? 0 : above[to] ?? 0);
      }
      heights.push(Math.sqrt(pixels));
      const label = `${number(edgeValue(report, from))} to ${number(edgeValue(report, to))} ` +
        `${report.unit}${last ? ' and beyond' : ''}: ${count(pixels)} pixels`;
      const rect = svg('rect', {}, svg('title', {}, label));
      this.bars.push({ rect, level: to });
      this.root.append(rect);
    }
    const most = Math.max(...heights, 1);
    const step = this.width / this.bins;
    heights.forEach((value, bin) => {
      const tall = value > 0 ? Math.max(1.5, (value / most) * (height - 2)) : 0;
      const { rect } = this.bars[bin]!;
      rect.setAttribute('x', String(bin * step + 0.5));
      rect.setAttribute('width', String(step - 1));
      rect.setAttribute('y', String(height - tall));
      rect.setAttribute('height', String(tall));
    });
    this.line = svg('line', { y1: 0, y2: height, class: 'threshold-line' });
    this.root.append(this.line);
  }

  update(map: MapName, threshold: number): void {
    const { count: levels } = this.report.levels;
    for (const { rect, level } of this.bars) {
      rect.setAttribute('fill', css(levelColor(map, level, threshold, levels)));
    }
    const x = (threshold / levels) * this.width;
    this.line.setAttribute('x1', String(x));
    this.line.setAttribute('x2', String(x));
  }
}

// The camera centres of both epochs in the plane that holds most of their spread, equal scale on both axes.
export function trajectories(report: Report, onPhoto: (index: number) => void): SVGSVGElement | null {
  const stops = report.photos.flatMap((photo, index) => {
    const pose = poseOf(photo);
    return pose ? [{ index, photo, center: pose.center, forward: pose.rotation.slice(6, 9) }] : [];
  });
  if (stops.length === 0) return null;
  const mean = [0, 1, 2].map((a) => stops.reduce((sum, s) => sum + s.center[a]!, 0) / stops.length);
  const drop = [0, 1, 2].reduce((least, a) => {
    const spread = (axis: number): number =>
      stops.reduce((sum, s) => sum + (s.center[axis]! - mean[axis]!) ** 2, 0);
    return spread(a) < spread(least) ? a : least;
  }, 0);
  // Dropping the axis of least spread gives a view along it; y of a camera frame points down, as SVG's does.
  const [u, v] = [[2, 1], [0, 2], [0, 1]][drop]!;
  const at = (p: readonly number[]): [number, number] => [p[u!]!, drop === 1 ? -p[v!]! : p[v!]!];
  const xy = stops.map((s) => at(s.center));
  const low = [0, 1].map((a) => Math.min(...xy.map((p) => p[a]!)));
  const high = [0, 1].map((a) => Math.max(...xy.map((p) => p[a]!)));
  const span = Math.max(high[0]! - low[0]!, high[1]! - low[1]!, 1e-9);
  const size = 460;
  const width = 640;
  const height = Math.max(200, ((high[1]! - low[1]!) / span) * size + 80);
  const middle = [(low[0]! + high[0]!) / 2, (low[1]! + high[1]!) / 2];
  const place = (p: [number, number]): [number, number] =>
    [width / 2 + ((p[0] - middle[0]!) / span) * size, height / 2 + ((p[1] - middle[1]!) / span) * size];

  const root = svg('svg', { viewBox: `0 0 ${width} ${height}`, class: 'trajectories', role: 'img',
    'aria-label': 'Camera positions of both epochs' });
  // A scale bar of a round length, about a fifth of the width.
  const wanted = (span * 0.2 * width) / size;
  const unit = 10 ** Math.floor(Math.log10(wanted));
  const length = unit * (wanted / unit >= 5 ? 5 : wanted / unit >= 2 ? 2 : 1);
  const bar = (length / span) * size;
  root.append(svg('path', { d: `M16 ${height - 20}v6h${bar}v-6`, class: 'scale-bar' }),
    svg('text', { x: 16 + bar + 8, y: height - 13 }, `${number(length, 1)} ${report.unit}`));
  for (const epoch of kEpochs) {
    const color = css(kEpochColors[epoch]);
    const own = stops.filter((s) => s.photo.epoch === epoch);
    const path = own.map((s) => place(at(s.center)).map((c) => c.toFixed(1)).join(' ')).join('L');
    if (own.length > 1) root.append(svg('path', { d: `M${path}`, class: 'track', stroke: color }));
    own.forEach((s, i) => {
      const [x, y] = place(at(s.center));
      const [dx, dy] = at(s.forward);
      root.append(svg('line', { x1: x, y1: y, x2: x + 15 * dx, y2: y + 15 * dy, class: 'heading', stroke: color }));
      const dot = svg('circle', { cx: x, cy: y, r: i === 0 ? 5.5 : 4, fill: color,
        onclick: () => onPhoto(s.index) }, svg('title', {}, `${epochTitle(epoch)}: ${s.photo.name}`));
      root.append(dot);
      if (i === 0) root.append(svg('text', { x: x + 9, y: y - 8, class: 'start' }, `${epochTitle(epoch)} starts`));
    });
  }
  return root;
}

export const epochTitle = (epoch: Epoch): string => (epoch === 'before' ? 'Before' : 'After');
