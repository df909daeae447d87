import { BufferAttribute, BufferGeometry, CanvasTexture, Points, PointsMaterial } from 'three';
import { placed } from '../engine/placing';
import { linearColors } from './shading';

/** A point cloud drawn as small discs that face the viewer, in one colour or with a colour per point. */
export class PointCloud {
  readonly #material = new PointsMaterial({ map: disc(), alphaTest: 0.5, sizeAttenuation: true });
  readonly object = new Points(new BufferGeometry(), this.#material);
  #color = '#000000';

  constructor() {
    this.object.frustumCulled = false;
  }

  set color(color: string) {
    this.#color = color;
    this.#paint();
  }

  /**
   * Diameter of the points' discs in world units, exact for a field of view of 90°; a narrower view shows smaller
   * discs.
   */
  set size(size: number) {
    this.#material.size = size;
  }

  /** Shows points in world space, packed xyz; `colors` are sRGB of each point, 0..1. */
  show(points: ArrayLike<number>, colors?: Float32Array): void {
    this.object.geometry.dispose();
    const geometry = new BufferGeometry();
    const drawn = placed(points);
    this.object.position.set(...drawn.origin);
    geometry.setAttribute('position', new BufferAttribute(drawn.points, 3));
    if (colors) {
      const linear = new Float32Array(colors.length);
      linearColors(colors, linear);
      geometry.setAttribute('color', new BufferAttribute(linear, 3));
    }
    this.object.geometry = geometry;
    this.#material.vertexColors = colors !== undefined;
    this.#material.needsUpdate = true;
    this.#paint();
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.#material.map?.dispose();
    this.#material.dispose();
  }

  #paint(): void {
    this.#material.color.set(this.#material.vertexColors ? '#ffffff' : this.#color);
  }
}

function disc(): CanvasTexture {
  const canvas = document.createElement('canvas');
  canvas.width = 64;
  canvas.height = 64;
  const context = canvas.getContext('2d');
  if (context) {
    context.fillStyle = '#fff';
    context.arc(32, 32, 31, 0, 2 * Math.PI);
    context.fill();
  }
  return new CanvasTexture(canvas);
}
