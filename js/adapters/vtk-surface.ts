// Shows a surface in vtk.js that follows a mesh.
import { invalid } from '../check.js';
import type { Space } from '../data.js';
import type { MeshSnapshot } from '../mesh.js';
import type { Warning } from '../warning.js';
import {
  type AnyMesh,
  MeshReader,
  type MeshSource,
  polygons,
  type RemoteMeshSource,
  type SurfaceArrays,
} from './source.js';

interface DataArray {
  setData(values: Float32Array | Uint32Array, components?: number): void;
}

/** The methods of a `vtkPolyData` of vtk.js that {@link VtkSurface} calls. */
export interface VtkPolyData {
  getPoints(): DataArray;
  getPolys(): DataArray;
  getPointData(): { setNormals(array: DataArray): unknown };
  modified(): void;
  delete(): void;
}

/** The method of a `vtkActor` of vtk.js that {@link VtkSurface} calls. */
export interface VtkActor {
  setPosition(x: number, y: number, z: number): unknown;
}

/** The classes of vtk.js that {@link VtkSurface} needs: `{ vtkPolyData, vtkDataArray }`. */
export interface VtkClasses<P extends VtkPolyData> {
  vtkPolyData: { newInstance(): P };
  vtkDataArray: { newInstance(values: { name: string; numberOfComponents: number; values: Float32Array }): DataArray };
}

/**
 * A `vtkPolyData` that follows a mesh, through all changes of connectivity.
 *
 * ```js
 * const surface = new VtkSurface({ vtkPolyData, vtkDataArray });
 * mapper.setInputData(surface.polyData);
 * surface.update(model.mesh); // after every step, then render
 * ```
 *
 * Points are those of the mesh, in its volume's world space unless `worldSpace` is another one; they have outward
 * normals. Those of a mesh that is far from the origin for its size need an `actor`: they are relative to `mesh.origin`,
 * which becomes its position.
 */
export class VtkSurface<P extends VtkPolyData> {
  /** The surface as input of a `vtkMapper`; the same object from start to end. */
  readonly polyData: P;
  readonly #normals: DataArray;
  readonly #reader: MeshReader;
  readonly #actor: VtkActor | undefined;
  #moved = false;

  /**
   * Creates a surface that is empty before the first update.
   *
   * @param vtk - The classes of vtk.js.
   * @param options - `space` of the mesh and `worldSpace` of the view: if both are given and differ, the signs of x and
   *   y are flipped. `actor`: the `vtkActor` that shows the poly data.
   * @throws `VesicleError` `invalid-argument`: classes that are missing, or no such space.
   */
  constructor(vtk: VtkClasses<P>, options: { space?: Space; worldSpace?: Space; actor?: VtkActor } = {}) {
    for (const name of ['vtkPolyData', 'vtkDataArray'] as const) {
      if (typeof Object(vtk)[name]?.newInstance !== 'function') throw invalid('vtk', `has no ${name} of vtk.js`);
    }
    this.#actor = options.actor;
    const remedy = this.#actor ? undefined : 'give the `actor` that shows it, which is then moved there';
    this.#reader = new MeshReader(options.space, options.worldSpace, remedy);
    this.polyData = vtk.vtkPolyData.newInstance();
    this.#normals = vtk.vtkDataArray.newInstance({
      name: 'Normals',
      numberOfComponents: 3,
      values: new Float32Array(),
    });
    this.polyData.getPointData().setNormals(this.#normals);
  }

  /** Warnings of the mesh of the last update; empty if there are none. */
  get warnings(): Warning[] {
    return this.#reader.warnings;
  }

  /**
   * Updates the poly data if `mesh` has changed since the last call; the next rendering uploads it. Returns whether
   * `mesh` had changed.
   *
   * @throws `VesicleError` `invalid-argument`: no mesh; `precision`: a mesh so far from the origin that single precision
   *   is too coarse there, without an `actor`.
   */
  update(mesh: MeshSource | MeshSnapshot): boolean;
  /** The same for a mesh in a worker: resolves when it is there, with false, too, if a later call was there before. */
  update(mesh: RemoteMeshSource): Promise<boolean>;
  update(mesh: AnyMesh): boolean | Promise<boolean> {
    return this.#reader.update(mesh, (frame) => this.#show(frame));
  }

  #show(frame: SurfaceArrays): void {
    const moved = frame.origin.some((coordinate) => coordinate !== 0);
    if (moved || this.#moved) this.#actor?.setPosition(...frame.origin);
    this.#moved = moved;
    // vtk.js keeps the arrays, so they are copied.
    this.polyData.getPoints().setData(frame.positions.slice(), 3);
    this.#normals.setData(frame.normals.slice(), 3);
    if (frame.topology) this.polyData.getPolys().setData(polygons(frame));
    this.polyData.modified();
  }

  /** Deletes the poly data; remove its actor from the view first. */
  dispose(): void {
    this.#reader.clear();
    this.polyData.delete();
  }
}
