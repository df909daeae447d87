import '@kitware/vtk.js/Rendering/Profiles/Geometry';
import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray';
import vtkITKHelper from '@kitware/vtk.js/Common/DataModel/ITKHelper';
import vtkPolyData from '@kitware/vtk.js/Common/DataModel/PolyData';
import vtkActor from '@kitware/vtk.js/Rendering/Core/Actor';
import vtkMapper from '@kitware/vtk.js/Rendering/Core/Mapper';
import { Image, ImageType } from 'itk-wasm';
import init, { DeformableModel, Volume } from 'vesicle';
import { VtkSurface, volumeFromItk } from 'vesicle/vtk';
import { loadScan } from './nifti';
import { page, shown } from './page';
import { sliceAndSurface } from './vtk-view';

await page(async () => {
  const { voxels, size, spacing, directions, origin } = await loadScan('../data/heart.nii.gz');
  const image = new Image(new ImageType(3, 'int16', 'Scalar', 1));
  // Transpose: the scan lists direction vectors as columns, itk-wasm stores the matrix row by row.
  image.direction = Float64Array.from([0, 1, 2].flatMap((row) => directions.map((column) => column[row] ?? 0)));
  Object.assign(image, { size, spacing, origin, data: voxels });

  await init();
  const volume = new Volume(volumeFromItk(image));
  const model = new DeformableModel({ volume, levels: 1, edge: 1.5, params: { iso: 85, isoForce: -1 } });
  const surface = new VtkSurface({ vtkPolyData, vtkDataArray });
  const mapper = vtkMapper.newInstance();
  mapper.setInputData(surface.polyData);
  const actor = vtkActor.newInstance();
  actor.setMapper(mapper);
  const render = sliceAndSurface(vtkITKHelper.convertItkToVtkImage(image), actor);
  Object.assign(window, { image, model, surface, actor, render });
  for (;;) {
    const report = model.step();
    if (surface.update(model.mesh)) render();
    await shown(report);
    if (report.done) return report;
  }
});
