import { Niivue, NVMesh, SHOW_RENDER, SLICE_TYPE } from '@niivue/niivue';
import init, { LabelSurfaces, type Mesh, Volume } from 'vesicle';
import { followDrawing } from 'vesicle/niivue';
import { status } from './page';

const element = <E extends HTMLElement>(id: string) => document.querySelector(`#${id}`) as E;

await status(async (say) => {
  const nv = new Niivue({
    ...{ backColor: [0.08, 0.09, 0.1, 1], crosshairWidth: 0.4, show3Dcrosshair: false },
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
  tools(nv, drawing.meshes);
  drawChamber(nv);
  await drawing.update();
  Object.assign(window, { nv, drawing });
});

/** Draws the blood around the middle of the volume, so that there is something to see and to change. */
function drawChamber(nv: Niivue): void {
  const [image] = nv.volumes;
  const [, nx = 0, ny = 0, nz = 0] = image?.dimsRAS ?? [];
  const middle = [0.4 * nx, 0.5 * ny, 0.3 * nz];
  for (let z = 0, i = 0; z < nz; z++) {
    for (let y = 0; y < ny; y++) {
      for (let x = 0; x < nx; x++, i++) {
        const away = Math.hypot(x - (middle[0] ?? 0), y - (middle[1] ?? 0), z - (middle[2] ?? 0));
        if (away < 0.25 * nx && nv.drawBitmap && (image?.getValue(x, y, z) ?? 0) > 85) nv.drawBitmap[i] = 1;
      }
    }
  }
  nv.drawAddUndoBitmap();
  nv.refreshDrawing();
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
