// SPDX-License-Identifier: Apache-2.0
// The threshold: histogram, slider, and the share of pixels above it, counted on the whole result.
import { Histogram } from '../charts';
import { changedPixels, edgeValue, type Report } from '../data';
import { h } from '../dom';
import { count, number, percent } from '../format';
import { decidesByLabel, type Store } from '../store';

export function makeThreshold(report: Report, store: Store): HTMLElement {
  const { count: levels, threshold: own } = report.levels;
  const histogram = new Histogram(report, 84);
  const slider = h('input', { type: 'range', id: 'threshold', min: 0, max: levels, step: 1,
    value: store.state.threshold, oninput: () => store.set({ threshold: Number(slider.value) }) });
  const value = h('output', { for: 'threshold', class: 'value' });
  const share = h('strong', { id: 'changed-share' });
  const pixels = h('span', { id: 'changed-count' });
  const reset = h('button', { type: 'button', class: 'quiet', onclick: () => store.set({ threshold: own }) },
    'Back to the result’s own');
  const epochs = h('div', { class: 'by-epoch' });
  store.on(['threshold', 'map'], ({ threshold, map }) => {
    slider.value = String(threshold);
    const u = `${number(edgeValue(report, threshold))} ${report.unit}`;
    const ofExtent = percent(edgeValue(report, threshold) / report.scene.extent);
    slider.setAttribute('aria-valuetext', u);
    value.textContent = `${u} · ${ofExtent} of the extent`;
    histogram.update(map, threshold);
    const all = changedPixels(report, threshold);
    share.textContent = percent(all.changed / all.pixels);
    pixels.textContent = `${count(all.changed)} of ${count(all.pixels)} pixels`;
    pixels.dataset.count = String(all.changed);
    epochs.replaceChildren(...(['before', 'after'] as const).map((epoch) => {
      const { changed, pixels: total } = changedPixels(report, threshold, [epoch]);
      return h('span', {}, h('i', { class: `dot ${epoch}` }), `${epoch} ${percent(changed / total)}`);
    }));
    reset.hidden = threshold === own;
  });
  const root = h('section', { class: 'group threshold' },
    h('div', { class: 'row' }, h('label', { for: 'threshold' }, 'Changed beyond'), value),
    h('div', { class: 'scale' }, histogram.root, slider),
    h('p', { class: 'share', 'aria-live': 'polite' }, share, ' changed', h('br'), pixels),
    h('div', { class: 'row' }, epochs, reset));
  store.on(['color'], (state) => { root.hidden = decidesByLabel(report, state); });
  return root;
}
