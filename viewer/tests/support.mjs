// SPDX-License-Identifier: Apache-2.0
// A real, headless Chromium for the tests of the page; software rendering, no network.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { inflateRawSync } from 'node:zlib';

export const viewerDir = path.dirname(path.dirname(fileURLToPath(import.meta.url)));

const chromiumPath = process.env.VGGTCD_CHROMIUM ??
  ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'].find(existsSync);

// ctest counts 77 as skipped: the checked-in page can be built in where npm is not, but not be tested there.
export async function launch({ webgl = true } = {}) {
  const playwright = await import('playwright-core').catch(() => null);
  if (!playwright || !chromiumPath) {
    console.log(playwright ? 'skipped: no chromium' : 'skipped: viewer/node_modules is missing (npm ci)');
    process.exit(77);
  }
  return playwright.chromium.launch({
    executablePath: chromiumPath,
    args: ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
      '--disable-component-update', '--disable-sync',
      ...(webgl ? ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'] : ['--disable-gpu', '--disable-3d-apis'])],
  });
}

// The built page without data.
export const template = () => readFileSync(
  process.env.VGGTCD_TEMPLATE ?? path.join(viewerDir, 'dist', 'index.html'), 'utf8');

const scratch = mkdtempSync(path.join(tmpdir(), 'vggtcd-viewer-'));
process.on('exit', () => rmSync(scratch, { recursive: true, force: true }));
let pages = 0;
export function writePage(html) {
  const file = path.join(scratch, `page${++pages}.html`);
  writeFileSync(file, html);
  return file;
}

// Only a hang takes so long, on whatever machine and however loaded.
const HANG_MS = 1800_000;

// Opens a report and waits until it is drawn. `troubles` collects whatever must not happen: errors and
// warnings of the console, dialogs, and requests to anywhere.
export async function open(browser, file, { width = 900, height = 600, ready = 'true', ...options } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, offline: true, ...options });
  context.setDefaultTimeout(HANG_MS);
  const page = await context.newPage();
  const troubles = [];
  page.on('console', (message) => {
    // Chromium's own remark about reading back pixels, which is what the tests do.
    if (/GPU stall due to ReadPixels/.test(message.text())) return;
    if (['error', 'warning'].includes(message.type())) troubles.push(`${message.type()}: ${message.text()}`);
  });
  page.on('pageerror', (error) => troubles.push(`exception: ${error.message}`));
  page.on('request', (request) => {
    const url = request.url();
    if (!/^(blob|data):/.test(url) && url !== pathToFileURL(file).href) troubles.push(`request: ${url}`);
  });
  page.on('dialog', (dialog) => { troubles.push(`dialog: ${dialog.message()}`); void dialog.dismiss(); });
  await page.goto(pathToFileURL(file).href);
  await page.waitForFunction((value) => document.documentElement.dataset.ready === value, ready);
  return { page, troubles, close: () => context.close() };
}

export const setState = (page, patch) => page.evaluate((p) => window.vggtcd.store.set(p), patch);
export const getState = (page) => page.evaluate(() => ({ ...window.vggtcd.store.state }));

// Until what was asked for has been drawn.
export const settle = (page) => page.evaluate(() => new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 50)))));

// What the canvas of the 3D view shows, as a picture whose pixels stay in the browser.
export async function picture(page) {
  return page.evaluate(() => {
    const { viewer } = window.vggtcd;
    viewer.renderNow();
    const gl = viewer.canvas.getContext('webgl2');
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    const rgba = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    window.pictures ??= [];
    return window.pictures.push({ width, height, rgba }) - 1;
  });
}

// Share of the pixels in the columns [from, to) (shares of the width) that differ visibly between two
// pictures; without a second one, from the colour of the first one's corner.
export function difference(page, a, b = null, from = 0, to = 1) {
  return page.evaluate(([first, second, left, right]) => {
    const p = window.pictures[first];
    const q = second === null ? null : window.pictures[second];
    let differing = 0;
    let all = 0;
    for (let y = 0; y < p.height; ++y) {
      for (let x = Math.ceil(left * p.width); x < right * p.width; ++x) {
        const i = 4 * (y * p.width + x);
        let d = 0;
        for (let c = 0; c < 3; ++c) d += Math.abs(p.rgba[i + c] - (q ? q.rgba[i + c] : p.rgba[c]));
        differing += d > 24 ? 1 : 0;
        ++all;
      }
    }
    return differing / all;
  }, [a, b, from, to]);
}

// A screenshot for people to look at, if VGGTCD_SHOTS names a directory.
export async function shot(page, name) {
  const directory = process.env.VGGTCD_SHOTS;
  if (!directory) return;
  mkdirSync(directory, { recursive: true });
  await settle(page);
  await page.screenshot({ path: path.join(directory, `${name}.png`) });
}

// --- just enough of .npz to count scores: stored or deflated float32 arrays ---
export function readNpz(file) {
  const bytes = readFileSync(file);
  const arrays = {};
  let end = bytes.length - 22;
  while (bytes.readUInt32LE(end) !== 0x06054b50) --end;
  let at = bytes.readUInt32LE(end + 16);
  for (let i = 0; i < bytes.readUInt16LE(end + 10); ++i) {
    const method = bytes.readUInt16LE(at + 10);
    const size = bytes.readUInt32LE(at + 20);
    const nameSize = bytes.readUInt16LE(at + 28);
    const name = bytes.toString('utf8', at + 46, at + 46 + nameSize);
    const local = bytes.readUInt32LE(at + 42);
    const begin = local + 30 + bytes.readUInt16LE(local + 26) + bytes.readUInt16LE(local + 28);
    const raw = bytes.subarray(begin, begin + size);
    assert.ok(size < 0xffffffff && [0, 8].includes(method), `${name}: a small, stored or deflated member`);
    arrays[name.replace(/\.npy$/, '')] = () => readNpy(method === 8 ? inflateRawSync(raw) : raw);
    at += 46 + nameSize + bytes.readUInt16LE(at + 30) + bytes.readUInt16LE(at + 32);
  }
  return arrays;
}

function readNpy(bytes) {
  const header = bytes.toString('latin1', 10, 10 + bytes.readUInt16LE(8));
  assert.match(header, /'descr': '<f4'/);
  const data = Uint8Array.from(bytes.subarray(10 + bytes.readUInt16LE(8)));
  return new Float32Array(data.buffer);
}
