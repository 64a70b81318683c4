// SPDX-License-Identifier: Apache-2.0
// The 3D view: clouds, cameras, navigation, swipe and measuring. Draws only when something changed.
import * as THREE from 'three';
import { levelTable } from '../colormap';
import type { Cloud, Report } from '../data';
import { changedTest, decidesByLabel, type State, type Store } from '../store';
import { DepthShading } from './depth_shading';
import { FrustumLayer, type Frustum } from './frustums';
import { Measure } from './measure';
import { Navigation } from './navigation';
import { pickFrustum, pickPoint, type PickedPoint } from './pick';
import { kPasses, makeUniforms, PointLayer, type PointUniforms } from './points';

const kModes: Record<State['color'], number> = { photo: 0, distance: 1, epoch: 2, label: 3 };

// Throws if this browser has no WebGL 2.
export class Viewer {
  readonly frustums: FrustumLayer;
  readonly navigation: Navigation;
  readonly measure: Measure;
  onPhotoClicked: (photo: number) => void = () => {};
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly uniforms: PointUniforms;
  private readonly shading = new DepthShading();
  private readonly background = new THREE.Color();
  private layers: PointLayer[] = [];
  private movingPasses = kPasses;  // how much of the clouds is drawn while the eye moves
  private lastMovingMs = 0;
  private scheduled = false;
  private whole = false;           // the frame that is asked for is to be complete
  private settle = 0;

  constructor(readonly element: HTMLElement, readonly report: Report, readonly store: Store) {
    THREE.ColorManagement.enabled = false;  // colours are written as they are stored
    this.renderer = new THREE.WebGLRenderer({ antialias: false, powerPreference: 'high-performance' });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.renderer.autoClear = false;
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute('role', 'application');
    canvas.setAttribute('aria-label',
      '3D view of both epochs. Arrow keys turn, plus and minus zoom, question mark lists all keys.');
    element.append(canvas);

    const extent = report.scene.extent;
    this.uniforms = makeUniforms(levelTable(store.state.map, store.state.threshold, report.levels.count));
    this.frustums = new FrustumLayer(report.photos, 0.05 * extent);
    this.navigation = new Navigation(canvas, extent, this.frustums.frustums, () => this.draw(true));
    this.measure = new Measure(element, report.unit, () => this.draw());
    this.scene.add(this.frustums.object, this.measure.object);
    this.listen(canvas);

    store.on(['threshold', 'map'], ({ map, threshold }) => {
      this.uniforms.levels.value.image.data!.set(levelTable(map, threshold, report.levels.count));
      this.uniforms.levels.value.needsUpdate = true;
      this.uniforms.threshold.value = threshold;
      this.draw();
    });
    store.on(['color', 'hideStatic', 'pointSize', 'cameras', 'show', 'swipe', 'shading'], (state) => {
      this.uniforms.mode.value = kModes[state.color];
      this.uniforms.by_label.value = decidesByLabel(report, state);
      this.uniforms.hide_static.value = state.hideStatic;
      this.uniforms.point_size.value = 0.25 * state.pointSize * this.spacing;
      this.draw();
    });
    new ResizeObserver(() => this.resize()).observe(element);
    this.resize();
  }

  // About the distance between neighbouring points, were they spread over a few square extents.
  private get spacing(): number {
    const most = Math.max(...this.report.clouds.map((cloud) => cloud.shown), 2000);
    return this.report.scene.extent * Math.sqrt(2.5 / most);
  }

  addClouds(clouds: Cloud[]): void {
    this.layers = clouds.map((cloud) => new PointLayer(cloud, this.uniforms));
    this.scene.add(...this.layers.map((layer) => layer.object));
    this.uniforms.round_points.value = clouds.reduce((n, cloud) => n + cloud.header.shown, 0) < 400000;
    this.navigation.setHome(clouds);
    this.navigation.home(false);
    this.draw();
  }

  setTheme(background: string, ink: string): void {
    this.background.set(background);
    this.frustums.setInk(ink);
    this.measure.setInk(ink);
    this.draw();
  }

  get canvas(): HTMLCanvasElement { return this.renderer.domElement; }

  // Asks for a frame; moving frames may draw fewer points, the last one never does.
  draw(moving = false): void {
    this.whole ||= !moving;
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame((now) => {
      this.scheduled = false;
      const whole = this.whole;
      this.whole = false;
      if (!whole) this.adapt(now);
      this.render(whole ? kPasses : this.movingPasses);
    });
  }

  // Draws one whole frame now and waits for it: for measuring.
  renderNow(): void {
    this.render(kPasses);
    this.renderer.getContext().readPixels(0, 0, 1, 1, 0x1908, 0x1401, new Uint8Array(4));
  }

