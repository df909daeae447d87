import '@kitware/vtk.js/Rendering/Profiles/Geometry';
import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray';
import vtkImageData from '@kitware/vtk.js/Common/DataModel/ImageData';
import vtkPolyData from '@kitware/vtk.js/Common/DataModel/PolyData';
import vtkActor from '@kitware/vtk.js/Rendering/Core/Actor';
import vtkMapper from '@kitware/vtk.js/Rendering/Core/Mapper';
import init, { LabelSurfaces, Volume } from 'vesicle';
import { VtkLabelSurfaces, vtkFromVolume } from 'vesicle/vtk';
import { ball, heartLabels, LABELS } from './heart-labels';
import { loadScan } from './nifti';
import { status } from './page';
import { sliceAndSurfaces } from './vtk-view';

await status(async (say) => {
  const scan = await loadScan('../data/heart.nii.gz');
  const { voxels, size, spacing, directions, origin } = scan;
  const image = (values: Uint8Array | Int16Array) => {
    const made = vtkImageData.newInstance({ spacing, origin });
    made.setDirection(Float32Array.from(directions.flat()));
    made.setDimensions(size);
    made.getPointData().setScalars(vtkDataArray.newInstance({ values }));
    return made;
  };
  const labelMap = image(heartLabels(scan));

  await init();
  const classes = { Volume, LabelSurfaces, vtkPolyData, vtkDataArray };
  const surfaces = await VtkLabelSurfaces.create(classes, labelMap);
  const actors = LABELS.map(({ value, color }) => actorOf(surfaces.polyData(value), [...color]));
  const render = sliceAndSurfaces(image(voxels), actors, [-0.4, -1.2, -1.2], 2.2);
  render();
  Object.assign(window, { labelMap, surfaces, actors, render, vtkFromVolume, vtkImageData, vtkDataArray });

  const show = (more = '') => {
    const volumes = LABELS.map(
      ({ value, name }) => `${name} ${(surfaces.mesh(value).info().volume / 1000).toFixed(0)} ml`,
    );
    say(`${volumes.join(', ')}${more}`);
  };
  show();
  const around = ball(size, spacing, 10);
  const control = document.querySelector('#drill') as HTMLButtonElement;
  control.onclick = () => {
    drill(labelMap, around);
    const started = performance.now();
    surfaces.update();
    const taken = performance.now() - started;
    render();
    show(`; surfaces in ${taken.toFixed(0)} ms`);
  };
});

function actorOf(polyData: vtkPolyData, color: number[]): vtkActor {
  const mapper = vtkMapper.newInstance();
  mapper.setInputData(polyData);
  const actor = vtkActor.newInstance();
  actor.setMapper(mapper);
  actor.getProperty().setColor(color[0] ?? 1, color[1] ?? 1, color[2] ?? 1);
  return actor;
}

let drilled = 0;

/** Erases the labels within a ball about the next of some voxels of the wall. */
function drill(labelMap: vtkImageData, around: (i: number) => number[]): void {
  const labels = labelMap.getPointData().getScalars().getData() as Uint8Array;
  const wall = [...labels.keys()].filter((i) => labels[i] === 3);
  // Steps that visit all places, far from each other.
  const place = wall[(drilled++ * 6151) % Math.max(1, wall.length)];
  if (place === undefined) return;
  for (const i of around(place)) labels[i] = 0;
  labelMap.modified();
}
