import NiiVue from 'niivue-next/webgl2';
import init, { DeformableModel, Volume } from 'vesicle';
import { NiivueSurface, volumeFromNiivue } from 'vesicle/niivue';
import { page, shown } from './page';

await page(async () => {
  const nv = new NiiVue({
    ...{ backgroundColor: [0.08, 0.09, 0.1, 1], is3DCrosshairVisible: true },
    // A large 3D view beside the slices.
    ...{ showRender: 1, heroFraction: 0.55, heroSliceType: 4 },
  });
  await nv.attachToCanvas(document.querySelector('canvas') as HTMLCanvasElement);
  await nv.loadVolumes([{ url: '../data/visible-human-head.nii.gz' }]);
  // The 3D view shows the surface alone: the volume is beyond the clip plane.
  nv.setClipPlane([-0.95, 270, 0]);

  await init();
  const volume = new Volume(volumeFromNiivue(nv.volumes[0]));
  const model = new DeformableModel({ volume, levels: 2, params: { iso: 35, isoForce: -1 } });
  const surface = new NiivueSurface(nv, { color: [1, 0.75, 0.5, 1] });
  Object.assign(window, { nv, model, surface });
  for (;;) {
    const report = model.step();
    if (await surface.update(model.mesh)) nv.drawScene();
    await shown(report);
    if (report.done) return report;
  }
});
