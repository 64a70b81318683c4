#!/usr/bin/env node
// SPDX-License-Identifier: Apache-2.0
// Load time and frame rate of the report page in headless Chromium with software rendering, beside the peer:
// three.js's own PointsMaterial drawing the same points from float positions, same size, same view, same run.
// Usage: bench/viewer.mjs [millions of points ...]     default: 0.2 1.5 5
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { createRequire } from 'node:module';
import { statSync } from 'node:fs';

const viewer = path.join(path.dirname(path.dirname(fileURLToPath(import.meta.url))), 'viewer');
const { launch, open, template, writePage } = await import(path.join(viewer, 'tests', 'support.mjs'));
const { fakeReport, fill } = await import(path.join(viewer, 'tools', 'fake_report.mjs'));
const esbuild = createRequire(path.join(viewer, 'package.json'))('esbuild');

const peer = esbuild.buildSync({
  stdin: { resolveDir: viewer, contents: `
    import * as THREE from 'three';
    window.peerFrame = (clouds, like, width, height, frames) => {
      const renderer = new THREE.WebGLRenderer({ antialias: false });
      renderer.setSize(width, height, false);
      const scene = new THREE.Scene();
      for (const { header, positionLevel: q, colorLabel: c } of clouds) {
        const n = q.length / 4, x = new Float32Array(3 * n), rgb = new Float32Array(3 * n);
        for (let i = 0; i < n; ++i) for (let a = 0; a < 3; ++a) {
          x[3 * i + a] = header.box_min[a] + q[4 * i + a] * header.box_size[a] / 65535;
          rgb[3 * i + a] = c[4 * i + a] / 255;
        }
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute('position', new THREE.BufferAttribute(x, 3));
        geometry.setAttribute('color', new THREE.BufferAttribute(rgb, 3));
        scene.add(new THREE.Points(geometry, new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true })));
      }
      const camera = new THREE.PerspectiveCamera(like.fov, width / height, like.near, like.far);
      camera.position.copy(like.position); camera.quaternion.copy(like.quaternion);
      const wait = () => renderer.getContext().readPixels(0, 0, 1, 1, 0x1908, 0x1401, new Uint8Array(4));
      renderer.render(scene, camera); wait();
      const start = performance.now();
      for (let i = 0; i < frames; ++i) { renderer.render(scene, camera); wait(); }
      return (performance.now() - start) / frames;
    };` },
  bundle: true, write: false, format: 'iife',
}).outputFiles[0].text;

const rows = [];
for (const millions of process.argv.slice(2).map(Number).concat(process.argv.length > 2 ? [] : [0.2, 1.5, 5])) {
  const file = writePage(fill(template(), fakeReport({ points: millions * 1e6 * 1.13, photos: 12, width: 320 })));
  const browser = await launch();
  const start = Date.now();
  const { page } = await open(browser, file, { width: 1280, height: 800, bypassCSP: true });
  const load = (Date.now() - start) / 1000;
  await page.evaluate(() => window.vggtcd.store.set({ show: 'both', color: 'distance' }));
  const time = (patch, frames) => page.evaluate(([p, n]) => {
    const { store, viewer } = window.vggtcd;
    store.set(p);
    viewer.renderNow();
    const begin = performance.now();
    for (let i = 0; i < n; ++i) { viewer.navigation.turn(0.02, 0); viewer.renderNow(); }
    return (performance.now() - begin) / n;
  }, [patch, frames]);
  const shaded = await time({ shading: true }, 6);
  const plain = await time({ shading: false }, 6);
  // What the hand feels: frames that come while turning, with the sampling that keeps it fluent.
  const moving = await page.evaluate(() => new Promise((done) => {
    const { store, viewer } = window.vggtcd;
    store.set({ shading: true });
    const begin = performance.now();
    let frames = 0;
    const step = (now) => {
      if (now - begin > 4000) { done(frames / ((now - begin) / 1000)); return; }
      if (now - begin > 1000 || frames > 0) ++frames;
      viewer.navigation.turn(0.01, 0);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }));
  const shown = await page.evaluate(() => window.vggtcd.report.clouds.reduce((n, c) => n + c.shown, 0));
  await page.addScriptTag({ content: peer });
  const theirs = await page.evaluate(() => {
    const { viewer } = window.vggtcd;
    const { clientWidth, clientHeight } = viewer.element;
    return window.peerFrame(viewer.layers.map((layer) => layer.cloud), viewer.navigation.camera, clientWidth, clientHeight, 6);
  });
  rows.push({ shown, mb: statSync(file).size / 1e6, load, plain, shaded, moving, theirs });
  await browser.close();
}
const cell = (value, digits) => value.toFixed(digits).padStart(9);
console.log('| points | page, MB | load, s | full frame, ms | with depth shading, ms | while turning, frames/s | PointsMaterial, ms | its time / ours |');
console.log('|---:|---:|---:|---:|---:|---:|---:|---:|');
for (const r of rows) {
  console.log(`| ${String(r.shown).padStart(8)} | ${cell(r.mb, 1)} | ${cell(r.load, 2)} | ${cell(r.plain, 0)} | ${cell(r.shaded, 0)} | ` +
    `${cell(r.moving, 1)} | ${cell(r.theirs, 0)} | ${cell(r.theirs / r.plain, 2)} |`);
}
