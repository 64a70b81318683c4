// SPDX-License-Identifier: Apache-2.0
// What the user has chosen, in one place; parts of the page listen to the keys they draw from.
import type { MapName } from './colormap';
import { hasLabels, isChangedLabel, kNoEvidence, type Report } from './data';

export interface State {
  tab: 'view' | 'photos' | 'numbers';
  show: 'before' | 'after' | 'both' | 'swipe';
  color: 'photo' | 'distance' | 'epoch' | 'label';
  map: MapName;
  threshold: number;      // edge number, 0 .. levels.count
  hideStatic: boolean;
  cameras: boolean;
  shading: boolean;
  pointSize: number;      // 1 .. 10
  swipe: number;          // 0 .. 1, where before ends and after begins
  photo: number | null;   // index into report.photos
  wipe: number;           // 0 photo .. 1 heat map
  measuring: boolean;
}

// What a point must be to count as changed: the result's own labels, unless the user looks at distances.
export const decidesByLabel = (report: Report, { color }: Pick<State, 'color'>): boolean =>
  hasLabels(report) && color !== 'distance';

// The same as a test of a point: its level and its label.
export const changedTest = (report: Report, state: Pick<State, 'color' | 'threshold'>): ((level: number, label: number) => boolean) =>
  (decidesByLabel(report, state) ? (_, label) => isChangedLabel(label) : (level) => level > state.threshold && level !== kNoEvidence);

type Listener = (state: State) => void;

export class Store {
  private listeners: { keys: Set<keyof State>; run: Listener }[] = [];
  constructor(readonly state: State) {}

  set(patch: Partial<State>): void {
    const changed = (Object.keys(patch) as (keyof State)[]).filter((k) => this.state[k] !== patch[k]);
    if (changed.length === 0) return;
    Object.assign(this.state, patch);
    for (const { keys, run } of this.listeners) {
      if (changed.some((key) => keys.has(key))) run(this.state);
    }
  }

  // Runs at once and after every change of one of the keys.
  on(keys: (keyof State)[], run: Listener): void {
    this.listeners.push({ keys: new Set(keys), run });
    run(this.state);
  }
}
