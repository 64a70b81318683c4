// SPDX-License-Identifier: Apache-2.0
// The answers of the visibility method, counted on the whole result: what changed, what stayed, what nobody saw.
import { css, kLabelColors } from '../colormap';
import { hasLabels, kEpochs, kLabels, labelledPixels, type Label, type Report } from '../data';
import { h } from '../dom';
import { count, percent } from '../format';
import { decidesByLabel, type Store } from '../store';

const kOrder: readonly Label[] = ['removed', 'added', 'moved', 'unchanged', 'unobserved'];

export function makeAnswers(report: Report, store: Store): HTMLElement {
  const root = h('section', { class: 'group answers' });
  if (!hasLabels(report)) {
    root.hidden = true;
    return root;
  }
  const { byLabel, changed, judged, all } = labelledPixels(report);
  const used = kOrder.filter((label) => kLabels.includes(label) && byLabel[label] > 0);
  const bar = (epoch: (typeof kEpochs)[number]): HTMLElement => {
    const own = labelledPixels(report, [epoch]);
    const parts = used.filter((label) => own.byLabel[label] > 0);
    return h('div', { class: 'answer-bar', role: 'img', 'aria-label': `${epoch}: ` +
      parts.map((label) => `${label} ${percent(own.byLabel[label] / own.all)}`).join(', ') },
      h('span', {}, epoch), h('div', {}, ...parts.map((label) => h('i', { title: `${label} ${percent(own.byLabel[label] / own.all)}`,
        style: `flex:${own.byLabel[label]};background:${css(kLabelColors[label])}` }))));
  };
  root.append(
    h('p', { class: 'share' }, h('strong', { id: 'label-share' }, percent(changed / judged)), ' changed', h('br'),
      h('span', { id: 'label-count', 'data-count': changed }, `${count(changed)} of ${count(judged)} pixels that both epochs saw`)),
    ...kEpochs.map(bar),
    h('table', { class: 'answer-table' }, h('tbody', {}, ...used.map((label) => h('tr', {},
      h('th', { scope: 'row' }, h('i', { class: 'swatch', style: `background:${css(kLabelColors[label])}` }), label),
      h('td', {}, count(byLabel[label])), h('td', {}, percent(byLabel[label] / all)))))),
    h('p', { class: 'note' }, 'Decided by what the photos of the other epoch look through. Colour by distance to move a threshold instead.'));
  store.on(['color'], (state) => { root.hidden = !decidesByLabel(report, state); });
  return root;
}
