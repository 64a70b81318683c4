// SPDX-License-Identifier: Apache-2.0
// Depth shading: darkens a pixel that lies behind its neighbours, which lets the eye read a cloud without
// normals as surfaces (eye-dome lighting; Boucheny, "Interactive scientific visualization", 2009).
import * as THREE from 'three';

const vertexShader = /* glsl */ `
  out vec2 uv_;
  void main() { uv_ = position.xy * 0.5 + 0.5; gl_Position = vec4(position.xy, 0.0, 1.0); }`;

const fragmentShader = /* glsl */ `
  precision highp float;
  in vec2 uv_;
  out vec4 out_color;
  uniform sampler2D image, depth;
  uniform vec2 texel;
  uniform float near, far, strength;
  uniform vec3 background;
  float log_depth(vec2 at) {
    float z = texture(depth, at).x;
    if (z >= 1.0) return 1e3;  // nothing there
    return log2(2.0 * near * far / (far + near - (2.0 * z - 1.0) * (far - near)));
  }
  void main() {
    float here = log_depth(uv_);
    if (here >= 1e3) { out_color = vec4(background, 1.0); return; }
    float behind = 0.0;
    for (int i = 0; i < 4; ++i) {
      vec2 step_ = i == 0 ? vec2(1, 0) : i == 1 ? vec2(-1, 0) : i == 2 ? vec2(0, 1) : vec2(0, -1);
      behind += max(0.0, here - log_depth(uv_ + step_ * texel));
    }
    out_color = vec4(texture(image, uv_).rgb * exp(-strength * behind), 1.0);
  }`;

export class DepthShading {
  readonly target: THREE.WebGLRenderTarget;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.Camera();
  private readonly material: THREE.ShaderMaterial;

  constructor() {
    this.target = new THREE.WebGLRenderTarget(1, 1, {
      minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter,
      depthTexture: new THREE.DepthTexture(1, 1, THREE.UnsignedIntType),
    });
    this.material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader, fragmentShader, depthTest: false, depthWrite: false,
      uniforms: {
        image: { value: this.target.texture }, depth: { value: this.target.depthTexture },
        texel: { value: new THREE.Vector2() }, near: { value: 1 }, far: { value: 2 },
        strength: { value: 9 }, background: { value: new THREE.Color() },
      },
    });
    const triangle = new THREE.BufferGeometry();
    triangle.setAttribute('position',
      new THREE.BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    const mesh = new THREE.Mesh(triangle, this.material);
    mesh.frustumCulled = false;
    this.scene.add(mesh);
  }

  setSize(width: number, height: number): void { this.target.setSize(width, height); }

  // Draws the target to the screen.
  draw(renderer: THREE.WebGLRenderer, camera: THREE.PerspectiveCamera, background: THREE.Color,
       radiusPx: number): void {
    const u = this.material.uniforms;
    u.texel!.value.set(radiusPx / this.target.width, radiusPx / this.target.height);
    u.near!.value = camera.near;
    u.far!.value = camera.far;
    u.background!.value = background;
    renderer.setRenderTarget(null);
    renderer.render(this.scene, this.camera);
  }
}
