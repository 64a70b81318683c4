// SPDX-License-Identifier: Apache-2.0
// The panel beside the 3D view.
import { kMaps, type MapName } from '../colormap';
import { hasLabels, type Change, type Cloud, type Report } from '../data';
import { checkbox, h, segmented } from '../dom';
import { count, number, percent, words } from '../format';
import { largestRegions } from '../regions';
import { changedTest, type State, type Store } from '../store';
import { makeAnswers } from './answers';
import { makeThreshold } from './threshold';

export interface Place {
  title: string;
  detail: string;
  kind: string;  // class of the mark before it
  center: [number, number, number];
  size: number;
}

export interface Actions {
  home: () => void;
  flyTo: (place: Place) => void;
  clearMeasure: () => void;
}

const diagonal = (size: readonly number[]): number => Math.hypot(...size);

function volumeOf(change: Change, unit: string): string {
  const volume = change.volume_m3 ?? change.volume_u3;
  const deviation = change.volume_sigma_m3 ?? change.volume_sigma_u3;
  if (volume === undefined) return '';
  return `${number(volume, 2)}${deviation === undefined ? '' : ` ± ${number(deviation, 1)}`} ${unit}³`;
}

// The places of change: the result's own list if it has one, else groups of changed points.
function findPlaces(report: Report, clouds: Cloud[], state: State): Place[] {
  if (report.changes) {
    return report.changes.slice(0, 200).map((change, i) => ({
      title: `${i + 1}. ${words(change.class ?? change.epoch ?? 'change')}`,
      detail: [change.name ?? '', volumeOf(change, report.unit),
        change.share === undefined ? '' : percent(change.share)].filter(Boolean).join(' · '),
      kind: change.class ?? change.epoch ?? '', center: change.center, size: diagonal(change.size),
    }));
  }
  const regions = largestRegions(clouds, changedTest(report, state), report.scene.extent, 12);
  const shown = clouds.reduce((sum, cloud) => sum + cloud.header.changed_shown, 0);
  return regions.map((region, i) => ({
    title: `${i + 1}. in the ${region.epoch} epoch`,
    detail: percent(region.points / Math.max(shown, region.points)),
    kind: region.epoch, center: region.center, size: diagonal(region.size),
  }));
}

export class Controls {
  readonly root: HTMLElement;
  private places: Place[] = [];
  private place = -1;
  private clouds: Cloud[] = [];
  private readonly list = h('ol', { class: 'places', 'aria-label': 'Places of change' });
  private timer = 0;

  constructor(private readonly report: Report, private readonly store: Store,
              private readonly actions: Actions) {
    const { state } = store;
    const labels = hasLabels(report);
    const show = segmented<State['show']>('Show', [['before', 'Before'], ['after', 'After'], ['both', 'Both'],
      ['swipe', 'Swipe']], state.show, (value) => store.set({ show: value }));
    const color = segmented<State['color']>('Colour by', [['photo', 'Photo'], ['distance', 'Distance'],
      ['epoch', 'Epoch'], ...(labels ? [['label', 'Answer'] as const] : [])], state.color,
      (value) => store.set({ color: value }));
    const map = segmented<MapName>('Colour map', (Object.keys(kMaps) as MapName[])
      .map((name) => [name, kMaps[name].title] as const), state.map, (value) => store.set({ map: value }));
    const hide = checkbox('Hide what is static', 'H', state.hideStatic, (on) => store.set({ hideStatic: on }));
    const cameras = checkbox('Cameras', 'V', state.cameras, (on) => store.set({ cameras: on }));
    const shading = checkbox('Depth shading', 'E', state.shading, (on) => store.set({ shading: on }));
    const size = h('input', { type: 'range', id: 'point-size', min: 1, max: 10, step: 0.5,
      value: state.pointSize, oninput: () => store.set({ pointSize: Number(size.value) }) });
    const measure = h('button', { type: 'button', id: 'measure', 'aria-pressed': 'false',
      onclick: () => store.set({ measuring: !store.state.measuring }) }, 'Measure ', h('kbd', {}, 'M'));
    store.on(['show', 'color', 'map', 'hideStatic', 'cameras', 'shading', 'pointSize', 'measuring'], (s) => {
      show.set(s.show);
      color.set(s.color);
      map.set(s.map);
      hide.set(s.hideStatic);
      cameras.set(s.cameras);
      shading.set(s.shading);
      size.value = String(s.pointSize);
      measure.setAttribute('aria-pressed', String(s.measuring));
    });
    store.on(['threshold', 'color'], () => this.refreshPlaces(250));
    this.root = h('aside', { class: 'panel', 'aria-label': 'Settings of the 3D view' },
      makeAnswers(report, store), makeThreshold(report, store),
      h('section', { class: 'group' }, show.root, color.root, map.root),
      h('section', { class: 'group' }, hide.root, cameras.root, shading.root,
        h('div', { class: 'row' }, h('label', { for: 'point-size' }, 'Point size'), size)),
      h('section', { class: 'group' }, h('h2', {}, 'Places of change ', h('kbd', {}, 'N')), this.list),
      h('section', { class: 'group buttons' }, measure,
        h('button', { type: 'button', onclick: () => actions.home() }, 'Reset view ', h('kbd', {}, '0'))),
      h('p', { class: 'group note', id: 'shown-note' }, this.shownNote()));
  }

  setClouds(clouds: Cloud[]): void {
    this.clouds = clouds;
    this.refreshPlaces(0);
  }

  // Flies to the next (+1) or previous (-1) place.
  step(by: number): void {
    if (this.places.length === 0) return;
    this.place = (Math.max(this.place, by > 0 ? -1 : 0) + by + this.places.length) % this.places.length;
    this.go(this.place);
  }

  private go(index: number): void {
    this.place = index;
    Array.from(this.list.children).forEach((item, i) => item.classList.toggle('current', i === index));
    this.actions.flyTo(this.places[index]!);
  }

  private refreshPlaces(delayMs: number): void {
    window.clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      this.places = findPlaces(this.report, this.clouds, this.store.state);
      this.place = -1;
      this.list.replaceChildren(...this.places.map((place, i) => h('li', {},
        h('button', { type: 'button', onclick: () => this.go(i) }, h('i', { class: `dot ${place.kind}` }),
          h('span', {}, place.title), h('small', {}, place.detail)))));
      if (this.places.length === 0) {
        this.list.append(h('li', { class: 'empty' }, 'No group of changed points at this threshold.'));
      }
    }, delayMs);
  }

  // What was left out to keep the page small.
  private shownNote(): string {
    const sum = (key: 'points' | 'shown' | 'changed' | 'changed_shown' | 'far_away'): number =>
      this.report.clouds.reduce((total, cloud) => total + cloud[key], 0);
    const points = sum('points');
    const shown = sum('shown');
    if (points === 0) return 'The result has no points.';
    if (shown === points) return `All ${count(points)} points are shown.`;
    const changed = sum('changed_shown') === sum('changed') ? `all ${count(sum('changed'))} changed ones`
      : `${count(sum('changed_shown'))} of ${count(sum('changed'))} changed ones`;
    const far = sum('far_away') > 0 ? ` ${count(sum('far_away'))} far outliers are left out.` : '';
    return `${count(shown)} of ${count(points)} points are shown, ${changed} among them; the rest is an even ` +
      `sample of the static ones.${far} Shares and counts are of the whole result.`;
  }
}
