// Times updates of a surface of 20,000 vertices whose connectivity changes in every frame, in each host: the live pages
// of the built app, with a computed torus instead of their models. Rendering is in software, and is timed as long as it
// blocks the page.
import { launchChromium } from '../scripts/chromium.mjs';
import { serveApp } from '../scripts/serve.mjs';

/** Expression that makes each page render immediately. */
const DRAW = {
  three: 'render()',
  niivue: 'nv.drawScene()',
  'niivue-next': 'nv.view.render()',
  vtk: 'render()',
  itk: 'render()',
};

/** Number of timed frames, and of frames before them that are not timed. */
const FRAMES = 30;
const FIRST = 5;

/** Returns the median milliseconds per frame for each host: of the update, and of rendering. */
export async function measure(folder) {
  const server = await serveApp(folder);
  const browser = await launchChromium();
  try {
    const rows = [];
    for (const name of Object.keys(DRAW)) rows.push({ name, ...(await measureHost(browser, server.address, name)) });
    return { host: `Chromium ${browser.version()}`, rows };
  } finally {
    await browser.close();
    await server.close();
  }
}

async function measureHost(browser, address, name) {
  // Waiting for a condition evaluates a string, which the pages' policy forbids.
  const page = await browser.newPage({ viewport: { width: 800, height: 640 }, bypassCSP: true });
  await page.goto(`${address}embed/${name}.html`);
  await page.waitForFunction('window.surface && window.model.mesh.topologyVersion > 1', undefined, {
    timeout: 120_000,
  });
  // Freeing the model stops the page's own run.
  await page.evaluate('model.free()');
  await page.waitForSelector('[data-state=error]');
  const measured = await page.evaluate(`(${inPage})(${FRAMES}, ${FIRST}, () => ${DRAW[name]})`);
  await page.close();
  return measured;
}

/** Runs in the page. */
async function inPage(frames, first, draw) {
  /** Returns a torus of `around` × `along` vertices as a mesh with version counters. */
  function torus(around, along) {
    const [positions, normals, indices] = [[], [], []];
    for (let u = 0; u < around; u++) {
      for (let v = 0; v < along; v++) {
        const [a, b] = [(2 * Math.PI * u) / around, (2 * Math.PI * v) / along];
        const normal = [Math.cos(a) * Math.cos(b), Math.sin(a) * Math.cos(b), Math.sin(b)];
        normals.push(...normal);
        positions.push(50 * Math.cos(a) + 20 * normal[0], 50 * Math.sin(a) + 20 * normal[1], 20 * normal[2]);
        const [i, right] = [u * along + v, ((u + 1) % around) * along + v];
        const [up, both] = [u * along + ((v + 1) % along), ((u + 1) % around) * along + ((v + 1) % along)];
        indices.push(i, right, both, i, both, up);
      }
    }
    const [xyz, abc] = [Float32Array.from(positions), Uint32Array.from(indices)];
    return { positions: xyz, normals: Float32Array.from(normals), indices: abc };
  }
  const shapes = [torus(200, 100), torus(160, 125)];
  const mesh = { topologyVersion: 0, geometryVersion: 0, arrays: () => shapes[mesh.geometryVersion % 2] };
  const middle = (list) => list.toSorted((a, b) => a - b)[Math.floor(list.length / 2)];
  const [updates, draws] = [[], []];
  for (let i = 0; i < first + frames; i++) {
    mesh.topologyVersion++;
    mesh.geometryVersion++;
    const started = performance.now();
    await window.surface.update(mesh);
    const taken = performance.now();
    draw();
    updates.push(taken - started);
    draws.push(performance.now() - taken);
    await new Promise(requestAnimationFrame);
  }
  const vertices = shapes[0].positions.length / 3;
  return { vertices, update: middle(updates.slice(first)), draw: middle(draws.slice(first)) };
}
