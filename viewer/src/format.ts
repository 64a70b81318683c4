// SPDX-License-Identifier: Apache-2.0
// Numbers as people read them.

const grouped = new Intl.NumberFormat('en', { useGrouping: true, maximumFractionDigits: 0 });

export const count = (n: number): string => grouped.format(n).replace(/,/g, '\u202f');

// Three significant digits, without an exponent where a reader can do without.
export function number(value: number, digits = 3): string {
  if (!Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const magnitude = Math.abs(value);
  if (magnitude >= 1e6 || magnitude < 1e-4) return value.toExponential(digits - 1);
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(magnitude)));
  return value.toFixed(Math.min(decimals, 8));
}

export function percent(share: number): string {
  if (!Number.isFinite(share)) return '–';
  const p = share * 100;
  return `${p === 0 || p >= 9.995 ? p.toFixed(1) : p >= 0.0995 ? p.toFixed(2) : p.toPrecision(2)} %`;
}

export function seconds(value: number): string {
  if (value < 60) return `${number(value, 3)} s`;
  const minutes = Math.floor(value / 60);
  return `${minutes} min ${Math.round(value - 60 * minutes)} s`;
}

export function bytes(value: number): string {
  return value >= 1e9 ? `${number(value / 1e9)} GB` : value >= 1e6 ? `${number(value / 1e6)} MB`
    : `${number(value / 1e3)} kB`;
}

// "kept_coarse_residual" -> "kept coarse residual"
export const words = (key: string): string => key.replace(/_/g, ' ');

// A long name shortened in the middle, so that number and extension stay.
export function shorten(name: string, length = 32): string {
  const glyphs = Array.from(name);
  if (glyphs.length <= length) return name;
  const tail = Math.floor((length - 1) * 0.45);
  return `${glyphs.slice(0, length - 1 - tail).join('')}…${glyphs.slice(-tail).join('')}`;
}
