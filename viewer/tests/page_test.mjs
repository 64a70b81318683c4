// SPDX-License-Identifier: Apache-2.0
// What a user does with the page, in a real browser, on a generated report.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { fakeReport, fill } from '../tools/fake_report.mjs';
import { difference, getState, launch, open, picture, setState, settle, shot, template, writePage } from './support.mjs';

let browser;
let file;
let report;
before(async () => {
  browser = await launch();
  report = fakeReport({ points: 60000, photos: 6, width: 160 });
  file = writePage(fill(template(), report));
});
after(() => browser.close());

test('the slider recolours and shows the count of the whole result', async () => {
  const { page, troubles, close } = await open(browser, file);
  assert.ok(await difference(page, await picture(page)) > 0.15, 'points are drawn');
  await shot(page, 'view');
  const panel = await page.locator('.panel').boundingBox();
  assert.ok(panel.x + panel.width <= 900 && panel.width > 200, 'the panel is beside it');
  const slider = page.locator('#threshold');
  for (const k of [0, 40, 125, 200, 250]) {
    await slider.fill(String(k));
    const expected = report.evidence.before.above[k] + report.evidence.after.above[k];
    assert.equal(Number(await page.locator('#changed-count').getAttribute('data-count')), expected);
  }
  await slider.fill('20');
  const low = await picture(page);
  await slider.fill('240');
  assert.ok(await difference(page, low, await picture(page)) > 0.05, 'a lower threshold paints more as changed');
  await page.getByRole('button', { name: 'Back to the result' }).click();
  assert.equal(Number(await slider.inputValue()), report.levels.threshold);
  assert.deepEqual(troubles, []);
  await close();
});

test('every toggle changes the picture, and back again', async () => {
  const { page, troubles, close } = await open(browser, file);
  const start = await picture(page);
  const initial = await getState(page);
  const variants = [
    [{ show: 'before' }, 0.01], [{ show: 'both' }, 0.01], [{ show: 'swipe' }, 0.01], [{ color: 'photo' }, 0.1],
    [{ color: 'epoch' }, 0.1], [{ map: 'safe' }, 0.05], [{ hideStatic: true }, 0.1], [{ cameras: false }, 0.0005],
    [{ pointSize: 10 }, 0.01], [{ shading: false }, 0.01],
  ];
  for (const [patch, least] of variants) {
    await setState(page, patch);
    const changed = await difference(page, start, await picture(page));
    assert.ok(changed > least, `${JSON.stringify(patch)} changed ${changed} of the picture`);
    await setState(page, Object.fromEntries(Object.keys(patch).map((key) => [key, initial[key]])));
  }
  assert.equal(await difference(page, start, await picture(page)), 0);
  assert.deepEqual(troubles, []);
  await close();
});

test('swipe shows before on its left and after on its right', async () => {
  const { page, close } = await open(browser, file);
  const show = async (patch) => { await setState(page, { color: 'photo', ...patch }); return picture(page); };
  const left = await show({ show: 'before' });
  const right = await show({ show: 'after' });
  const both = await show({ show: 'swipe', swipe: 0.5 });
  // Depth shading looks across the seam: a little of it is left out.
  assert.ok(await difference(page, both, left, 0, 0.495) < 0.001);
  assert.ok(await difference(page, both, right, 0.505, 1) < 0.001);
  assert.ok(await difference(page, both, right, 0, 0.495) > 0.005);
  await page.getByRole('slider', { name: /Before left/ }).focus();
  await page.keyboard.press('ArrowRight');
  assert.ok((await getState(page)).swipe > 0.5);
  await shot(page, 'swipe');
  await close();
});

test('clicking a camera shows its photo, and one can look from it', async () => {
  const { page, troubles, close } = await open(browser, file);
  const place = await page.evaluate(() => {
    const { viewer } = window.vggtcd;
    const box = viewer.canvas.getBoundingClientRect();
    // The middle of a camera's picture that is in view and not under a panel of the page.
    for (const f of viewer.frustums.frustums) {
      const c = f.corners[0].clone().add(f.corners[2]).multiplyScalar(0.5).project(viewer.navigation.camera);
      const [x, y] = [box.left + ((c.x + 1) / 2) * box.width, box.top + ((1 - c.y) / 2) * box.height];
      if (c.z < 1 && document.elementFromPoint(x, y) === viewer.canvas) return { x, y };
    }
    return null;
  });
  assert.ok(place, 'a camera is in view at the start');
  await page.mouse.click(place.x, place.y);
  const card = page.getByRole('region', { name: 'Chosen photo' });
  await card.waitFor();
  const photo = report.photos[Number(await card.getAttribute('data-photo'))];
  assert.ok((await card.textContent()).includes(photo.name));
  await page.waitForFunction(() => document.querySelector('.photo-card canvas').width === 960);
  await card.getByRole('button', { name: /Look from here/ }).click();
  await page.waitForFunction(() => window.vggtcd.viewer.navigation.isAtCamera());
  const m = photo.camera_from_world;
  const eye = await page.evaluate(() => window.vggtcd.viewer.navigation.camera.position.toArray());
  for (let a = 0; a < 3; ++a) {  // R eye + t = 0
    assert.ok(Math.abs(m[4 * a] * eye[0] + m[4 * a + 1] * eye[1] + m[4 * a + 2] * eye[2] + m[4 * a + 3]) < 1e-3);
  }
  await shot(page, 'look_from');
  assert.deepEqual(troubles, []);
  await close();
});

