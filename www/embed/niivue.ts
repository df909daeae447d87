import { Niivue, NVMesh, SHOW_RENDER, SLICE_TYPE } from '@niivue/niivue';
import init, { DeformableModel, Volume } from 'vesicle';
import { NiivueSurface, volumeFromNiivue } from 'vesicle/niivue';
import { page, shown } from './page';

await page(async () => {
  const nv = new Niivue({
    ...{ backColor: [0.08, 0.09, 0.1, 1], crosshairWidth: 0.4, show3Dcrosshair: false },
    // A large 3D view beside the slices.
    ...{ multiplanarShowRender: SHOW_RENDER.ALWAYS, heroImageFraction: 0.6, heroSliceType: SLICE_TYPE.RENDER },
  });
  await nv.attachToCanvas(document.querySelector('canvas') as HTMLCanvasElement);
  await nv.loadVolumes([{ url: '../data/heart.nii.gz' }]);
  // The 3D view shows the surface alone, from the front: the volume is beyond the clip plane.
  nv.setClipPlane([-2, 0, 0]);
  nv.setScale(1.8);
  nv.setRenderAzimuthElevation(200, 10);

  await init();
  const volume = new Volume(volumeFromNiivue(nv.volumes[0]));
  const model = new DeformableModel({ volume, levels: 1, edge: 1.5, params: { iso: 85, isoForce: -1 } });
  const surface = new NiivueSurface(nv, { NVMesh, color: [0.85, 0.3, 0.28, 1] });
  Object.assign(window, { nv, model, surface });
  for (;;) {
    const report = model.step();
    if (await surface.update(model.mesh)) nv.drawScene();
    await shown(report);
    if (report.done) return report;
  }
});
