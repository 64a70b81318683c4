// SPDX-License-Identifier: Apache-2.0
// A cloud on the graphics card: 12 bytes a point, and every choice of the user a uniform, so that a new
// threshold or colour costs one frame.
import * as THREE from 'three';
import type { Cloud } from '../data';
import { kEpochColors, kLabelColors } from '../colormap';
import { kLabels } from '../data';

// Points are stored in this many interleaved passes; a prefix of k passes is an even sample of the cloud.
export const kPasses = 8;
const kPassOrder = [0, 4, 2, 6, 1, 5, 3, 7];

const vertexShader = /* glsl */ `
  precision highp float;
  precision highp int;
  in vec4 position;    // x y z in the box, level
  in vec4 color_label; // r g b, label
  uniform mat4 modelViewMatrix, projectionMatrix;
  uniform vec3 box_min, box_step, epoch_color;
  uniform vec3 label_colors[5];
  uniform sampler2D levels;
  uniform int mode;          // 0 photo, 1 distance, 2 epoch, 3 label
  uniform float threshold, point_size, min_size, px_per_unit;
  uniform bool hide_static, by_label;
  out vec3 v_color;
  void main() {
    int label = int(color_label.w * 255.0 + 0.5);
    bool changed = by_label ? (label == 1 || label == 2 || label == 4) : position.w > threshold && position.w < 254.5;
    vec3 photo = color_label.rgb;
    float shade = 0.72 + 0.45 * dot(photo, vec3(0.3, 0.6, 0.1));
    if (mode == 0) v_color = photo;
    // A little of the photo's light and shade stays, so that the shape can be read.
    else if (mode == 1) v_color = texelFetch(levels, ivec2(int(position.w), 0), 0).rgb * shade;
    else if (mode == 2) v_color = epoch_color * (shade - 0.15);
    // What stayed keeps a breath of its photo; the answers that matter have their pure colours.
    else if (label == 0) v_color = mix(label_colors[0] * shade, photo, 0.4);
    else v_color = label < 5 ? label_colors[label] * shade : vec3(0.5);
    vec4 x_in_camera = modelViewMatrix * vec4(box_min + position.xyz * box_step, 1.0);
    gl_Position = projectionMatrix * x_in_camera;
    gl_PointSize = clamp(point_size * px_per_unit / max(-x_in_camera.z, 1e-6), min_size, 48.0);
    if (hide_static && !changed) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  }`;

const fragmentShader = /* glsl */ `
  precision mediump float;
  in vec3 v_color;
  uniform bool round_points;
  out vec4 color;
  void main() {
    if (round_points && distance(gl_PointCoord, vec2(0.5)) > 0.5) discard;
    color = vec4(v_color, 1.0);
  }`;

const rgb = (c: readonly number[]): THREE.Vector3 => new THREE.Vector3(c[0], c[1], c[2]).divideScalar(255);

// Shared by both clouds.
export interface PointUniforms {
  levels: { value: THREE.DataTexture };
  mode: { value: number };
  threshold: { value: number };
  point_size: { value: number };  // scene units
  min_size: { value: number };    // px
  px_per_unit: { value: number }; // at depth 1
  hide_static: { value: boolean };
  by_label: { value: boolean };
  round_points: { value: boolean };  // prettier when points are few and large; squares are faster
}

export function makeUniforms(table: Uint8Array<ArrayBuffer>): PointUniforms {
  const levels = new THREE.DataTexture(table, 256, 1, THREE.RGBAFormat);
  levels.needsUpdate = true;
  return {
    levels: { value: levels }, mode: { value: 0 }, threshold: { value: 0 }, point_size: { value: 1 },
    min_size: { value: 1 }, px_per_unit: { value: 1 }, hide_static: { value: false },
    by_label: { value: false }, round_points: { value: false },
  };
}

function interleave<T extends Uint16Array | Uint8Array>(values: T): T {
  const n = values.length / 4;
  const out = values.slice() as T;
  let to = 0;
  for (const pass of kPassOrder) {
    for (let i = pass; i < n; i += kPasses) {
      for (let c = 0; c < 4; ++c) out[4 * to + c] = values[4 * i + c]!;
      ++to;
    }
  }
  return out;
}

export class PointLayer {
  readonly object: THREE.Points;
  private readonly geometry = new THREE.BufferGeometry();

  constructor(readonly cloud: Cloud, shared: PointUniforms) {
    const { box_min, box_size, epoch } = cloud.header;
    this.geometry.setAttribute('position',
      new THREE.BufferAttribute(interleave(cloud.positionLevel), 4, false));
    this.geometry.setAttribute('color_label',
      new THREE.BufferAttribute(interleave(cloud.colorLabel), 4, true));
    this.geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(), Infinity);
    const material = new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader, fragmentShader,
      uniforms: {
        ...shared,
        box_min: { value: new THREE.Vector3(...box_min) },
        box_step: { value: new THREE.Vector3(...box_size).divideScalar(65535) },
        epoch_color: { value: rgb(kEpochColors[epoch]) },
        label_colors: { value: kLabels.map((name) => rgb(kLabelColors[name])) },
      },
    });
    this.object = new THREE.Points(this.geometry, material);
    this.object.frustumCulled = false;
  }

  // Draws this many of the kPasses interleaved samples.
  setPasses(passes: number): void {
    const n = this.cloud.header.shown;
    this.geometry.setDrawRange(0, passes >= kPasses ? n : Math.ceil((n * passes) / kPasses));
  }
}
