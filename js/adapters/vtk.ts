/**
 * Adapter for vtk.js and itk-wasm: converts their images, shows a vtk.js surface that follows a mesh, and the surfaces of
 * a label map.
 *
 * Nothing of either is imported: the caller passes vtk's classes.
 *
 * @module vesicle/vtk
 */
export type { LabelClasses } from './label-map.js';
export type { AnyMesh, MeshSource, RemoteMeshSource } from './source.js';
export { type ItkImage, type VtkImage, volumeFromItk, volumeFromVtk } from './vtk-image.js';
export { type VtkImageClasses, VtkLabelSurfaces, type VtkLabelSurfacesOptions, vtkFromVolume } from './vtk-labels.js';
export { type VtkActor, type VtkClasses, type VtkPolyData, VtkSurface } from './vtk-surface.js';
