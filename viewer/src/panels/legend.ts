// SPDX-License-Identifier: Apache-2.0
// What the colours of the 3D view mean.
import { css, kEpochColors, kLabelColors, levelColor } from '../colormap';
import { edgeValue, kLabels, labelledPixels, type Report } from '../data';
import { h } from '../dom';
import { number } from '../format';
import type { Store } from '../store';

export function makeLegend(report: Report, store: Store): HTMLElement {
  const root = h('div', { class: 'legend' });
  const swatches = (entries: [string, string][]): HTMLElement => h('div', { class: 'swatches' },
    ...entries.map(([color, text]) => h('span', {}, h('i', { style: `background:${color}` }), text)));
  store.on(['color', 'map', 'threshold'], ({ color, map, threshold }) => {
    const { count } = report.levels;
    if (color === 'distance') {
      const stops: string[] = [];
      for (let i = 0; i <= 60; ++i) {
        const level = Math.round((i / 60) * (count + 1));
        stops.push(`${css(levelColor(map, level, threshold, count))} ${((100 * i) / 60).toFixed(1)}%`);
      }
      const share = threshold / count;
      const tick = (at: number, text: string, kind = ''): HTMLElement =>
        h('span', { class: kind, style: `left:${(at * 100).toFixed(1)}%` }, text);
      const u = (k: number): string => number(edgeValue(report, k));
      root.replaceChildren(
        h('div', { class: 'legend-title' }, `Distance to the other epoch, ${report.unit === 'u' ? 'scene units' : report.unit}`),
        h('div', { class: 'bar', style: `background:linear-gradient(90deg,${stops.join(',')})` },
          h('b', { style: `left:${share * 100}%` })),
        h('div', { class: 'ticks' }, share > 0.2 ? tick(0, '0') : null, tick(share, u(threshold), 'at'),
          share < 0.75 ? tick(1, `≥ ${u(count)}`, 'end') : null),
        h('div', { class: 'ends' }, h('span', {}, 'static'), h('span', {}, 'changed')));
    } else if (color === 'epoch') {
      root.replaceChildren(swatches([[css(kEpochColors.before), 'before'], [css(kEpochColors.after), 'after']]));
    } else if (color === 'label') {
      const { byLabel } = labelledPixels(report);
      const used = kLabels.filter((name) => name !== 'moved' || byLabel.moved > 0);
      root.replaceChildren(swatches(used.map((name) => [css(kLabelColors[name]), name])));
    } else {
      root.replaceChildren();
    }
    root.hidden = color === 'photo';
  });
  return root;
}
