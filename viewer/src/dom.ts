// SPDX-License-Identifier: Apache-2.0
// Building elements. Text always goes in as text: no string of a report is ever parsed as HTML.

type Child = Node | string | null | undefined;
type Props = Record<string, string | number | boolean | ((event: never) => void) | undefined>;

function fill(element: Element, props: Props, children: Child[]): void {
  for (const [key, value] of Object.entries(props)) {
    if (value === undefined || value === false) continue;
    if (typeof value === 'function') {
      element.addEventListener(key.replace(/^on/, ''), value as unknown as EventListener);
    } else {
      element.setAttribute(key, value === true ? '' : String(value));
    }
  }
  element.append(...children.filter((child): child is Node | string => child != null));
}

// h('button', { class: 'x', onclick: f }, 'text', node): attributes by their HTML names.
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K, props: Props = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  fill(element, props, children);
  return element;
}

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K, props: Props = {}, ...children: Child[]): SVGElementTagNameMap[K] {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  fill(element, props, children);
  return element;
}

// One of several, as radio buttons that look like a segmented switch; arrows move it as radios do.
export function segmented<T extends string>(
  label: string, options: readonly (readonly [T, string])[], current: T,
  onChange: (value: T) => void): { root: HTMLElement; set: (value: T) => void } {
  const name = `seg-${label.toLowerCase().replace(/\W+/g, '-')}`;
  const inputs = options.map(([value]) =>
    h('input', { type: 'radio', name, value, checked: value === current,
      onchange: () => onChange(value) }));
  const root = h('fieldset', { class: 'segmented' }, h('legend', {}, label),
    h('div', { class: 'segments' },
      ...options.map(([, text], i) => h('label', {}, inputs[i], h('span', {}, text)))));
  return {
    root,
    set: (value) => options.forEach(([v], i) => { inputs[i]!.checked = v === value; }),
  };
}

export function checkbox(label: string, key: string, checked: boolean, onChange: (on: boolean) => void):
    { root: HTMLElement; set: (on: boolean) => void } {
  const input = h('input', { type: 'checkbox', checked, onchange: () => onChange(input.checked) });
  return {
    root: h('label', { class: 'check' }, input, h('span', {}, label), h('kbd', {}, key)),
    set: (on) => { input.checked = on; },
  };
}