test('the view from a camera puts points where its photo has them', async () => {
  const { page, close } = await open(browser, file, { reducedMotion: 'reduce' });
  const index = 8;
  const seen = await page.evaluate((photo) => {
    const { viewer } = window.vggtcd;
    viewer.navigation.lookFrom(viewer.frustums.byPhoto.get(photo));
    const { camera } = viewer.navigation;
    const { clientWidth: width, clientHeight: height } = viewer.element;
    return { width, height, at: [[0, 0.6, 3.1], [1, 1, 3], [-1, 0, 4], [0.5, 1.4, 2.5]].map((x) => {
      const p = camera.position.clone().set(...x).project(camera);
      return { x, px: [(p.x * width) / 2, (-p.y * height) / 2] };
    }) };
  }, index);
  const { camera_from_world: m, intrinsics: [fx, fy], width, height } = report.photos[index];
  const scale = Math.min(seen.width / width, seen.height / height);  // the whole photo fits into the view
  for (const { x, px } of seen.at) {
    const c = [0, 1, 2].map((a) => m[4 * a] * x[0] + m[4 * a + 1] * x[1] + m[4 * a + 2] * x[2] + m[4 * a + 3]);
    const expected = [(scale * fx * c[0]) / c[2], (scale * fy * c[1]) / c[2]];
    assert.ok(Math.hypot(px[0] - expected[0], px[1] - expected[1]) < 0.05, `${px} instead of ${expected}`);
  }
  await close();
});

test('measures the distance between two clicked points', async () => {
  const { page, close } = await open(browser, file, { reducedMotion: 'reduce' });
  await page.evaluate(() => window.vggtcd.viewer.navigation.lookFrom(window.vggtcd.viewer.frustums.byPhoto.get(8)));
  await page.keyboard.press('m');
  const targets = await page.evaluate(() => {
    const { viewer } = window.vggtcd;
    const box = viewer.canvas.getBoundingClientRect();
    return [[0.3, 0.4], [0.45, 0.8], [0.4, 0.5], [0.55, 0.75], [0.5, 0.5]].flatMap(([u, v]) => {
      const picked = viewer.pointAt(u * box.width, v * box.height);
      return picked ? [{ x: box.left + u * box.width, y: box.top + v * box.height, p: picked.position.toArray() }] : [];
    }).slice(0, 2);
  });
  assert.equal(targets.length, 2, 'points lie there');
  for (const { x, y } of targets) await page.mouse.click(x, y);
  const expected = Math.hypot(...[0, 1, 2].map((a) => targets[0].p[a] - targets[1].p[a]));
  const label = page.locator('.measure-label');
  assert.ok(Math.abs(Number(await label.getAttribute('data-distance')) - expected) < 1e-9);
  await shot(page, 'measure');
  await page.keyboard.press('Escape');
  await settle(page);
  assert.ok(await label.isHidden());
  await close();
});

test('everything works by keyboard alone', async () => {
  const { page, troubles, close } = await open(browser, file, { reducedMotion: 'reduce' });
  const eye = () => page.evaluate(() => window.vggtcd.viewer.navigation.camera.position.toArray().join());
  for (const key of ['ArrowLeft', 'ArrowUp', 'Shift+ArrowRight', '+', 'n', '0']) {
    const old = await eye();
    if (key === 'n') await page.waitForFunction(() => document.querySelector('.places button'));
    await page.keyboard.press(key);
    await settle(page);
    assert.notEqual(await eye(), old, `${key} moves`);
  }
  const expected = [['1', 'show', 'before'], ['2', 'show', 'after'], ['3', 'show', 'both'], ['4', 'show', 'swipe'],
    ['c', 'color', 'epoch'], ['b', 'map', 'safe'], [',', 'threshold', report.levels.threshold - 2],
    ['h', 'hideStatic', true], ['v', 'cameras', false], ['e', 'shading', false], [']', 'photo', 0], [']', 'photo', 1],
    ['[', 'photo', 0], ['Escape', 'photo', null], ['m', 'measuring', true], ['Escape', 'measuring', false],
    ['F2', 'tab', 'photos'], ['F2', 'tab', 'numbers'], ['F2', 'tab', 'view']];
  for (const [key, name, value] of expected) {
    await page.keyboard.press(key);
    assert.equal((await getState(page))[name], value, `${key} sets ${name}`);
  }
  await page.keyboard.press('?');
  assert.ok(await page.getByRole('dialog', { name: 'Keys' }).isVisible());
  await page.keyboard.press('Escape');
  // Tab reaches the controls and does not get caught.
  const reached = new Set();
  for (let i = 0; i < 60; ++i) {
    await page.keyboard.press('Tab');
    reached.add(await page.evaluate(() => document.activeElement.id || document.activeElement.tagName));
  }
  for (const id of ['tab-view', 'threshold', 'point-size', 'measure', 'CANVAS']) assert.ok(reached.has(id), `Tab reaches ${id}`);
  assert.deepEqual(troubles, []);
  await close();
});

