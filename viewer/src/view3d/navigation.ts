// SPDX-License-Identifier: Apache-2.0
// Where the eye is: orbit, pan and zoom by mouse, touch and keyboard; flights to places and to photos.
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { Cloud } from '../data';
import type { Frustum } from './frustums';

const kFovDeg = 50;
interface Stand { position: THREE.Vector3; target: THREE.Vector3; up: THREE.Vector3; fov: number }

export class Navigation {
  readonly camera: THREE.PerspectiveCamera;
  private controls: OrbitControls;
  private readonly sceneUp: THREE.Vector3;
  private homeStand: Stand;
  private flight: { from: Stand; to: Stand; startMs: number; frustum: Frustum | null } | null = null;
  private atFrustum: Frustum | null = null;
  private aspect = 1;
  private readonly calm = window.matchMedia('(prefers-reduced-motion: reduce)').matches;

  constructor(private readonly canvas: HTMLElement, private readonly extent: number,
              private readonly frustums: Frustum[], private readonly changed: () => void) {
    this.camera = new THREE.PerspectiveCamera(kFovDeg, 1, extent / 500, extent * 40);
    // Photographers hold their cameras upright, on average. Without cameras: y points down.
    this.sceneUp = frustums.reduce((sum, f) => sum.add(f.up), new THREE.Vector3());
    if (this.sceneUp.length() < 0.1 * frustums.length || frustums.length === 0) this.sceneUp.set(0, -1, 0);
    this.sceneUp.normalize();
    this.homeStand = { position: new THREE.Vector3(0, 0, -extent), target: new THREE.Vector3(),
      up: this.sceneUp, fov: kFovDeg };
    this.controls = this.makeControls();
  }

  resize(width: number, height: number): void {
    this.aspect = width / height;
    this.camera.aspect = this.aspect;
    this.camera.updateProjectionMatrix();
  }

  // Home: behind the photographers, looking at the middle of what they saw.
  setHome(clouds: Cloud[]): void {
    const axes: number[][] = [[], [], []];
    for (const { header, positionLevel: q } of clouds) {
      const stride = 4 * Math.max(1, Math.floor(header.shown / 4000));
      for (let i = 0; i < q.length; i += stride) {
        for (let a = 0; a < 3; ++a) {
          axes[a]!.push(header.box_min[a]! + (q[i + a]! * header.box_size[a]!) / 65535);
        }
      }
    }
    if (axes[0]!.length === 0) axes.forEach((axis) => axis.push(0));
    const middle = (axis: number[]): number => axis.sort((x, y) => x - y)[axis.length >> 1]!;
    const target = new THREE.Vector3(middle(axes[0]!), middle(axes[1]!), middle(axes[2]!));
    const eye = new THREE.Vector3();
    if (this.frustums.length > 0) {
      this.frustums.forEach((f) => eye.add(f.apex));
      eye.divideScalar(this.frustums.length);
    } else {
      eye.copy(target).addScaledVector(this.sceneUp, 0.3 * this.extent);
      eye.add(new THREE.Vector3(0.3, 0, -1).multiplyScalar(0.6 * this.extent));
    }
    const back = eye.clone().sub(target).addScaledVector(this.sceneUp, 0.001 * this.extent);
    back.addScaledVector(this.sceneUp, -back.dot(this.sceneUp));
    if (back.length() < 1e-6 * this.extent) back.set(0.3, 0.2, -1);
    const wide = this.aspect < 1 ? 1.35 : 1;  // a tall, narrow view stands farther back
    back.setLength(Math.max(0.8 * this.extent, 1.7 * back.length()) * wide);
    const position = target.clone().add(back).addScaledVector(this.sceneUp, 0.5 * back.length());
    this.homeStand = { position, target, up: this.sceneUp, fov: kFovDeg };
  }

  home(animated = true): void { this.flyTo(this.homeStand, animated); }

  // Looks at a place from where the photo that sees it best was taken, at a distance that fits its size.
  lookAt(center: THREE.Vector3, size: number): void {
    let from = this.camera.position.clone().sub(center);
    let nearest = Infinity;
    for (const f of this.frustums) {
      const ray = center.clone().sub(f.apex);
      const cosine = ray.dot(f.forward) / Math.max(ray.length(), 1e-9);
      if (cosine > Math.cos(THREE.MathUtils.degToRad(f.fovY * 0.5)) && ray.length() < nearest) {
        nearest = ray.length();
        from = ray.negate();
      }
    }
    from.addScaledVector(this.sceneUp, 0.25 * from.length());
    from.setLength(Math.max(1.9 * size, 0.16 * this.extent));
    this.flyTo({ position: center.clone().add(from), target: center.clone(), up: this.sceneUp,
      fov: kFovDeg }, true);
  }

