import {
  BoxGeometry,
  CanvasTexture,
  type ColorRepresentation,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Sprite,
  SpriteMaterial,
} from 'three';
import type { Vec3 } from '../protocol';
import { anatomyOf, type Grid, toWorld } from './anatomy';

const LETTERS = [
  ['R', 'L'],
  ['A', 'P'],
  ['S', 'I'],
] as const;
/** How far outside the box the letters stand, as a part of the box. */
const STAND_OFF = 0.06;
/** Height of a letter as a part of the view's height. */
const LETTER_SIZE = 0.045;

/** The volume's box, with the anatomical directions written on its six sides. */
export class VolumeFrame {
  readonly object = new Group();
  readonly #box: LineSegments<EdgesGeometry, LineBasicMaterial>;
  readonly #sprites: Sprite[] = [];

  constructor(grid: Grid, color: ColorRepresentation) {
    this.#box = boxOf(grid, color);
    this.object.add(this.#box);
    for (const [axis, { anatomical, positive }] of anatomyOf(grid).entries()) {
      const [high, low] = positive ? LETTERS[anatomical] : [LETTERS[anatomical][1], LETTERS[anatomical][0]];
      this.#addLetter(high, sideCentre(grid, axis, 1 + STAND_OFF), color);
      this.#addLetter(low, sideCentre(grid, axis, -STAND_OFF), color);
    }
  }

  dispose(): void {
    this.#box.geometry.dispose();
    this.#box.material.dispose();
    for (const { material } of this.#sprites) {
      material.map?.dispose();
      material.dispose();
    }
  }

  #addLetter(letter: string, at: Vec3, color: ColorRepresentation): void {
    const material = new SpriteMaterial({
      map: letterTexture(letter),
      color,
      sizeAttenuation: false,
      depthWrite: false,
    });
    const sprite = new Sprite(material);
    sprite.position.set(...at);
    sprite.scale.setScalar(LETTER_SIZE);
    this.#sprites.push(sprite);
    this.object.add(sprite);
  }
}

function boxOf(grid: Grid, color: ColorRepresentation): LineSegments<EdgesGeometry, LineBasicMaterial> {
  const [nx, ny, nz] = grid.dims;
  const box = new BoxGeometry(nx, ny, nz).translate((nx - 1) / 2, (ny - 1) / 2, (nz - 1) / 2);
  const edges = new EdgesGeometry(box);
  box.dispose();
  edges.applyMatrix4(new Matrix4().fromArray(grid.affine));
  return new LineSegments(edges, new LineBasicMaterial({ color, transparent: true, opacity: 0.35 }));
}

/** World position at the middle of the box, except along one axis, where it is the given part of the way through. */
function sideCentre(grid: Grid, axis: number, part: number): Vec3 {
  const at = grid.dims.map((n) => (n - 1) / 2) as Vec3;
  at[axis] = part * (grid.dims[axis] ?? 1) - 0.5;
  return toWorld(grid.affine, at);
}

function letterTexture(letter: string): CanvasTexture {
  const canvas = document.createElement('canvas');
  canvas.width = 64;
  canvas.height = 64;
  const context = canvas.getContext('2d');
  if (context) {
    context.font = '600 44px system-ui, sans-serif';
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillStyle = '#fff';
    context.fillText(letter, 32, 34);
  }
  return new CanvasTexture(canvas);
}
