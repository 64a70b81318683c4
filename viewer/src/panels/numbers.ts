// SPDX-License-Identifier: Apache-2.0
// How we know: verdict, residuals, trajectories, histogram and options, from summary.json.
import { Histogram, trajectories } from '../charts';
import { changedPixels, edgeValue, type Json, type JsonObject, type Report } from '../data';
import { h } from '../dom';
import { bytes, count, number, percent, seconds, words } from '../format';
import type { Store } from '../store';

const isObject = (value: Json | undefined): value is JsonObject =>
  typeof value === 'object' && value !== null && !Array.isArray(value);

// The value of the first of these keys, wherever it is; outer levels first.
export function find(root: Json | undefined, ...keys: string[]): Json | undefined {
  for (const key of keys) {
    let level: JsonObject[] = isObject(root) ? [root] : [];
    while (level.length > 0) {
      const hit = level.find((object) => object[key] !== undefined && object[key] !== null);
      if (hit) return hit[key];
      level = level.flatMap((object) => Object.values(object).filter(isObject));
    }
  }
  return undefined;
}

const asNumber = (value: Json | undefined): number | null => (typeof value === 'number' ? value : null);

function show(key: string, value: Json): string {
  if (typeof value === 'number') {
    if (/(^|_)seconds$|_s$/.test(key)) return seconds(value);
    if (/bytes$/.test(key)) return bytes(value);
    const text = Number.isInteger(value) && Math.abs(value) < 1e15 ? count(value)
      : number(value, 5).replace(/(\.\d*?)0+(e|$)/, '$1$2').replace(/\.(e|$)/, '$1');
    const unit = /_(deg|rad|px|m|u)$/.exec(key)?.[1];
    return unit ? `${text} ${unit === 'deg' ? '°' : unit}` : text;
  }
  if (typeof value === 'boolean') return value ? 'yes' : 'no';
  if (value === null) return '–';
  if (Array.isArray(value)) return value.map((item) => show(key, item)).join(', ');
  return String(value);
}

// Any JSON as a table; objects inside become indented rows.
function rows(object: JsonObject, depth = 0): HTMLElement[] {
  return Object.entries(object).flatMap(([key, value]): HTMLElement[] => {
    const name = h('th', { scope: 'row', style: `padding-left:${depth * 1.1 + 0.25}em` },
      words(key.replace(/_(deg|rad|px|m|u|s)$/, '')));
    if (isObject(value)) return [h('tr', { class: 'head' }, name, h('td', {})), ...rows(value, depth + 1)];
    if (Array.isArray(value) && value.some(isObject)) {
      return [h('tr', { class: 'head' }, name, h('td', {}, `${value.length}`)),
        ...value.flatMap((item) => (isObject(item) ? rows(item, depth + 1) : []))];
    }
    return [h('tr', {}, name, h('td', {}, show(key, value)))];
  });
}

const table = (object: JsonObject): HTMLElement => h('table', {}, h('tbody', {}, ...rows(object)));

const card = (title: string, ...content: (Node | null)[]): HTMLElement =>
  h('section', { class: 'card' }, h('h2', {}, title), ...content);

// The alignment verdict in a sentence; before it, what speaks against the alignment as a whole.
export function verdictSentence(report: Report): string {
  const plausibility = find(report.summary, 'plausibility');
  if (isObject(plausibility) && plausibility.verdict !== 'believable' && typeof plausibility.explanation === 'string') {
    return `Careful: ${plausibility.explanation}. ${stageSentence(report)}`;
  }
  return stageSentence(report);
}

function stageSentence(report: Report): string {
  const sentence = find(report.summary, 'explanation', 'verdict_sentence', 'sentence');
  if (typeof sentence === 'string') return sentence;
  const verdict = find(report.summary, 'verdict');
  return typeof verdict === 'string' ? `Alignment: ${words(verdict)}.` : 'The result says nothing about the alignment.';
}

function alignment(report: Report): HTMLElement {
  const { summary, sim3, unit } = report;
  const scale = asNumber(find(sim3 ?? summary, 'scale'));
  const coarse = asNumber(find(summary, 'median_residual_coarse_u', 'coarse_residual_u'));
  const fine = asNumber(find(summary, 'median_residual_fine_u', 'fine_residual_u'));
  const sigma = asNumber(find(summary, 'residual_sigma_u'));
  // The alignment is computed before metres are known.
  const metres = unit === 'm' ? asNumber(find(summary, 'metres_per_unit')) ?? 1 : 1;
  const metric = find(summary.metric, 'sentence');
  const figure = (label: string, value: string, note = ''): HTMLElement =>
    h('div', { class: 'figure' }, h('span', {}, label), h('b', {}, value), h('small', {}, note));
  const residual = (label: string, value: number | null, digits: number): HTMLElement | null =>
    value === null ? null : figure(label, `${number(value * metres, digits)} ${unit}`,
      `${percent((value * metres) / report.scene.extent)} of the extent`);
  return card('Alignment', h('p', { class: 'sentence' }, verdictSentence(report)),
    h('div', { class: 'figures' },
      scale === null ? null : figure('Scale ratio', `× ${number(scale, 4)}`, 'after ÷ before'),
      residual('Coarse residual', coarse, 4), residual('Fine residual', fine, 4),
      residual('Robust residual, σ', sigma, 3),
      figure('Extent of the scene', `${number(report.scene.extent)} ${unit}`)),
    typeof metric === 'string' ? h('p', { class: 'muted' }, metric) : null,
    sim3 ? h('details', {}, h('summary', {}, 'The similarity transform'), table(sim3)) : null);
}

function distances(report: Report, store: Store): HTMLElement {
  const histogram = new Histogram(report, 180);
  const caption = h('p', { class: 'muted' });
  store.on(['threshold', 'map'], ({ threshold, map }) => {
    histogram.update(map, threshold);
    const { changed, pixels } = changedPixels(report, threshold);
    caption.textContent = `${percent(changed / pixels)} of ${count(pixels)} pixels with evidence lie beyond ` +
      `${number(edgeValue(report, threshold))} ${report.unit}. Heights are square roots of the counts.`;
  });
  return card('Distances', histogram.root,
    h('div', { class: 'axis' }, h('span', {}, '0'), h('span', {}, `${number(edgeValue(report, report.levels.count / 2))}`),
      h('span', {}, `${number(edgeValue(report, report.levels.count))} ${report.unit}`)), caption);
}

export function makeNumbers(report: Report, store: Store, onPhoto: (index: number) => void): HTMLElement {
  const plot = trajectories(report, onPhoto);
  const options = find(report.summary, 'options');
  return h('div', { class: 'numbers' },
    alignment(report),
    distances(report, store),
    plot ? card('Cameras', plot, h('p', { class: 'muted' },
      'Both walks in the frame of the after epoch, seen along the axis in which they spread least.')) : null,
    isObject(options) ? card('Options', table(options)) : null,
    card('All of summary.json', h('details', {}, h('summary', {}, 'Show'), table(report.summary))),
    h('p', { class: 'muted made-by' }, `Made by ${report.generator}.`));
}
