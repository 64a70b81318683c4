// SPDX-License-Identifier: Apache-2.0
// The report page: reads its data block, builds header, 3D view, photos and numbers, and joins them.
import './style.css';
import * as THREE from 'three';
import { changedPixels, decodeCloud, edgeValue, hasLabels, kEpochs, labelledPixels, parseReport, type Report } from './data';
import { h } from './dom';
import { count, number, percent, shorten } from './format';
import { listenForKeys, makeCommands, makeHelp } from './keyboard';
import { Controls } from './panels/controls';
import { makeLegend } from './panels/legend';
import { makeNumbers, verdictSentence } from './panels/numbers';
import { makePhotoCard, stepPhoto } from './panels/photo_card';
import { Photos } from './panels/photos';
import { makeSwipe } from './panels/swipe';
import { decidesByLabel, Store, type State } from './store';
import { Viewer } from './view3d/viewer';

const app = document.getElementById('app')!;

function initialState(report: Report): State {
  return {
    tab: 'view', show: hasLabels(report) ? 'both' : 'after', color: hasLabels(report) ? 'label' : 'distance',
    map: 'spectrum', threshold: report.levels.threshold, hideStatic: false, cameras: true, shading: true,
    pointSize: 4, swipe: 0.5, photo: null, wipe: 0.5, measuring: false,
  };
}

function makeViewer(stage: HTMLElement, report: Report, store: Store): Viewer | null {
  try {
    const viewer = new Viewer(stage, report, store);
    viewer.canvas.addEventListener('webglcontextlost', () => {
      stage.append(h('div', { class: 'stage-message' },
        h('p', {}, 'The graphics card gave up on the 3D view. Load the page again to get it back.')));
    });
    return viewer;
  } catch {
    stage.append(h('div', { class: 'stage-message', id: 'no-webgl' }, h('h2', {}, 'No 3D view here'),
      h('p', {}, 'This browser has no WebGL 2, or it is switched off, so the point clouds cannot be drawn. ' +
        'Photos, heat maps and numbers work without it.'),
      h('button', { type: 'button', class: 'primary', onclick: () => store.set({ tab: 'photos' }) }, 'Show the photos')));
    return null;
  }
}

function makeTabs(store: Store, panes: Record<State['tab'], HTMLElement>): HTMLElement {
  const titles: Record<State['tab'], string> = { view: '3D view', photos: 'Photos', numbers: 'Numbers' };
  const keys = Object.keys(titles) as State['tab'][];
  const buttons = keys.map((tab) => h('button', { type: 'button', role: 'tab', id: `tab-${tab}`,
    'aria-controls': `pane-${tab}`, onclick: () => store.set({ tab }) }, titles[tab]));
  const bar = h('div', { class: 'tabs', role: 'tablist', onkeydown: (event: KeyboardEvent) => {
    const step = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
    if (step === 0) return;
    event.preventDefault();
    const next = (keys.indexOf(store.state.tab) + step + keys.length) % keys.length;
    store.set({ tab: keys[next]! });
    buttons[next]!.focus();
  } }, ...buttons);
  keys.forEach((key) => {
    panes[key].id = `pane-${key}`;
    panes[key].setAttribute('role', 'tabpanel');
    panes[key].setAttribute('aria-labelledby', `tab-${key}`);
  });
  store.on(['tab'], ({ tab }) => keys.forEach((key, i) => {
    buttons[i]!.setAttribute('aria-selected', String(key === tab));
    buttons[i]!.tabIndex = key === tab ? 0 : -1;
    panes[key].hidden = key !== tab;
  }));
  return bar;
}

function makeHeadline(report: Report, store: Store): HTMLElement {
  const share = h('b', {});
  const beyond = h('span', {});
  store.on(['threshold', 'color'], (state) => {
    if (decidesByLabel(report, state)) {
      const { changed, judged } = labelledPixels(report);
      share.textContent = percent(changed / judged);
      beyond.textContent = ' changed, of what both epochs saw';
      return;
    }
    const { changed, pixels } = changedPixels(report, state.threshold);
    share.textContent = percent(changed / pixels);
    beyond.textContent = ` farther than ${number(edgeValue(report, state.threshold))} ${report.unit} from the other epoch`;
  });
  const photos = kEpochs.map((epoch) => report.photos.filter((p) => p.epoch === epoch).length);
  const points = report.clouds.reduce((sum, cloud) => sum + cloud.points, 0);
  return h('div', { class: 'headline' }, h('p', {}, share, beyond),
    h('p', { class: 'verdict' }, verdictSentence(report)),
    h('p', { class: 'muted' }, `${photos[0]} + ${photos[1]} photos, ${count(points)} points`));
}

