// SPDX-License-Identifier: Apache-2.0
// The chosen photo over the 3D view: with its heat map, and a way to look from where it was taken.
import { epochTitle } from '../charts';
import type { Report } from '../data';
import { h } from '../dom';
import { percent, shorten } from '../format';
import type { Store } from '../store';
import { PhotoPainter } from './photo_painter';

export interface CardActions {
  lookFrom: (photo: number) => void;
  painted: (canvas: HTMLCanvasElement, photo: number) => void;
}

export function makePhotoCard(report: Report, store: Store, actions: CardActions): HTMLElement {
  const painter = new PhotoPainter(report);
  const title = h('span', { class: 'name' });
  const epoch = h('span', { class: 'epoch' });
  const share = h('span', { class: 'muted' });
  const wipe = h('input', { type: 'range', min: 0, max: 1, step: 0.01, 'aria-label': 'Photo to heat map',
    oninput: () => store.set({ wipe: Number(wipe.value) }) });
  const look = h('button', { type: 'button', class: 'primary',
    onclick: () => { if (store.state.photo !== null) actions.lookFrom(store.state.photo); } },
    'Look from here ', h('kbd', {}, '↵'));
  const step = (by: number, label: string, text: string): HTMLElement =>
    h('button', { type: 'button', 'aria-label': label, class: 'icon', onclick: () => stepPhoto(report, store, by) }, text);
  const root = h('div', { class: 'photo-card', role: 'region', 'aria-label': 'Chosen photo', hidden: true },
    h('div', { class: 'row' }, epoch, title,
      h('button', { type: 'button', class: 'icon', 'aria-label': 'Close photo',
        onclick: () => store.set({ photo: null }) }, '×')),
    h('div', { class: 'frame' }, painter.canvas),
    h('div', { class: 'row wipe' }, h('span', {}, 'Photo'), wipe, h('span', {}, 'Heat map')),
    h('div', { class: 'row' }, step(-1, 'Previous photo', '‹'), step(1, 'Next photo', '›'), share, look));
  store.on(['photo'], (state) => {
    root.hidden = state.photo === null;
    if (state.photo === null) return;
    const index = state.photo;
    const photo = report.photos[index]!;
    root.dataset.photo = String(index);
    title.textContent = shorten(photo.name, 26);
    title.title = photo.name;
    epoch.textContent = epochTitle(photo.epoch);
    epoch.className = `epoch ${photo.epoch}`;
    share.textContent = photo.pixels > 0 ? `${percent(photo.changed / photo.pixels)} changed` : 'no evidence';
    look.hidden = photo.camera_from_world === null;
    void painter.load(index, store.state).then((current) => {
      if (current) actions.painted(painter.canvas, index);
    });
  });
  store.on(['wipe', 'threshold', 'map', 'color'], (state) => {
    wipe.value = String(state.wipe);
    if (state.photo === null) return;
    painter.paint(state);
    actions.painted(painter.canvas, state.photo);
  });
  return root;
}

export function stepPhoto(report: Report, store: Store, by: number): void {
  const n = report.photos.length;
  if (n === 0) return;
  const { photo } = store.state;
  store.set({ photo: photo === null ? (by > 0 ? 0 : n - 1) : (photo + by + n) % n });
}
