// SPDX-License-Identifier: Apache-2.0
// The distance between two points that the user picks.
import * as THREE from 'three';
import { h } from '../dom';
import { number } from '../format';
import type { PickedPoint } from './pick';

export class Measure {
  readonly object = new THREE.Group();
  onMessage: (text: string) => void = () => {};
  private points: THREE.Vector3[] = [];
  private readonly label: HTMLElement;
  private readonly dots: HTMLElement[];
  private readonly line = new THREE.Line(new THREE.BufferGeometry(),
    new THREE.LineBasicMaterial({ color: 0xffffff, depthTest: false }));

  constructor(parent: HTMLElement, private readonly unit: string, private readonly changed: () => void) {
    this.dots = [0, 1].map(() => h('div', { class: 'measure-dot', hidden: true }));
    this.label = h('output', { class: 'measure-label', hidden: true });
    parent.append(...this.dots, this.label);
    this.line.frustumCulled = false;
    this.line.renderOrder = 1;
    this.line.visible = false;
    this.object.add(this.line);
  }

  add(picked: PickedPoint | null): void {
    if (!picked) {
      this.onMessage('No point there. Pick a place where points are drawn.');
      return;
    }
    if (this.points.length === 2) this.points = [];
    this.points.push(picked.position);
    if (this.points.length === 1) {
      this.onMessage('First point set. Pick the second one.');
    } else {
      const distance = this.points[0]!.distanceTo(this.points[1]!);
      this.label.textContent = `${number(distance, 4)} ${this.unit}`;
      this.label.dataset.distance = String(distance);
      this.onMessage(`Distance: ${number(distance, 4)} ${this.unit}`);
      this.line.geometry.setFromPoints(this.points);
    }
    this.line.visible = this.points.length === 2;
    this.changed();
  }

  clear(): void {
    this.points = [];
    this.line.visible = false;
    this.changed();
  }

  setInk(color: string): void { (this.line.material as THREE.LineBasicMaterial).color.set(color); }

  // Puts dots and label over the points; part of every frame.
  place(camera: THREE.PerspectiveCamera, width: number, height: number): void {
    const at = (p: THREE.Vector3, element: HTMLElement): void => {
      const ndc = p.clone().project(camera);
      element.hidden = ndc.z > 1;
      element.style.transform =
        `translate(${((ndc.x + 1) / 2) * width}px, ${((1 - ndc.y) / 2) * height}px)`;
    };
    this.dots.forEach((dot, i) => {
      dot.hidden = true;
      if (this.points[i]) at(this.points[i], dot);
    });
    this.label.hidden = true;
    if (this.points.length === 2) at(this.points[0]!.clone().lerp(this.points[1]!, 0.5), this.label);
  }
}
