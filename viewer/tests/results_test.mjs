// SPDX-License-Identifier: Apache-2.0
// The page that the program writes for the bundled example, against the files beside it.
// Usage: node results_test.mjs PROGRAM EXAMPLE      (the program and a directory with t1, t2 and joint .npz)
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { difference, getState, launch, open, picture, readNpz, setState, shot } from './support.mjs';

const [program, example] = process.argv.slice(2);
const work = mkdtempSync(path.join(tmpdir(), 'vggtcd-results-'));
const out = path.join(work, 'out');
const file = path.join(out, 'report.html');
const run = (...args) => execFileSync(program, args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
const status = (...args) => {
  try { run(...args); return { status: 0, stderr: '' }; } catch (e) { return { status: e.status, stderr: e.stderr }; }
};

let browser;
let summary;
before(async () => {
  browser = await launch();
  run('detect', path.join(example, 't1.npz'), path.join(example, 't2.npz'), '--joint', path.join(example, 'joint.npz'),
    '--method', 'paper', '-o', out);
  run('view', out);
  summary = JSON.parse(readFileSync(path.join(out, 'summary.json'), 'utf8'));
});
after(async () => {
  await browser?.close();
  rmSync(work, { recursive: true, force: true });
});

test('loads without errors or requests and draws the scene', async () => {
  const { page, troubles, close } = await open(browser, file, { width: 1280, height: 800 });
  assert.ok(await difference(page, await picture(page)) > 0.1);
  assert.ok((await page.textContent('.headline')).includes(summary.alignment.explanation));
  await shot(page, 'example');
  await setState(page, { color: 'photo', show: 'swipe' });
  await shot(page, 'example_swipe');
  await setState(page, { tab: 'photos' });
  await page.waitForFunction(() => document.querySelector('.pane canvas').width > 100);
  await shot(page, 'example_photos');
  await setState(page, { tab: 'numbers' });
  await shot(page, 'example_numbers');
  assert.deepEqual(troubles, []);
  await close();
});

test('the slider shows the count of change.npz', async () => {
  const arrays = readNpz(path.join(out, 'change.npz'));
  const scores = [arrays.score_t1(), arrays.score_t2()];
  const { page, close } = await open(browser, file);
  const { threshold, count } = await page.evaluate(() => window.vggtcd.report.levels);
  for (const k of [0, 1, Math.round(threshold / 2), threshold, threshold + 1, count]) {
    await page.locator('#threshold').fill(String(k));
    // The slider stands at this float; a score is changed if it is greater. NaN is not.
    const edge = Math.fround(k === threshold ? summary.change.threshold_u : (summary.change.threshold_u * k) / threshold);
    const expected = scores.reduce((sum, s) => sum + s.reduce((n, x) => n + (x > edge ? 1 : 0), 0), 0);
    assert.equal(Number(await page.locator('#changed-count').getAttribute('data-count')), expected, `edge ${k}`);
  }
  await page.locator('#threshold').fill(String(threshold));
  assert.equal(Number(await page.locator('#changed-count').getAttribute('data-count')),
    summary.change.t1.changed + summary.change.t2.changed);
  await close();
});

test('every photo is there, and a camera leads to it', async () => {
  const { page, close } = await open(browser, file);
  const { before: b, after: a } = summary.inputs;
  assert.equal(await page.locator('.thumb').count(), b.frames + a.frames);
  await page.keyboard.press(']');
  await page.waitForFunction(() => document.querySelector('.photo-card canvas').width > 100);
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => window.vggtcd.viewer.navigation.isAtCamera());
  // Seen from its camera, the cloud of that epoch covers most of the picture.
  assert.equal((await getState(page)).show, 'before');
  await setState(page, { color: 'photo', photo: null, cameras: false });
  assert.ok(await difference(page, await picture(page), null, 0.3, 0.7) > 0.5);
  await shot(page, 'example_look_from');
  await close();
});

test('--max-points keeps the changed points, and the page says what it left out', async () => {
  const small = path.join(work, 'small.html');
  const changed = summary.change.t1.changed + summary.change.t2.changed;
  run('view', out, '--max-points', String(changed + 1000), '-o', small);
  assert.ok(statSync(small).size < statSync(file).size);
  const { page, close } = await open(browser, small);
  const clouds = await page.evaluate(() => window.vggtcd.report.clouds);
  assert.ok(clouds.every((cloud) => cloud.changed === cloud.changed_shown + Math.min(cloud.far_away, cloud.changed - cloud.changed_shown)));
  assert.equal(clouds.reduce((sum, cloud) => sum + cloud.shown, 0), changed + 1000);
  assert.match(await page.textContent('#shown-note'), /points are shown/);
  await close();
});

test('what is no result is refused in one line', () => {
  for (const [args, code, part] of [
    [['view', work], 3, 'summary.json'],
    [['view', path.join(work, 'nowhere')], 3, 'nowhere'],
    [['view', out, '--max-points', '-1'], 2, '--max-points'],
    [['view', out, '-o', path.join(work, 'no', 'such', 'page.html')], 6, 'page.html'],
  ]) {
    const { status: found, stderr } = status(...args);
    assert.equal(found, code, `${args.join(' ')}: ${stderr}`);
    assert.equal(stderr.trim().split('\n').length, 1);
    assert.ok(stderr.includes(part), stderr);
  }
});
