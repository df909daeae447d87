/**
 * Vesicle grows living surfaces out of 3D data: closed triangle meshes that split, merge and refine themselves.
 *
 * Points are packed xyz in a `Float32Array`, triangles packed abc in a `Uint32Array`, counter-clockwise seen from
 * outside. "World" is the volume's world space, in mm where the file says mm.
 *
 * @packageDocumentation
 */
import { call } from './runtime.js';
import { version as rawVersion } from './vesicle.js';

export { type ErrorCode, VesicleCrash, VesicleError } from './error.js';
export { type InitInput, init as default, initSync } from './runtime.js';

/** The version of the library, as in its package. */
export function version(): string {
  return call(rawVersion);
}
