// SPDX-License-Identifier: Apache-2.0
// Reports that are empty, huge, hostile or shown by a browser that lacks something.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { fakeReport, fill } from '../tools/fake_report.mjs';
import { difference, getState, launch, open, picture, setState, shot, template, writePage } from './support.mjs';

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

const pageOf = (options) => writePage(fill(template(), fakeReport(options)));

test('no points and no photos', async () => {
  const { page, troubles, close } = await open(browser, pageOf({ points: 0, photos: 0 }));
  assert.ok((await page.textContent('.stage-message')).includes('no points'));
  await page.getByRole('tab', { name: 'Photos' }).click();
  assert.ok((await page.textContent('#pane-photos')).includes('no photos'));
  await page.getByRole('tab', { name: 'Numbers' }).click();
  assert.deepEqual(troubles, []);
  await close();
});

test('one photo an epoch', async () => {
  const { page, troubles, close } = await open(browser, pageOf({ points: 4000, photos: 1, width: 80 }));
  assert.ok(await difference(page, await picture(page)) > 0.02);
  await page.keyboard.press(']');
  await page.keyboard.press('Enter');
  await page.getByRole('tab', { name: 'Photos' }).click();
  assert.equal(await page.locator('.thumb').count(), 2);
  assert.deepEqual(troubles, []);
  await close();
});

test('nothing in a name runs or breaks the page', async () => {
  const evil = ['</script><script>window.hacked=1</script>', '"><img src=x onerror="window.hacked=1">', "';window.hacked=1;//",
    '<!--<script>', '${window.hacked=1}', 'été/写真 🏠.jpg', `${'long'.repeat(300)}.jpg`, '\u2028\u0000\u202e.jpg'];
  const file = pageOf({ points: 2000, photos: 8, width: 48, title: evil.join(' '), name: (_, i) => evil[i],
    summary: { [evil[0]]: evil[1], options: { [evil[1]]: evil[0] }, alignment: { explanation: evil[1] } } });
  const { page, troubles, close } = await open(browser, file);
  for (const tab of ['photos', 'numbers', 'view']) {
    await setState(page, { tab });
    await page.evaluate(() => document.querySelectorAll('details').forEach((d) => { d.open = true; }));
    for (let i = 0; i < 16; ++i) await page.keyboard.press(']');
    const over = await page.evaluate(() => Math.max(...[document.documentElement, document.querySelector('main:not([hidden])')]
      .map((e) => e.scrollWidth - e.clientWidth)));
    assert.ok(over <= 0, `a long name pushes ${tab} apart by ${over} px`);
  }
  assert.equal(await page.evaluate(() => window.hacked), undefined);
  assert.equal(await page.locator('img[src="x"]').count(), 0);
  await page.getByRole('tab', { name: 'Photos' }).click();
  assert.equal(await page.locator('.thumb').nth(5).getAttribute('title'), evil[5], 'the name is shown as it is');
  await shot(page, 'names');
  assert.deepEqual(troubles, []);
  await close();
});

test('the policy of the page forbids what the page never does', async () => {
  const { page, troubles, close } = await open(browser, pageOf({ points: 0, photos: 0 }));
  const outcome = await page.evaluate(async () => {
    const script = document.createElement('script');
    script.textContent = 'window.hacked = 1';
    document.body.append(script);
    const fetched = await fetch('http://localhost:9/').then(() => 'fetched', () => 'refused');
    return { hacked: window.hacked ?? null, fetched };
  });
  assert.deepEqual(outcome, { hacked: null, fetched: 'refused' });
  assert.ok(troubles.some((t) => t.includes('Content Security Policy')), 'because of the policy');
  await close();
});

test('500 photos', async () => {
  const { page, troubles, close } = await open(browser, pageOf({ points: 20000, photos: 250, width: 16 }));
  assert.equal(await page.locator('.thumb').count(), 500);
  await page.getByRole('tab', { name: 'Photos' }).click();
  await page.waitForFunction(() => [...document.querySelectorAll('.thumb img')].some((i) => i.naturalWidth > 0));
  const loaded = await page.evaluate(() => [...document.querySelectorAll('.thumb img')].filter((i) => i.src).length);
  assert.ok(loaded < 400, `${loaded} of 500 thumbnails were unpacked before anybody scrolled to them`);
  assert.deepEqual(troubles, []);
  await close();
});

test('labels and a list of changes are shown when the result has them', async () => {
  const report = fakeReport({ points: 20000, photos: 2, width: 80, labels: true });
  report.changes = [{ class: 'added', epoch: 'after', center: [2, 1.2, 2.4], size: [0.6, 0.55, 0.6], share: 0.4 },
    { class: 'removed', epoch: 'before', center: [-1, 1.2, 1.6], size: [0.6, 0.55, 0.6], share: 0.3 }];
  const { page, troubles, close } = await open(browser, writePage(fill(template(), report)));
  assert.equal((await getState(page)).color, 'label');
  await setState(page, { show: 'after' });
  const added = await picture(page);
  await setState(page, { show: 'before' });
  assert.ok(await difference(page, added, await picture(page)) > 0.05, 'added and removed have colours of their own');
  await page.waitForFunction(() => document.querySelectorAll('.places button').length === 2);
  // The panel counts by label: what was not observed is neither changed nor unchanged.
  const [b, a] = [report.evidence.before.labels, report.evidence.after.labels];
  assert.equal(Number(await page.locator('#label-count').getAttribute('data-count')), b[1] + a[2]);
  assert.ok((await page.textContent('#label-count')).replace(/\s/g, '').includes(`${b[0] + b[1] + a[0] + a[2]}pixels`));
  assert.ok(await page.locator('#threshold').isHidden());
  await setState(page, { color: 'distance' });
  assert.ok(await page.locator('#threshold').isVisible());
  assert.ok(await page.locator('#label-count').isHidden());
  assert.deepEqual(troubles, []);
  await close();
});

test('a damaged page says so', async () => {
  const good = fill(template(), fakeReport({ points: 100, photos: 1, width: 16 }));
  const wrong = good.replace(/("shown":)(\d+)/, (_, key, n) => `${key}${Number(n) + 1}`);
  const short = good.replace(/(id="report-data">.{200})[\s\S]*?<\/script>/, '$1</script>');
  for (const html of [wrong, short]) {
    assert.notEqual(html, good);
    const { page, close } = await open(browser, writePage(html), { ready: 'failed' });
    assert.ok((await page.textContent('[role=alert]')).includes('cannot be shown'));
    await close();
  }
});

test('without WebGL photos and numbers remain, and the page says why', async () => {
  const blind = await launch({ webgl: false });
  const { page, close } = await open(blind, pageOf({ points: 2000, photos: 3, width: 64 }));
  assert.ok((await page.textContent('#no-webgl')).includes('no WebGL'));
  await shot(page, 'no_webgl');
  await page.getByRole('button', { name: 'Show the photos' }).click();
  await page.waitForFunction(() => document.querySelector('.pane canvas').width === 512);
  for (const key of ['n', ']', 'Enter', 'm', 'F2', 'F2', '0', 'ArrowLeft', 'Escape']) await page.keyboard.press(key);
  await page.getByRole('tab', { name: 'Numbers' }).click();
  assert.ok((await page.textContent('#pane-numbers')).includes('Scale ratio'));
  await close();
  await blind.close();
});