  lookFrom(frustum: Frustum): void {
    // The whole photo fits: a view wider than the photo shows more left and right of it.
    const half = Math.tan(THREE.MathUtils.degToRad(frustum.fovY) / 2);
    const fov = this.aspect >= frustum.aspect ? frustum.fovY
      : THREE.MathUtils.radToDeg(2 * Math.atan((half * frustum.aspect) / this.aspect));
    this.flyTo({ position: frustum.apex.clone(), up: frustum.up, fov,
      target: frustum.apex.clone().addScaledVector(frustum.forward, 0.45 * this.extent) }, true, frustum);
  }

  // Whether the eye stands in a photo's camera.
  isAtCamera(): boolean {
    return this.atFrustum !== null &&
      this.camera.position.distanceTo(this.atFrustum.apex) < 0.004 * this.extent;
  }

  // Turns by angles about the target; moves by shares of the distance to it.
  turn(aroundUp_rad: number, tilt_rad: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    offset.applyAxisAngle(this.camera.up, aroundUp_rad);
    const side = new THREE.Vector3().crossVectors(this.camera.up, offset).normalize();
    const tilted = offset.clone().applyAxisAngle(side, tilt_rad);
    const fromUp = tilted.angleTo(this.camera.up);
    if (fromUp > 0.05 && fromUp < Math.PI - 0.05) offset.copy(tilted);
    this.jump(this.controls.target.clone().add(offset), this.controls.target);
  }
  pan(right: number, up: number): void {
    const distance = this.camera.position.distanceTo(this.controls.target);
    const x = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 0).multiplyScalar(right * distance);
    const y = new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, 1).multiplyScalar(up * distance);
    const move = x.add(y);
    this.jump(this.camera.position.clone().add(move), this.controls.target.clone().add(move));
  }
  zoom(factor: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.jump(this.controls.target.clone().add(offset), this.controls.target);
  }

  // Before each frame: carries a flight on.
  update(): void {
    if (!this.flight) return;
    const { from, to, startMs, frustum } = this.flight;
    const t = Math.min(1, (performance.now() - startMs) / 700);
    const s = t * t * (3 - 2 * t);
    this.apply({
      position: from.position.clone().lerp(to.position, s), target: from.target.clone().lerp(to.target, s),
      up: from.up.clone().lerp(to.up, s).normalize(), fov: from.fov + (to.fov - from.fov) * s,
    });
    if (t < 1) { this.changed(); return; }
    this.flight = null;
    this.arrive(frustum);
  }

  private arrive(frustum: Frustum | null): void {
    this.atFrustum = frustum;
    this.controls.dispose();
    this.controls = this.makeControls(this.controls.target);
    this.camera.updateMatrixWorld();
    this.changed();
  }

  private flyTo(to: Stand, animated: boolean, frustum: Frustum | null = null): void {
    this.controls.enabled = false;
    if (!animated || this.calm) {
      this.flight = null;
      this.apply(to);
      this.arrive(frustum);
      return;
    }
    const from = { position: this.camera.position.clone(), target: this.controls.target.clone(),
      up: this.camera.up.clone(), fov: this.camera.fov };
    this.flight = { from, to, startMs: performance.now(), frustum };
    this.changed();
  }

  private apply({ position, target, up, fov }: Stand): void {
    this.camera.position.copy(position);
    this.camera.up.copy(up);
    this.camera.fov = fov;
    this.controls.target.copy(target);
    this.camera.lookAt(target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  private jump(position: THREE.Vector3, target: THREE.Vector3): void {
    this.flight = null;
    this.camera.position.copy(position);
    this.controls.target.copy(target);
    this.controls.update();
    this.camera.updateMatrixWorld();
    this.changed();
  }

  // The library fixes the up direction when controls are made; a photo taken on its side needs its own.
  private makeControls(target?: THREE.Vector3): OrbitControls {
    if (!target) this.camera.up.copy(this.sceneUp);
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.zoomToCursor = true;
    controls.rotateSpeed = 0.7;
    controls.minDistance = this.extent * 0.002;
    controls.maxDistance = this.extent * 12;
    if (target) controls.target.copy(target);
    controls.update();
    controls.addEventListener('change', () => {
      this.camera.updateMatrixWorld();
      this.changed();
    });
    return controls;
  }
}
