// SPDX-License-Identifier: Apache-2.0
// The divider between before (left) and after (right) in the 3D view.
import { h } from '../dom';
import type { Store } from '../store';

export function makeSwipe(parent: HTMLElement, store: Store): HTMLElement {
  const handle = h('div', { class: 'swipe', role: 'slider', tabindex: 0, 'aria-label': 'Before left, after right',
    'aria-valuemin': 0, 'aria-valuemax': 100 }, h('span', { class: 'left' }, 'Before'), h('b', {}, '‹ ›'),
    h('span', { class: 'right' }, 'After'));
  const set = (value: number): void => store.set({ swipe: Math.min(1, Math.max(0, value)) });
  handle.addEventListener('pointerdown', (e) => { handle.setPointerCapture(e.pointerId); e.preventDefault(); handle.focus(); });
  handle.addEventListener('pointermove', (e) => {
    if (!handle.hasPointerCapture(e.pointerId)) return;
    const box = parent.getBoundingClientRect();
    set((e.clientX - box.left) / box.width);
  });
  handle.addEventListener('keydown', (e) => {
    const step = e.key === 'ArrowLeft' ? -0.02 : e.key === 'ArrowRight' ? 0.02 : 0;
    if (step === 0) return;
    e.preventDefault();
    set(store.state.swipe + step);
  });
  store.on(['show', 'swipe'], ({ show, swipe }) => {
    handle.hidden = show !== 'swipe';
    handle.style.left = `${swipe * 100}%`;
    handle.setAttribute('aria-valuenow', String(Math.round(swipe * 100)));
  });
  return handle;
}
