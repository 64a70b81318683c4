// SPDX-License-Identifier: Apache-2.0
// All photos, before and after side by side, each with its heat map under one wipe.
import { epochTitle } from '../charts';
import { kEpochs, photoUrl, poseOf, type Epoch, type Report } from '../data';
import { h } from '../dom';
import { percent, shorten } from '../format';
import type { Store } from '../store';
import { PhotoPainter } from './photo_painter';

// The photo of the other epoch that looks at the same: nearest in position (as a share of the extent) and
// in direction.
export function counterpart(report: Report, index: number): number | null {
  const own = report.photos[index]!;
  const pose = poseOf(own);
  let best: number | null = null;
  let least = Infinity;
  const rank = (i: number): number =>
    report.photos.slice(0, i).filter((photo) => photo.epoch === report.photos[i]!.epoch).length;
  report.photos.forEach((photo, i) => {
    if (photo.epoch === own.epoch) return;
    const other = poseOf(photo);
    const cost = pose && other
      ? Math.hypot(...[0, 1, 2].map((a) => pose.center[a]! - other.center[a]!)) / report.scene.extent +
        1 - [6, 7, 8].reduce((dot, a) => dot + pose.rotation[a]! * other.rotation[a]!, 0)
      : Math.abs(rank(i) - rank(index));
    if (cost < least) {
      least = cost;
      best = i;
    }
  });
  return best;
}

class Pane {
  readonly root: HTMLElement;
  readonly painter: PhotoPainter;
  index: number | null = null;
  private readonly title = h('figcaption', {});

  constructor(private readonly report: Report, private readonly store: Store, readonly epoch: Epoch,
              onLook: (photo: number) => void) {
    this.painter = new PhotoPainter(report);
    this.root = h('figure', { class: 'pane' }, h('div', { class: 'frame' }, this.painter.canvas), this.title);
    const frame = this.painter.canvas;
    const wipe = (e: PointerEvent): void => {
      const box = frame.getBoundingClientRect();
      store.set({ wipe: Math.min(1, Math.max(0, (e.clientX - box.left) / box.width)) });
    };
    frame.addEventListener('pointerdown', (e) => { frame.setPointerCapture(e.pointerId); wipe(e); });
    frame.addEventListener('pointermove', (e) => { if (e.buttons) wipe(e); });
    frame.addEventListener('dblclick', () => { if (this.index !== null) onLook(this.index); });
  }

  show(index: number | null): void {
    this.index = index;
    if (index === null) {
      this.root.classList.add('empty');
      this.title.replaceChildren(`No photo ${this.epoch === 'before' ? 'before' : 'after'}`);
      return;
    }
    const photo = this.report.photos[index]!;
    this.root.classList.remove('empty');
    const share = photo.pixels > 0 ? `${percent(photo.changed / photo.pixels)} changed` : 'no evidence';
    this.title.replaceChildren(h('span', { class: `epoch ${this.epoch}` }, epochTitle(this.epoch)),
      h('span', { class: 'name', title: photo.name }, shorten(photo.name, 40)),
      h('span', { class: 'muted' }, share));
    void this.painter.load(index, this.store.state);
  }
}

export class Photos {
  readonly root: HTMLElement;
  private readonly panes: Record<Epoch, Pane>;
  private readonly thumbs = new Map<number, HTMLButtonElement>();

  constructor(private readonly report: Report, private readonly store: Store,
              onLook: (photo: number) => void) {
    this.panes = {
      before: new Pane(report, store, 'before', onLook), after: new Pane(report, store, 'after', onLook),
    };
    const wipe = h('input', { type: 'range', id: 'photos-wipe', min: 0, max: 1, step: 0.01,
      'aria-label': 'Photo to heat map', oninput: () => store.set({ wipe: Number(wipe.value) }) });
    const look = h('button', { type: 'button', onclick: () => {
      const index = store.state.photo ?? this.panes.after.index ?? this.panes.before.index;
      if (index !== null) onLook(index);
    } }, 'Show in 3D ', h('kbd', {}, '↵'));
    const lazy = new IntersectionObserver((entries) => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        lazy.unobserve(entry.target);
        const image = entry.target.querySelector('img');
        const url = photoUrl(report, report.photos[Number((entry.target as HTMLElement).dataset.photo)]!);
        if (image && url) image.src = url;
      }
    }, { rootMargin: '300px' });
    const strip = (epoch: Epoch): HTMLElement => {
      const own = report.photos.flatMap((photo, index) => (photo.epoch === epoch ? [index] : []));
      return h('div', { class: 'strip' },
        h('h2', {}, `${epochTitle(epoch)} `, h('small', {}, `${own.length} ${own.length === 1 ? 'photo' : 'photos'}`)),
        h('div', { class: 'thumbs' }, ...own.map((index) => this.thumb(index, lazy))));
    };
    this.root = h('div', { class: 'photos' },
      report.photos.length === 0 ? h('p', { class: 'empty' }, 'This result has no photos.') : null,
      h('div', { class: 'pair', hidden: report.photos.length === 0 }, this.panes.before.root, this.panes.after.root),
      h('div', { class: 'row wipe', hidden: report.photos.length === 0 }, h('span', {}, 'Photo'), wipe,
        h('span', {}, 'Heat map'), look),
      h('div', { class: 'strips' }, ...kEpochs.map(strip)));
    store.on(['photo'], ({ photo }) => this.select(photo ?? (report.photos.length > 0 ? this.mostChanged() : null)));
    store.on(['wipe', 'threshold', 'map', 'color'], (state) => {
      wipe.value = String(state.wipe);
      for (const epoch of kEpochs) this.panes[epoch].painter.paint(state);
    });
  }

  private thumb(index: number, lazy: IntersectionObserver): HTMLElement {
    const photo = this.report.photos[index]!;
    const share = photo.pixels > 0 ? photo.changed / photo.pixels : 0;
    const button = h('button', { type: 'button', class: 'thumb', title: photo.name, 'data-photo': index,
      'aria-label': `${photo.epoch}: ${photo.name}, ${percent(share)} changed`,
      style: `aspect-ratio:${photo.width || 4}/${photo.height || 3}`,
      onclick: () => this.store.set({ photo: index }) },
      photo.image ? h('img', { alt: '', decoding: 'async' }) : null,
      h('i', { style: `width:${Math.min(100, 100 * Math.sqrt(share)).toFixed(1)}%` }));
    this.thumbs.set(index, button);
    lazy.observe(button);
    return button;
  }

  private mostChanged(): number {
    const share = (i: number): number => {
      const { changed, pixels } = this.report.photos[i]!;
      return pixels > 0 ? changed / pixels : -1;
    };
    return this.report.photos.reduce((best, _, i) => (share(i) > share(best) ? i : best), 0);
  }

  private select(index: number | null): void {
    if (index === null) return;
    const { epoch } = this.report.photos[index]!;
    const other = counterpart(this.report, index);
    this.panes[epoch].show(index);
    this.panes[epoch === 'before' ? 'after' : 'before'].show(other);
    for (const [i, thumb] of this.thumbs) {
      thumb.setAttribute('aria-pressed', String(i === index));
      thumb.classList.toggle('paired', i === other);
    }
    this.thumbs.get(index)?.scrollIntoView({ block: 'nearest' });
  }
}
