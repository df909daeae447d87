// Textures of meshes.
import { checkProperties, choice, typedArray } from './check.js';
import type { MeshTexture, TextureType } from './data.js';
import { RawTexture } from './vesicle.js';

const TEXTURES: readonly TextureType[] = ['image/png', 'image/jpeg', 'image/webp'];

/** Throws `invalid-argument` if `texture` is neither a texture nor undefined. */
export function checkTexture(texture: MeshTexture | undefined): void {
  if (texture === undefined) return;
  const { type, bytes } = checkProperties('texture', texture, ['type', 'bytes']);
  choice('texture.type', type, TEXTURES);
  typedArray('texture.bytes', bytes, Uint8Array);
}

/**
 * Copies a texture into the WebAssembly module. The function of the module that receives the raw texture takes
 * ownership of it.
 */
export function rawTexture(texture: MeshTexture | undefined): RawTexture | undefined {
  return texture && new RawTexture(texture.type, texture.bytes);
}

/** Returns the texture of a raw object of the WebAssembly module, which is freed. */
export function textureOf(raw: RawTexture): MeshTexture {
  try {
    return { type: raw.kind() as TextureType, bytes: raw.bytes() };
  } finally {
    raw.free();
  }
}
