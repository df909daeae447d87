import { Niivue, NVMesh, SHOW_RENDER } from '@niivue/niivue';
import init, { DeformableModel, Volume } from 'vesicle';
import { NiivueSurface, volumeFromNiivue } from 'vesicle/niivue';
import { page, shown } from './page';

await page(async () => {
  const nv = new Niivue({
    ...{ backColor: [0.08, 0.09, 0.1, 1], multiplanarShowRender: SHOW_RENDER.ALWAYS },
    // Slices show the part of the surface near them; the surface also shows through the volume.
    ...{ meshThicknessOn2D: 2, meshXRay: 0.6 },
  });
  await nv.attachToCanvas(document.querySelector('canvas') as HTMLCanvasElement);
  await nv.loadVolumes([{ url: '../data/heart.nii.gz' }]);

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