// Light and dark as the system says, until the user says otherwise.
function makeTheme(apply: (background: string, ink: string) => void): HTMLButtonElement {
  const system = window.matchMedia('(prefers-color-scheme: dark)');
  let chosen: 'light' | 'dark' | null = null;
  const update = (): void => {
    const theme = chosen ?? (system.matches ? 'dark' : 'light');
    document.documentElement.dataset.theme = theme;
    const style = getComputedStyle(document.documentElement);
    apply(style.getPropertyValue('--stage').trim(), style.getPropertyValue('--ink').trim());
    button.setAttribute('aria-label', theme === 'dark' ? 'Light theme' : 'Dark theme');
    button.textContent = theme === 'dark' ? '☀' : '☾';
  };
  const button = h('button', { type: 'button', class: 'icon', onclick: () => {
    chosen = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
    update();
  } });
  system.addEventListener('change', update);
  update();
  return button;
}

async function start(): Promise<void> {
  const report = parseReport(document.getElementById('report-data')!.textContent ?? '');
  document.title = `What changed: ${shorten(report.title, 80)}`;
  const store = new Store(initialState(report));
  const stage = h('div', { class: 'stage' });
  const message = h('p', { class: 'toast', role: 'status', hidden: true });

  app.replaceChildren();
  app.append(stage);  // in the document before it is measured
  const viewer = makeViewer(stage, report, store);
  const lookFrom = (photo: number): void => {
    store.set({ photo, tab: 'view', ...(store.state.show === 'swipe' || store.state.show === 'both' ? {}
      : { show: report.photos[photo]!.epoch }) });
    const frustum = viewer?.frustums.byPhoto.get(photo);
    if (frustum) viewer!.navigation.lookFrom(frustum);
  };
  const controls = new Controls(report, store, {
    home: () => viewer?.navigation.home(),
    flyTo: (place) => viewer?.navigation.lookAt(new THREE.Vector3(...place.center), place.size),
    clearMeasure: () => viewer?.measure.clear(),
  });
  const card = makePhotoCard(report, store, { lookFrom, painted: (canvas, photo) => {
    viewer?.frustums.choose(photo, canvas);
    viewer?.draw();
  } });
  const photos = new Photos(report, store, lookFrom);
  const numbers = makeNumbers(report, store, (photo) => store.set({ photo, tab: 'photos' }));
  const commands = makeCommands(store, report.levels.count, hasLabels(report), {
    turn: (x, y) => viewer?.navigation.turn(x, y), pan: (x, y) => viewer?.navigation.pan(x, y),
    zoom: (factor) => viewer?.navigation.zoom(factor), home: () => viewer?.navigation.home(),
    place: (by) => controls.step(by), photo: (by) => stepPhoto(report, store, by),
    lookFromPhoto: () => { if (store.state.photo !== null) lookFrom(store.state.photo); },
    measureAtCentre: () => { if (store.state.measuring) viewer?.click(stage.clientWidth / 2, stage.clientHeight / 2); },
    help: () => help.showModal(),
  });
  const help = makeHelp(commands);
  listenForKeys(store, commands);

  stage.append(makeLegend(report, store), makeSwipe(stage, store), card, message, h('div', { class: 'cross' }));
  const view = h('main', { class: 'view' }, stage, controls.root);
  const photosPane = h('main', {}, photos.root);
  const numbersPane = h('main', {}, numbers);
  const theme = makeTheme((background, ink) => viewer?.setTheme(background, ink));
  app.append(
    h('header', {}, h('h1', { title: report.title }, shorten(report.title, 64)),
      makeTabs(store, { view, photos: photosPane, numbers: numbersPane }),
      h('div', { class: 'tools' }, theme, h('button', { type: 'button', class: 'icon', 'aria-label': 'Keys',
        onclick: () => help.showModal() }, '?'))),
    makeHeadline(report, store), view, photosPane, numbersPane, help);

  let timer = 0;
  const say = (text: string): void => {
    window.clearTimeout(timer);
    message.textContent = text;
    message.hidden = false;
    timer = window.setTimeout(() => { message.hidden = true; }, 4000);
  };
  if (viewer) {
    viewer.measure.onMessage = say;
    viewer.onPhotoClicked = (photo) => store.set({ photo });
    store.on(['photo'], ({ photo }) => { if (photo === null) { viewer.frustums.choose(null, null); viewer.draw(); } });
    store.on(['measuring'], ({ measuring }) => {
      stage.classList.toggle('measuring', measuring);
      if (measuring) say('Pick two points. By keyboard: turn until a point is in the cross, then Space.');
      else viewer.measure.clear();
    });
    const clouds = await Promise.all(report.clouds.map((header) => decodeCloud(report, header)));
    viewer.addClouds(clouds);
    controls.setClouds(clouds);
    if (clouds.every((cloud) => cloud.header.shown === 0)) {
      stage.append(h('div', { class: 'stage-message' }, h('p', {}, 'This result has no points to draw.')));
    }
  }
  app.removeAttribute('aria-busy');
  // For tests and benchmarks: what is chosen, and the view.
  Object.assign(window, { vggtcd: { report, store, viewer } });
  document.documentElement.dataset.ready = 'true';
}

start().catch((error: unknown) => {
  const text = error instanceof Error ? error.message : String(error);
  app.removeAttribute('aria-busy');
  app.append(h('p', { class: 'boot', role: 'alert' }, `This report cannot be shown. ${text}`));
  document.documentElement.dataset.ready = 'failed';
  console.error(error);
});
