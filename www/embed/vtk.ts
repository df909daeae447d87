import '@kitware/vtk.js/Rendering/Profiles/Geometry';
import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray';
import vtkImageData from '@kitware/vtk.js/Common/DataModel/ImageData';
import vtkPolyData from '@kitware/vtk.js/Common/DataModel/PolyData';
import vtkActor from '@kitware/vtk.js/Rendering/Core/Actor';
import vtkMapper from '@kitware/vtk.js/Rendering/Core/Mapper';
import init, { DeformableModel, Volume } from 'vesicle';
import { VtkSurface, volumeFromVtk } from 'vesicle/vtk';
import { loadScan } from './nifti';
import { page, shown } from './page';
import { sliceAndSurface } from './vtk-view';

await page(async () => {
  const { voxels, size, spacing, directions, origin } = await loadScan('../data/visible-human-head.nii.gz');
  const image = vtkImageData.newInstance({ spacing, origin });
  image.setDirection(Float32Array.from(directions.flat()));
  image.setDimensions(size);
  image.getPointData().setScalars(vtkDataArray.newInstance({ values: voxels }));

  await init();
  const volume = new Volume(volumeFromVtk(image));
  const model = new DeformableModel({ volume, levels: 2, params: { iso: 95, isoForce: -1, rigidity: 0.1 } });
  const surface = new VtkSurface({ vtkPolyData, vtkDataArray });
  const mapper = vtkMapper.newInstance();
  mapper.setInputData(surface.polyData);
  const actor = vtkActor.newInstance();
  actor.setMapper(mapper);
  const render = sliceAndSurface(image, actor);
  Object.assign(window, { image, model, surface, actor, render });
  for (;;) {
    const report = model.step();
    if (surface.update(model.mesh)) render();
    await shown(report);
    if (report.done) return report;
  }
});
