// SPDX-License-Identifier: Apache-2.0
// The cameras of all photos as pyramids, and the chosen photo as a picture in its pyramid.
import * as THREE from 'three';
import { poseOf, type PhotoHeader } from '../data';
import { kEpochColors } from '../colormap';

// Apex and the four corners of the image plane (top left, top right, bottom right, bottom left) in the world.
export interface Frustum {
  photo: number;
  apex: THREE.Vector3;
  corners: [THREE.Vector3, THREE.Vector3, THREE.Vector3, THREE.Vector3];
  forward: THREE.Vector3;
  up: THREE.Vector3;
  fovY: number;    // degrees, of the photo
  aspect: number;
}

export function frustumOf(photo: PhotoHeader, index: number, depth: number): Frustum | null {
  const pose = poseOf(photo);
  if (!pose || !photo.intrinsics) return null;
  const [fx, fy, cx, cy] = photo.intrinsics;
  if (!(fx > 0 && fy > 0)) return null;
  const apex = new THREE.Vector3(...pose.center);
  const r = pose.rotation;
  const toWorld = (x: number, y: number, z: number): THREE.Vector3 =>
    new THREE.Vector3(r[0]! * x + r[3]! * y + r[6]! * z, r[1]! * x + r[4]! * y + r[7]! * z,
      r[2]! * x + r[5]! * y + r[8]! * z);
  // Pixel centres are integers: the image reaches from -0.5 to width - 0.5.
  const corner = (u: number, v: number): THREE.Vector3 =>
    toWorld(((u - cx) / fx) * depth, ((v - cy) / fy) * depth, depth).add(apex);
  const right = photo.width - 0.5;
  const bottom = photo.height - 0.5;
  return {
    photo: index, apex,
    corners: [corner(-0.5, -0.5), corner(right, -0.5), corner(right, bottom), corner(-0.5, bottom)],
    forward: toWorld(0, 0, 1), up: toWorld(0, -1, 0),
    fovY: THREE.MathUtils.radToDeg(2 * Math.atan(photo.height / (2 * fy))),
    aspect: (photo.width / fx) / (photo.height / fy),
  };
}

export class FrustumLayer {
  readonly object = new THREE.Group();
  readonly frustums: Frustum[] = [];
  readonly byPhoto = new Map<number, Frustum>();
  private readonly lines: THREE.LineSegments;
  private readonly chosen = new THREE.LineSegments(new THREE.BufferGeometry(),
    new THREE.LineBasicMaterial({ color: 0xffffff }));
  private readonly picture: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  private texture: THREE.CanvasTexture | null = null;

  constructor(photos: PhotoHeader[], size: number) {
    const positions: number[] = [];
    const colors: number[] = [];
    photos.forEach((photo, index) => {
      const frustum = frustumOf(photo, index, size);
      if (!frustum) return;
      this.frustums.push(frustum);
      this.byPhoto.set(index, frustum);
      positions.push(...FrustumLayer.segments(frustum));
      const color = kEpochColors[photo.epoch].map((c) => c / 255);
      for (let i = 0; i < 16; ++i) colors.push(...color);
    });
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
    geometry.setAttribute('color', new THREE.Float32BufferAttribute(colors, 3));
    this.lines = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true }));
    this.picture = new THREE.Mesh(new THREE.BufferGeometry(),
      new THREE.MeshBasicMaterial({ side: THREE.DoubleSide }));
    for (const object of [this.lines, this.chosen, this.picture]) object.frustumCulled = false;
    this.object.add(this.lines, this.chosen, this.picture);
    this.choose(null, null);
  }

  private static segments({ apex, corners: [a, b, c, d] }: Frustum): number[] {
    return [apex, a, apex, b, apex, c, apex, d, a, b, b, c, c, d, d, a].flatMap((p) => p.toArray());
  }

  choose(photo: number | null, canvas: HTMLCanvasElement | null): void {
    const frustum = photo === null ? undefined : this.byPhoto.get(photo);
    this.chosen.visible = frustum !== undefined;
    this.picture.visible = frustum !== undefined && canvas !== null;
    if (!frustum) return;
    this.chosen.geometry.setAttribute('position',
      new THREE.Float32BufferAttribute(FrustumLayer.segments(frustum), 3));
    if (!canvas) return;
    const [a, b, c, d] = frustum.corners;
    this.picture.geometry.setAttribute('position',
      new THREE.Float32BufferAttribute([d, c, b, d, b, a].flatMap((p) => p.toArray()), 3));
    this.picture.geometry.setAttribute('uv',
      new THREE.Float32BufferAttribute([0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1], 2));
    this.texture?.dispose();
    this.texture = new THREE.CanvasTexture(canvas);
    this.texture.generateMipmaps = false;
    this.texture.minFilter = THREE.LinearFilter;
    this.picture.material.map = this.texture;
    this.picture.material.needsUpdate = true;
  }

  // The picture is hidden while looking through it.
  showPicture(on: boolean): void { this.picture.visible = on && this.texture !== null && this.chosen.visible; }

  setInk(color: THREE.ColorRepresentation): void {
    (this.chosen.material as THREE.LineBasicMaterial).color.set(color);
  }
}
