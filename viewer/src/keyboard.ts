// SPDX-License-Identifier: Apache-2.0
// Everything by keyboard. The table is both what the page obeys and what its help shows.
import { h } from './dom';
import type { Store } from './store';

export interface Command { keys: string[]; shown: string; text: string; run: (shift: boolean) => void; viewOnly?: boolean }

export interface KeyActions {
  turn: (x: number, y: number) => void;
  pan: (x: number, y: number) => void;
  zoom: (factor: number) => void;
  home: () => void;
  place: (by: number) => void;
  photo: (by: number) => void;
  lookFromPhoto: () => void;
  measureAtCentre: () => void;
  help: () => void;
}

export function makeCommands(store: Store, levels: number, hasLabels: boolean, act: KeyActions): Command[] {
  const { state } = store;
  const arrow = (key: string, x: number, y: number): Command => ({
    keys: [key], shown: '', text: '', viewOnly: true,
    run: (shift) => {
      if (shift) act.pan(0.06 * x, -0.06 * y);
      else if (state.show === 'swipe' && y === 0 && document.activeElement?.getAttribute('role') === 'slider') return;
      else act.turn(-0.09 * x, 0.09 * y);
    },
  });
  const clamp = (value: number, low: number, high: number): number => Math.min(high, Math.max(low, value));
  return [
    { keys: [], shown: '← ↑ ↓ →', text: 'turn; with Shift: move sideways', run: () => {} },
    arrow('ArrowLeft', -1, 0), arrow('ArrowRight', 1, 0), arrow('ArrowUp', 0, -1), arrow('ArrowDown', 0, 1),
    { keys: ['+', '='], shown: '+', text: 'nearer', viewOnly: true, run: () => act.zoom(0.85) },
    { keys: ['-', '_'], shown: '−', text: 'farther', viewOnly: true, run: () => act.zoom(1 / 0.85) },
    { keys: ['0', 'Home'], shown: '0', text: 'reset the view', viewOnly: true, run: () => act.home() },
    { keys: ['1'], shown: '1', text: 'show before', viewOnly: true, run: () => store.set({ show: 'before' }) },
    { keys: ['2'], shown: '2', text: 'show after', viewOnly: true, run: () => store.set({ show: 'after' }) },
    { keys: ['3'], shown: '3', text: 'show both', viewOnly: true, run: () => store.set({ show: 'both' }) },
    { keys: ['4'], shown: '4', text: 'swipe between them', viewOnly: true, run: () => store.set({ show: 'swipe' }) },
    { keys: ['c'], shown: 'C', text: 'next colouring', viewOnly: true, run: () => {
      const all = ['photo', 'distance', 'epoch', ...(hasLabels ? ['label' as const] : [])] as const;
      store.set({ color: all[(all.indexOf(state.color) + 1) % all.length]! });
    } },
    { keys: ['b'], shown: 'B', text: 'other colour map', run: () => store.set({ map: state.map === 'safe' ? 'spectrum' : 'safe' }) },
    { keys: [',', '<'], shown: ',', text: 'lower threshold', run: () => store.set({ threshold: clamp(state.threshold - 2, 0, levels) }) },
    { keys: ['.', '>'], shown: '.', text: 'higher threshold', run: () => store.set({ threshold: clamp(state.threshold + 2, 0, levels) }) },
    { keys: ['h'], shown: 'H', text: 'hide what is static', viewOnly: true, run: () => store.set({ hideStatic: !state.hideStatic }) },
    { keys: ['v'], shown: 'V', text: 'cameras', viewOnly: true, run: () => store.set({ cameras: !state.cameras }) },
    { keys: ['e'], shown: 'E', text: 'depth shading', viewOnly: true, run: () => store.set({ shading: !state.shading }) },
    { keys: ['s'], shown: 'S', text: 'larger points; with Shift: smaller', viewOnly: true,
      run: (shift) => store.set({ pointSize: clamp(state.pointSize + (shift ? -0.5 : 0.5), 1, 10) }) },
    { keys: ['n'], shown: 'N', text: 'fly to the next place of change; with Shift: the one before', viewOnly: true,
      run: (shift) => act.place(shift ? -1 : 1) },
    { keys: ['['], shown: '[', text: 'previous photo', run: () => act.photo(-1) },
    { keys: [']'], shown: ']', text: 'next photo', run: () => act.photo(1) },
    { keys: ['Enter'], shown: 'Enter', text: 'look from the chosen photo', run: () => act.lookFromPhoto() },
    { keys: ['w'], shown: 'W', text: 'photo or heat map', run: () => store.set({ wipe: state.wipe > 0.5 ? 0 : 1 }) },
    { keys: ['m'], shown: 'M', text: 'measure', viewOnly: true, run: () => store.set({ measuring: !state.measuring }) },
    { keys: [' '], shown: 'Space', text: 'while measuring: set a point in the middle of the view', viewOnly: true,
      run: () => act.measureAtCentre() },
    { keys: ['Escape'], shown: 'Esc', text: 'stop measuring, close the photo',
      run: () => (state.measuring ? store.set({ measuring: false }) : store.set({ photo: null })) },
    { keys: ['F2'], shown: 'F2', text: 'next tab', run: () => {
      const tabs = ['view', 'photos', 'numbers'] as const;
      store.set({ tab: tabs[(tabs.indexOf(state.tab) + 1) % 3]! });
    } },
    { keys: ['?'], shown: '?', text: 'this list', run: () => act.help() },
  ];
}

export function listenForKeys(store: Store, commands: Command[]): void {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const target = event.target as HTMLElement;
    if (document.querySelector('dialog[open]')) return;
    // Keys that a control needs for itself stay with it.
    const isField = target.matches?.('input, summary, [role=slider]');
    const isButton = target.matches?.('button, a, summary');
    if (isField && /^(Arrow|Home|End|Page| |Enter)/.test(event.key)) return;
    if (isButton && /^( |Enter)/.test(event.key)) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const command = commands.find(({ keys, viewOnly }) =>
      keys.includes(key) && (!viewOnly || store.state.tab === 'view'));
    if (!command) return;
    event.preventDefault();
    command.run(event.shiftKey);
  });
}

export function makeHelp(commands: Command[]): HTMLDialogElement {
  const dialog = h('dialog', { class: 'help', 'aria-label': 'Keys' },
    h('div', { class: 'row' }, h('h2', {}, 'Keys'),
      h('button', { type: 'button', class: 'icon', 'aria-label': 'Close', onclick: () => dialog.close() }, '×')),
    h('dl', {}, ...commands.filter(({ shown }) => shown).map(({ shown, text }) =>
      h('div', {}, h('dt', {}, h('kbd', {}, shown)), h('dd', {}, text)))),
    h('p', { class: 'muted' }, 'Mouse: drag turns, right drag moves, wheel zooms; click a camera for its photo. ' +
      'Touch: one finger turns, two fingers move and zoom.'));
  dialog.addEventListener('click', (event) => { if (event.target === dialog) dialog.close(); });
  return dialog;
}
