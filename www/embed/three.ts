import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { NRRDLoader } from 'three/addons/loaders/NRRDLoader.js';
import init, { DeformableModel, Volume } from 'vesicle';
import { ThreeSurface, volumeFromThree } from 'vesicle/three';
import { page, shown } from './page';

await page(async () => {
  const view = document.querySelector('#view') as HTMLElement;
  const renderer = new THREE.WebGLRenderer({ antialias: true });
  renderer.setClearColor(0x14171a);
  view.append(renderer.domElement);
  const camera = new THREE.PerspectiveCamera(40, 1, 1, 2000);
  camera.position.set(170, -230, 90);
  camera.up.set(0, 0, 1);
  const scene = new THREE.Scene().add(camera, new THREE.HemisphereLight(0xffffff, 0x445566, 2.5));
  camera.add(new THREE.DirectionalLight(0xffffff, 1.5));
  const controls = new OrbitControls(camera, renderer.domElement);
  const render = () => renderer.render(scene, camera);
  const resize = () => {
    renderer.setSize(view.clientWidth, view.clientHeight, false);
    camera.aspect = view.clientWidth / view.clientHeight;
    camera.updateProjectionMatrix();
    render();
  };
  controls.addEventListener('change', render);
  new ResizeObserver(resize).observe(view);

  const tooth = await new NRRDLoader().loadAsync('../data/tooth.nrrd');
  scene.add(tooth.extractSlice('z', 10).mesh);
  const object = new THREE.Mesh(undefined, new THREE.MeshStandardMaterial({ color: 0xf2dcc0 }));
  scene.add(object);

  await init();
  const volume = new Volume(volumeFromThree(tooth, { world: 'slices' }));
  const model = new DeformableModel({ volume, levels: 1, params: { iso: 600, isoForce: -1 } });
  const surface = new ThreeSurface(THREE, object);
  Object.assign(window, { tooth, model, surface, object, render });
  for (;;) {
    const report = model.step();
    if (surface.update(model.mesh)) render();
    await shown(report);
    if (report.done) return report;
  }
});
