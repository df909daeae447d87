// Starting the module, and crashes. Each case needs a process of its own.
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { expect, test } from 'vitest';

const root = fileURLToPath(new URL('../../', import.meta.url));

/** Runs a module script in a new Node process from the project's folder and returns what it prints. */
function node(script: string, timeout = 30_000): string {
  return execFileSync(process.execPath, ['--input-type=module', '--eval', script], {
    cwd: root,
    encoding: 'utf8',
    timeout,
  }).trim();
}

test('version is that of the package', () => {
  const { version } = JSON.parse(readFileSync(`${root}/pkg/package.json`, 'utf8'));
  expect(node(`import init, { version } from './pkg/index.js'; await init(); console.log(version())`)).toBe(version);
});

test('init is idempotent, and also takes bytes, a module, a response and an address', () => {
  const sources = [
    `readFileSync('pkg/vesicle_bg.wasm')`,
    `new WebAssembly.Module(readFileSync('pkg/vesicle_bg.wasm'))`,
    `new Response(readFileSync('pkg/vesicle_bg.wasm'))`,
    `Promise.resolve(new URL('./pkg/vesicle_bg.wasm', 'file://' + process.cwd() + '/'))`,
  ];
  for (const source of sources) {
    // Also by the former name.
    const option = source === sources[0] ? 'module_or_path' : 'module';
    const script = `
      import { readFileSync } from 'node:fs';
      import init, { version } from './pkg/index.js';
      const first = await init({ ${option}: ${source} });
      console.log((await init()) === first, version().length > 0);`;
    expect(node(script), source).toBe('true true');
  }
});

test('initSync starts synchronously', () => {
  const script = `
    import { readFileSync } from 'node:fs';
    import init, { initSync, version } from './pkg/index.js';
    const first = initSync({ module: readFileSync('pkg/vesicle_bg.wasm') });
    console.log((await init()) === first, version().length > 0);`;
  expect(node(script)).toBe('true true');
});

test('a failed start can be tried again', () => {
  const script = `
    import init, { version } from './pkg/index.js';
    const failed = await init({ module: new Uint8Array(8) }).catch((error) => error.name);
    await init();
    console.log(failed, version().length > 0);`;
  expect(node(script)).toBe('CompileError true');
});

test('calls before init say what to do', () => {
  const script = `
    import { version } from './pkg/index.js';
    try { version(); } catch (error) { console.log(error.name, error.code, error.message); }`;
  expect(node(script)).toMatch(/^VesicleError invalid-argument init: .*await init\(\)/);
});

test('importing and starting print nothing and keep no process alive', () => {
  expect(node(`import init from './pkg/index.js'; await init();`)).toBe('');
});

// Traps need a bug, so the raw function is replaced by one that throws the same error.
const CRASH = `
  import init, { Mesh } from './pkg/index.js';
  import { RawMesh } from './pkg/vesicle.js';
  const attempt = (work) => { try { return work(); } catch (error) { return error.name + ' ' + error.code; } };
  await init();
  const old = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 });
  const { info } = RawMesh.prototype;
  RawMesh.prototype.info = () => { throw new WebAssembly.RuntimeError('unreachable'); };
  const seen = [attempt(() => old.info())];
  RawMesh.prototype.info = info;
  seen.push(attempt(() => old.info()), attempt(() => Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 })));
  await init();
  seen.push(attempt(() => old.info()), attempt(() => old.free()));
  seen.push(attempt(() => Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 }).info().genus));
  console.log(JSON.stringify(seen));`;

test('after a crash every call reports it, until init starts a new instance', () => {
  const crash = 'VesicleCrash crash';
  expect(JSON.parse(node(CRASH))).toEqual([crash, crash, crash, 'VesicleError freed', null, 0]);
});

test('the example of the README runs', () => {
  const [, example = ''] = /```js\n([\s\S]*?)```/.exec(readFileSync(`${root}/README.md`, 'utf8')) ?? [];
  const script = `
    import { readFileSync } from 'node:fs';
    globalThis.fetch = async () => new Response(readFileSync('www/public/data/visible-human-head.nii.gz'));
    ${example.replace("from 'vesicle'", "from './pkg/index.js'")}
    console.log(report.done, positions.length / 3 === report.vertices, indices.length / 3 === report.triangles);
    console.log(new TextDecoder().decode(glb.subarray(0, 4)));`;
  // A complete run of the model.
  expect(node(script, 60_000).split('\n').slice(-2)).toEqual(['true true true', 'glTF']);
});
