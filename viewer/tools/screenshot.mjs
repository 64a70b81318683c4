#!/usr/bin/env node
// SPDX-License-Identifier: Apache-2.0
// Takes the picture of a report page that the README shows.
// Usage: viewer/tools/screenshot.mjs PAGE.html OUT.png [--width PX] [--height PX] [--dark] [--state JSON]
//   --state: what to choose first, e.g. '{"show":"swipe","color":"photo"}' (viewer/src/store.ts)
import path from 'node:path';
import { launch, open, setState, settle } from '../tests/support.mjs';

const [page_path, out] = process.argv.slice(2);
const flag = (name, fallback) => {
  const i = process.argv.indexOf(name);
  return i < 0 ? fallback : process.argv[i + 1];
};
const browser = await launch();
const { page } = await open(browser, path.resolve(page_path), {
  width: Number(flag('--width', 1440)), height: Number(flag('--height', 900)),
  colorScheme: process.argv.includes('--dark') ? 'dark' : 'light', reducedMotion: 'reduce',
});
await setState(page, JSON.parse(flag('--state', '{}')));
await page.waitForTimeout(600);  // photos are unpacked in the background
await settle(page);
await page.screenshot({ path: out });
await browser.close();
