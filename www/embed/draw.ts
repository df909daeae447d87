import { Niivue, NVMesh, SHOW_RENDER, SLICE_TYPE } from '@niivue/niivue';
import init, { LabelSurfaces, type Mesh, Volume } from 'vesicle';
import { followDrawing } from 'vesicle/niivue';
import { status } from './page';

const element = <E extends HTMLElement>(id: string) => document.querySelector(`#${id}`) as E;

await status(async (say) => {
  const nv = new Niivue({
    ...{ backColor: [0.08, 0.09, 0.1, 1], crosshairWidth: 0.4, show3Dcrosshair: false },
    ...{ crosshairColor: [0.6, 0.8, 1, 0.8] },
    // A large 3D view beside the slices.
    ...{ multiplanarShowRender: SHOW_RENDER.ALWAYS, heroImageFraction: 0.5, heroSliceType: SLICE_TYPE.RENDER },
  });
  await nv.attachToCanvas(document.querySelector('canvas') as HTMLCanvasElement);
  await nv.loadVolumes([{ url: '../data/heart.nii.gz' }]);
  nv.setClipPlane([-2, 0, 0]);
  nv.setScale(1.8);
  nv.setRenderAzimuthElevation(200, 10);
  nv.setDrawingEnabled(true);
  nv.setDrawOpacity(0.4);

  await init();
  const drawing = followDrawing(nv, { NVMesh, LabelSurfaces, Volume, onChange: () => show() });
  const show = () => {
    const parts = [...drawing.meshes].map(([label, mesh]) => `${label}: ${(mesh.info().volume / 1000).toFixed(1)} ml`);
    say(parts.length > 0 ? `Volume of each colour, ${parts.join(', ')}` : 'Draw in a slice.');
  };
  fillVentricles(nv);
  tools(nv, drawing.meshes);
  await drawing.update();
  show();
  Object.assign(window, { nv, drawing });
});

/** Fills the two ventricles with NiiVue's own tool, so that there is something to see and to change. */
function fillVentricles(nv: Niivue): void {
  const seeds = [
    [32, 31, 5],
    [45, 37, 8],
  ];
  for (const [k, seed] of seeds.entries()) {
    nv.setPenValue(k + 1);
    // Blood is brighter than 85.
    nv.drawFloodFill(seed, 0, Number.POSITIVE_INFINITY, 85, 1000);
  }
  nv.scene.crosshairPos = nv.vox2frac([36, 33, 6]);
}

/** Lets the controls above the view change NiiVue's pen. */
function tools(nv: Niivue, meshes: ReadonlyMap<number, Mesh>): void {
  const [pen, width, filled] = [
    element<HTMLSelectElement>('pen'),
    element<HTMLSelectElement>('width'),
    element<HTMLInputElement>('filled'),
  ];
  const set = () => {
    nv.opts.penSize = Number(width.value);
    nv.setPenValue(Number(pen.value), filled.checked);
  };
  for (const control of [pen, width, filled]) control.onchange = set;
  set();
  element('undo').onclick = () => nv.drawUndo();
  element('save').onclick = () => {
    for (const [label, mesh] of meshes) {
      const link = document.createElement('a');
      link.href = URL.createObjectURL(new Blob([mesh.toBytes('stl').slice()]));
      link.download = `drawing-${label}.stl`;
      link.click();
      URL.revokeObjectURL(link.href);
    }
  };
}
