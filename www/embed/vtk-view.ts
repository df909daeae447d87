// A plain vtk.js view, shared by the pages that use it: one slice of an image, and actors.
import '@kitware/vtk.js/Rendering/Profiles/Volume';
import type vtkImageData from '@kitware/vtk.js/Common/DataModel/ImageData';
import type vtkActor from '@kitware/vtk.js/Rendering/Core/Actor';
import vtkImageMapper from '@kitware/vtk.js/Rendering/Core/ImageMapper';
import { SlicingMode } from '@kitware/vtk.js/Rendering/Core/ImageMapper/Constants';
import vtkImageSlice from '@kitware/vtk.js/Rendering/Core/ImageSlice';
import vtkGenericRenderWindow from '@kitware/vtk.js/Rendering/Misc/GenericRenderWindow';

/**
 * Sets up a vtk.js view of the middle slice (along the third axis) of `image` and of `actor`, seen from the front, head
 * up. Returns a function that renders it.
 */
export function sliceAndSurface(image: vtkImageData, actor: vtkActor): () => void {
  actor.getProperty().setColor(0.95, 0.86, 0.75);
  return sliceAndSurfaces(image, [actor], [-0.7, -1.5, 0.5], 1.5);
}

/** The same with several actors, which keep their colours, seen from the direction `from`, enlarged. */
export function sliceAndSurfaces(
  image: vtkImageData,
  actors: vtkActor[],
  from: [number, number, number],
  zoom: number,
): () => void {
  const view = document.querySelector('#view') as HTMLElement;
  const generic = vtkGenericRenderWindow.newInstance({ background: [0.08, 0.09, 0.1], listenWindowResize: false });
  generic.setContainer(view);
  const renderer = generic.getRenderer();
  renderer.addViewProp(middleSlice(image));
  for (const actor of actors) renderer.addActor(actor);
  const camera = renderer.getActiveCamera();
  camera.setPosition(...from);
  camera.setViewUp(0, 0, 1);
  renderer.resetCamera(image.getBounds());
  camera.zoom(zoom);
  new ResizeObserver(() => generic.resize()).observe(view);
  return () => generic.getRenderWindow().render();
}

function middleSlice(image: vtkImageData) {
  const mapper = vtkImageMapper.newInstance();
  mapper.setInputData(image);
  mapper.setSlicingMode(SlicingMode.K);
  mapper.setSlice(Math.floor((image.getDimensions()[2] ?? 1) / 2));
  const slice = vtkImageSlice.newInstance();
  slice.setMapper(mapper);
  const [low, high] = image.getPointData().getScalars().getRange();
  slice.getProperty().setColorWindow(high - low);
  slice.getProperty().setColorLevel((low + high) / 2);
  return slice;
}
