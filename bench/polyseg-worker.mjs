// Makes surfaces by the package that Cornerstone3D calls for them, one label at a time, as its worker does.
import launcher from '/node_modules/@icr/polyseg-wasm/dist/ICRPolySeg.js';

const started = launcher({ locateFile: (file) => `/node_modules/@icr/polyseg-wasm/dist/${file}` });

const STRAIGHT = [1, 0, 0, 0, 1, 0, 0, 0, 1];

self.onmessage = async ({ data: { data, dims, label } }) => {
  const made = await started;
  const { points, polys } = made.convertLabelmapToSurface(data, dims, [1, 1, 1], STRAIGHT, [0, 0, 0], [label]);
  postMessage({ points, polys });
};
