import {
  BoxGeometry,
  BufferAttribute,
  CanvasTexture,
  type ColorRepresentation,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Sprite,
  SpriteMaterial,
  SRGBColorSpace,
} from 'three';
import { placed } from '../engine/placing';
import type { Vec3 } from '../engine/protocol';
import { anatomyOf, type Grid, toWorld } from './anatomy';

const LETTERS = [
  ['R', 'L'],
  ['A', 'P'],
  ['S', 'I'],
] as const;
/**
 * Distance of the letters of anatomical directions from the volume's box, as a fraction of the box's side in the same
 * direction.
 */
const LETTER_DISTANCE = 0.06;
/**
 * Side of a letter's square sprite divided by its distance from the camera: about 8 % of the height of the view, whose
 * field of view is 30°.
 */
const LETTER_SIZE = 0.045;

/** The bounding box of a volume in the 3D view, with the letters of anatomical directions at its six faces. */
export class VolumeBox {
  readonly object = new Group();
  readonly #box: LineSegments<EdgesGeometry, LineBasicMaterial>;
  readonly #sprites: Sprite[] = [];

  constructor(grid: Grid, color: ColorRepresentation) {
    this.#box = boxOf(grid, color);
    this.object.add(this.#box);
    for (const [axis, { anatomical, positive }] of anatomyOf(grid).entries()) {
      const [high, low] = positive ? LETTERS[anatomical] : [LETTERS[anatomical][1], LETTERS[anatomical][0]];
      this.#addLetter(high, sideCentre(grid, axis, 1 + LETTER_DISTANCE));
      this.#addLetter(low, sideCentre(grid, axis, -LETTER_DISTANCE));
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

  #addLetter(letter: string, at: Vec3): void {
    const material = new SpriteMaterial({ map: letterTexture(letter), sizeAttenuation: false, depthWrite: false });
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
  const { array, count } = edges.getAttribute('position');
  const corners = Array.from({ length: count }, (_, i) => Array.from(array.subarray(3 * i, 3 * i + 3)) as Vec3);
  const { points, origin } = placed(corners.flatMap((corner) => toWorld(grid.affine, corner)));
  edges.setAttribute('position', new BufferAttribute(points, 3));
  const lines = new LineSegments(edges, new LineBasicMaterial({ color, transparent: true, opacity: 0.35 }));
  lines.position.set(...origin);
  return lines;
}

/**
 * Returns a point, in world space, on the line along a voxel axis through the centre of the volume's box, to place a
 * letter: `part` is 0 at the first voxel's face, 1 at the last one's.
 */
function sideCentre(grid: Grid, axis: number, part: number): Vec3 {
  const at = grid.dims.map((n) => (n - 1) / 2) as Vec3;
  at[axis] = part * (grid.dims[axis] ?? 1) - 0.5;
  return toWorld(grid.affine, at);
}

/** Renders a letter in white with a dark outline, so that it is legible on any background. */
function letterTexture(letter: string): CanvasTexture {
  const canvas = document.createElement('canvas');
  canvas.width = 64;
  canvas.height = 64;
  const context = canvas.getContext('2d');
  if (context) {
    context.font = '600 44px system-ui, sans-serif';
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.lineJoin = 'round';
    context.lineWidth = 7;
    context.strokeStyle = '#1c2024';
    context.strokeText(letter, 32, 34);
    context.fillStyle = '#fff';
    context.fillText(letter, 32, 34);
  }
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}
