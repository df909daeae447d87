// A viewer on three.js: opens a volume, fits a surface to it in a worker, shows it as it changes, edits it and saves it.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { ThreeSurface } from 'vesicle/three';
import init, { DeformableModel, Volume } from 'vesicle/worker';

const [view, file, iso, run, cancel, smooth, decimate, save, status] = document.querySelectorAll('[id]');

// ── The scene

const renderer = new THREE.WebGLRenderer({ canvas: view, antialias: true, alpha: true });
const camera = new THREE.PerspectiveCamera(40, 1, 1, 1e5);
camera.up.set(0, 0, 1);
const controls = new OrbitControls(camera, view);
const object = new THREE.Mesh(undefined, new THREE.MeshStandardMaterial({ color: 0xe07a5f }));
const light = new THREE.DirectionalLight(0xffffff, 2);
const scene = new THREE.Scene().add(object, camera.add(light), new THREE.HemisphereLight(0xffffff, 0x443322, 2));
const surface = new ThreeSurface(THREE, object);

const draw = () => renderer.render(scene, camera);
controls.addEventListener('change', draw);

function fit() {
  renderer.setSize(innerWidth, innerHeight, false);
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  draw();
}
addEventListener('resize', fit);

function lookAt({ center, radius }) {
  controls.target.copy(center);
  camera.position
    .set(-1, 2, 0.5)
    .setLength(3 * radius)
    .add(center);
  [camera.near, camera.far] = [radius / 10, 100 * radius];
  camera.updateProjectionMatrix();
  controls.update();
}

/** Shows a mesh if it has changed. Of several calls under way, the last one counts. */
async function show(mesh) {
  if (await surface.update(mesh)) draw();
}

// ── The work, one at a time

let volume, model, edited, working;

/** Does work that *Cancel* aborts, and shows the result. */
async function work(what, doIt) {
  working = new AbortController();
  enable();
  status.value = what;
  try {
    status.value = await doIt(working.signal);
  } catch (error) {
    status.value = error.name === 'AbortError' ? 'Cancelled.' : error.message;
  }
  working = undefined;
  enable();
}

function enable() {
  for (const control of [file, iso]) control.disabled = Boolean(working);
  run.disabled = Boolean(working) || !volume;
  cancel.disabled = !working;
  for (const button of [smooth, decimate, save]) button.disabled = Boolean(working) || !model;
}

const open = ([chosen]) =>
  work(`Opening ${chosen.name}.`, async () => {
    const opened = await Volume.parse(new Uint8Array(await chosen.arrayBuffer()));
    // Freed at once: the browser does not see memory of WebAssembly.
    for (const old of [volume, model, edited]) old?.free();
    [volume, model, edited] = [opened, undefined, undefined];
    const [low, high] = await volume.range;
    iso.value = ((low + high) / 2).toPrecision(4);
    return [`${chosen.name}, ${low} to ${high}.`, ...(await volume.warnings).map(({ text }) => text)].join(' ');
  });

const grow = () =>
  work('Beginning.', async (signal) => {
    const made = await DeformableModel.create({ volume, params: { iso: Number(iso.value) } }, { signal });
    for (const old of [model, edited]) old?.free();
    [model, edited] = [made, undefined];
    await show(model.mesh);
    lookAt(object.geometry.boundingSphere);
    const onStep = ({ iteration, phase }) => {
      status.value = `Step ${iteration}: ${phase}.`;
      show(model.mesh).catch(() => undefined);
    };
    const { warnings } = await model.run({ signal, onStep });
    await show(model.mesh);
    return describe(model.mesh, warnings);
  });

const edit = (what, change) =>
  work(what, async (signal) => {
    edited ??= await model.mesh.clone();
    await change(edited.inSlices({ signal }), await edited.info());
    await show(edited);
    return describe(edited, await edited.warnings);
  });

async function describe(mesh, warnings) {
  const { triangles, components, volume } = await mesh.info();
  const found = `${triangles} triangles, ${components} components, volume ${volume.toPrecision(4)}.`;
  return [found, ...warnings.map(({ text }) => text)].join(' ');
}

const download = () =>
  work('Saving.', async () => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([await (edited ?? model.mesh).toBytes('stl')]));
    link.download = 'surface.stl';
    link.click();
    URL.revokeObjectURL(link.href);
    return 'Saved surface.stl.';
  });

file.onchange = () => open(file.files);
run.form.onsubmit = (event) => {
  event.preventDefault();
  grow();
};
cancel.onclick = () => working?.abort();
smooth.onclick = () => edit('Smoothing.', (tools) => tools.smooth({ iterations: 20 }));
decimate.onclick = () => edit('Decimating.', (tools, { triangles }) => tools.decimate(Math.round(triangles / 2)));
save.onclick = download;

fit();
await init();
enable();
status.value = 'Open a volume: NIfTI, NRRD or MetaImage.';
