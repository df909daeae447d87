import { RepeatWrapping, SRGBColorSpace, Texture } from 'three';
import { checkPictures } from '../../scene/picture-size';
import type { MeshTexture } from './protocol';

/** Decodes the texture of a mesh for three.js; v points downwards in the texture coordinates, as in glTF. */
export async function pictureOf({ type, bytes }: MeshTexture): Promise<Texture> {
  const blob = new Blob([bytes as Uint8Array<ArrayBuffer>], { type });
  await checkPictures([blob]);
  const texture = new Texture(await createImageBitmap(blob));
  texture.flipY = false;
  texture.colorSpace = SRGBColorSpace;
  texture.wrapS = RepeatWrapping;
  texture.wrapT = RepeatWrapping;
  texture.anisotropy = 4;
  texture.needsUpdate = true;
  return texture;
}
