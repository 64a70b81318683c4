// SPDX-License-Identifier: Apache-2.0
// A photo with its heat map on one canvas: the map covers the photo from the left up to the wipe.
import { kLabelColors, levelTable } from '../colormap';
import { decodeHeat, kLabels, kNoEvidence, photoUrl, type Heat, type Report } from '../data';
import { decidesByLabel, type State } from '../store';

export class PhotoPainter {
  readonly canvas: HTMLCanvasElement;
  private shown: number | null = null;
  private picture: HTMLImageElement | null = null;
  private heat: Heat | null = null;
  private layer: HTMLCanvasElement | null = null;  // the heat map as last coloured
  private layerKey = '';

  constructor(private readonly report: Report) {
    this.canvas = document.createElement('canvas');
    this.canvas.setAttribute('role', 'img');
  }

  get hasHeat(): boolean { return this.heat !== null; }

  // Resolves when the photo is on the canvas; false if another one was asked for in the meantime.
  async load(index: number, state: State): Promise<boolean> {
    if (this.shown === index && this.picture) { this.paint(state); return true; }
    this.shown = index;
    const photo = this.report.photos[index]!;
    const url = photoUrl(this.report, photo);
    const picture = new Image();
    const [heat] = await Promise.all([
      decodeHeat(this.report, photo).catch(() => null),
      url ? (picture.src = url, picture.decode().catch(() => undefined)) : undefined,
    ]);
    if (this.shown !== index) return false;
    this.picture = picture;
    this.heat = heat;
    this.layerKey = '';
    // Small photos are drawn larger, so that the edges of the map stay sharp on a large screen.
    const zoom = Math.ceil(900 / Math.max(photo.width, 1));
    this.canvas.width = Math.max(1, Math.min(zoom, 8) * photo.width);
    this.canvas.height = Math.max(1, Math.min(zoom, 8) * photo.height);
    this.canvas.setAttribute('aria-label', `${photo.epoch}: ${photo.name}`);
    this.paint(state);
    return true;
  }

  paint(state: Pick<State, 'map' | 'threshold' | 'wipe' | 'color'>): void {
    const context = this.canvas.getContext('2d');
    if (!context || !this.picture) return;
    const { width, height } = this.canvas;
    context.imageSmoothingQuality = 'high';
    context.fillStyle = '#888';
    context.fillRect(0, 0, width, height);
    if (this.picture.naturalWidth > 0) context.drawImage(this.picture, 0, 0, width, height);
    if (!this.heat || state.wipe <= 0) return;
    this.color(this.heat, state);
    const edge = Math.round(state.wipe * width);
    context.save();
    context.beginPath();
    context.rect(0, 0, edge, height);
    context.clip();
    context.imageSmoothingEnabled = false;
    context.drawImage(this.layer!, 0, 0, width, height);
    context.restore();
    if (edge < width) {
      context.fillStyle = '#fff';
      context.fillRect(edge - 1, 0, Math.max(2, Math.round(width / 450)), height);
    }
  }

  private color(heat: Heat, { map, threshold, color }: Pick<State, 'map' | 'threshold' | 'color'>): void {
    const labels = decidesByLabel(this.report, { color }) ? heat.label : null;
    const key = `${map} ${threshold} ${labels !== null}`;
    if (key === this.layerKey && this.layer) return;
    this.layerKey = key;
    const table = levelTable(map, threshold, this.report.levels.count);
    this.layer ??= document.createElement('canvas');
    this.layer.width = heat.width;
    this.layer.height = heat.height;
    const context = this.layer.getContext('2d')!;
    const image = context.createImageData(heat.width, heat.height);
    for (let i = 0; i < heat.level.length; ++i) {
      const level = heat.level[i]!;
      const label = labels ? kLabels[labels[i]!] : undefined;
      if (label) {
        image.data.set(kLabelColors[label], 4 * i);
        image.data[4 * i + 3] = label === 'unchanged' ? 70 : label === 'unobserved' ? 190 : 215;
      } else if (level === kNoEvidence || labels) {
        image.data.set([18, 20, 24, 150], 4 * i);  // nothing known: the photo, dimmed
      } else {
        image.data.set(table.subarray(4 * level, 4 * level + 3), 4 * i);
        image.data[4 * i + 3] = level > threshold ? 235 : 165;
      }
    }
    context.putImageData(image, 0, 0);
  }
}