  private adapt(now: number): void {
    const pause = now - this.lastMovingMs;
    const interval = pause < 1500 ? pause : 0;  // 0: the movement begins
    this.lastMovingMs = now;
    if (interval > 55) this.movingPasses = Math.max(1, this.movingPasses >> 1);
    else if (interval > 0 && interval < 24) this.movingPasses = Math.min(kPasses, this.movingPasses + 1);
    // When the eye rests, everything; on a slow machine only after longer than a frame takes.
    window.clearTimeout(this.settle);
    this.settle = window.setTimeout(() => this.draw(), Math.max(180, 2 * interval));
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.shading.setSize(Math.round(width * ratio), Math.round(height * ratio));
    this.navigation.resize(width, height);
    this.draw();
  }

  private render(passes: number): void {
    const { state } = this.store;
    const { camera } = this.navigation;
    const size = this.renderer.getDrawingBufferSize(new THREE.Vector2());
    const ratio = this.renderer.getPixelRatio();
    this.uniforms.px_per_unit.value = size.y / (2 * Math.tan(THREE.MathUtils.degToRad(camera.fov) / 2));
    this.uniforms.min_size.value = Math.max(1, 0.35 * ratio * Math.sqrt(state.pointSize));
    this.navigation.update();
    for (const layer of this.layers) layer.setPasses(passes);
    this.frustums.object.visible = state.cameras;
    this.frustums.showPicture(!this.navigation.isAtCamera());

    const target = state.shading ? this.shading.target : null;
    this.renderer.setRenderTarget(target);
    this.renderer.setClearColor(this.background);
    this.renderer.clear();
    if (state.show === 'swipe') {
      const split = Math.round(size.x * state.swipe);
      this.renderPart(target, 'before', 0, split, size.y, ratio);
      this.renderPart(target, 'after', split, size.x - split, size.y, ratio);
    } else {
      this.renderPart(target, state.show, 0, size.x, size.y, ratio);
    }
    if (target) this.shading.draw(this.renderer, camera, this.background, 1.2 * ratio);
    this.measure.place(camera, this.element.clientWidth, this.element.clientHeight);
  }

  // Draws one epoch, or both, into the columns [x, x + width) of the picture.
  private renderPart(target: THREE.WebGLRenderTarget | null, show: 'before' | 'after' | 'both', x: number,
                     width: number, height: number, ratio: number): void {
    if (width <= 0) return;
    for (const layer of this.layers) {
      layer.object.visible = show === 'both' || show === layer.cloud.header.epoch;
    }
    if (target) {
      target.scissorTest = true;
      target.scissor.set(x, 0, width, height);
      this.renderer.setRenderTarget(target);
    } else {
      this.renderer.setScissorTest(true);
      this.renderer.setScissor(x / ratio, 0, width / ratio, height / ratio);
    }
    this.renderer.render(this.scene, this.navigation.camera);
    if (target) target.scissorTest = false;
    else this.renderer.setScissorTest(false);
  }

  private listen(canvas: HTMLCanvasElement): void {
    let down: { x: number; y: number } | null = null;
    canvas.addEventListener('pointerdown', (e) => { down = { x: e.clientX, y: e.clientY }; });
    canvas.addEventListener('pointerup', (e) => {
      if (down && Math.hypot(e.clientX - down.x, e.clientY - down.y) < 5) {
        const box = canvas.getBoundingClientRect();
        this.click(e.clientX - box.left, e.clientY - box.top);
      }
      down = null;
    });
    canvas.addEventListener('pointermove', (e) => {
      if (e.buttons !== 0 || e.pointerType === 'touch') return;
      const box = canvas.getBoundingClientRect();
      const over = !this.store.state.measuring &&
        this.frustumAt(e.clientX - box.left, e.clientY - box.top) !== null;
      canvas.style.cursor = this.store.state.measuring ? 'crosshair' : over ? 'pointer' : 'grab';
    });
  }

  private frustumAt(x: number, y: number): Frustum | null {
    if (!this.store.state.cameras || this.navigation.isAtCamera()) return null;
    return pickFrustum(this.frustums.frustums, this.navigation.camera, x, y, this.element.clientWidth,
      this.element.clientHeight);
  }

  // A click at this place of the view: a measuring point, or a camera.
  click(x: number, y: number): void {
    if (this.store.state.measuring) {
      this.measure.add(this.pointAt(x, y));
      return;
    }
    const frustum = this.frustumAt(x, y);
    if (frustum) this.onPhotoClicked(frustum.photo);
  }

  pointAt(x: number, y: number): PickedPoint | null {
    const { show, swipe, hideStatic, threshold, color } = this.store.state;
    const { clientWidth: width, clientHeight: height } = this.element;
    const shown = show === 'swipe' ? (x < swipe * width ? 'before' : 'after') : show;
    const changed = changedTest(this.report, { color, threshold });
    const accepts = (level: number, label: number): boolean => !hideStatic || changed(level, label);
    return pickPoint(this.layers.filter(({ cloud }) => shown === 'both' || shown === cloud.header.epoch)
      .map(({ cloud }) => ({ cloud, accepts })), this.navigation.camera, x, y, width, height, 9);
  }
}