test('photos stand side by side under a wipe to the heat map', async () => {
  const { page, troubles, close } = await open(browser, file);
  await page.getByRole('tab', { name: 'Photos' }).click();
  await page.locator('.thumb').nth(2).click();
  await page.waitForFunction(() => [...document.querySelectorAll('.pane canvas')].every((c) => c.width === 960));
  await page.waitForFunction((name) => document.querySelector('.pane canvas').getAttribute('aria-label').includes(name),
    report.photos[2].name);
  const looks = new Set();
  const look = async () => looks.add(await page.evaluate(() => document.querySelector('.pane canvas').toDataURL()));
  for (const wipe of ['0', '0.5', '1']) {
    await page.locator('#photos-wipe').fill(wipe);
    await look();
  }
  await setState(page, { threshold: 20 });
  await look();
  assert.equal(looks.size, 4, 'photo, half, heat map and another threshold look different');
  // The other pane shows a photo of the other epoch.
  const paired = Number(await page.locator('.thumb.paired').getAttribute('data-photo'));
  assert.equal(report.photos[paired].epoch, 'after');
  await setState(page, { threshold: report.levels.threshold, wipe: 0.5 });
  await shot(page, 'photos');
  assert.deepEqual(troubles, []);
  await close();
});

test('numbers show verdict, residuals, plots and options', async () => {
  const { page, troubles, close } = await open(browser, file, { colorScheme: 'dark' });
  await page.getByRole('tab', { name: 'Numbers' }).click();
  const text = await page.locator('#pane-numbers').textContent();
  for (const part of ['Refined: the median residual fell', '× 1.731', '0.01920 u', '0.007100 u', 'max correspondences',
    'coarse', 'grid resolution']) {
    assert.ok(text.includes(part), `the numbers say "${part}"`);
  }
  assert.equal(await page.locator('.trajectories circle').count(), 12);
  assert.equal(await page.locator('.card .histogram rect').count(), 50);
  await shot(page, 'numbers_dark');
  assert.deepEqual(troubles, []);
  await close();
});

test('a phone shows everything without sideways scrolling', async () => {
  const { page, troubles, close } = await open(browser, file, { width: 390, height: 780, hasTouch: true, isMobile: true,
    colorScheme: 'dark' });
  for (const tab of ['photos', 'numbers', 'view']) {
    await setState(page, { tab });
    const over = await page.evaluate(() => Math.max(...[document.documentElement, ...document.querySelectorAll('main:not([hidden])')]
      .map((e) => e.scrollWidth - e.clientWidth)));
    assert.ok(over <= 0, `${tab} is ${over} px too wide`);
    await shot(page, `phone_${tab}`);
  }
  assert.ok(await difference(page, await picture(page)) > 0.1);
  assert.deepEqual(troubles, []);
  await close();
});

test('light and dark follow the system until one is chosen, and text keeps its contrast', async () => {
  const { page, close } = await open(browser, file, { colorScheme: 'dark' });
  const contrasts = () => page.evaluate(() => {
    const style = getComputedStyle(document.documentElement);
    const luminance = (name) => {
      const hex = style.getPropertyValue(name).trim();
      const [r, g, b] = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255)
        .map((c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
      return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const pairs = [['--ink', '--panel'], ['--muted', '--panel'], ['--muted', '--page'], ['--muted', '--soft'],
      ['--accent', '--panel'], ['--on-accent', '--accent'], ['--before', '--panel'], ['--after', '--panel']];
    return pairs.map(([a, b]) => {
      const [x, y] = [luminance(a), luminance(b)].sort((p, q) => q - p);
      return { pair: `${a} on ${b}`, ratio: (x + 0.05) / (y + 0.05) };
    });
  });
  const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
  const check = async () => {
    for (const { pair, ratio } of await contrasts()) assert.ok(ratio >= 4.5, `${await theme()}: ${pair} ${ratio} (WCAG AA: 4.5)`);
  };
  assert.equal(await theme(), 'dark');
  await check();
  const dark = await picture(page);
  await page.emulateMedia({ colorScheme: 'light' });
  await page.waitForFunction(() => document.documentElement.dataset.theme === 'light');
  await check();
  assert.ok(await difference(page, dark, await picture(page)) > 0.1, 'the 3D view follows');
  await page.getByRole('button', { name: 'Dark theme' }).click();
  await page.emulateMedia({ colorScheme: 'dark' });
  await page.emulateMedia({ colorScheme: 'light' });
  assert.equal(await theme(), 'dark');
  await close();
});
