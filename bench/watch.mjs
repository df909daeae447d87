// Functions that are injected into the page and its workers before their own scripts run, to measure them from outside.
// Each is self-contained, because it is sent as text.

/** Records in `window.watched` the times of first events, long tasks, and uploads to the GPU. */
export function watchPage() {
  /** Draw calls with fewer indices are text, boxes and slices; copies of fewer bytes are no meshes. */
  const [MANY, LARGE] = [1000, 20_000];
  const watched = { marks: {}, long: [], drawn: 0, frames: 0, triangles: 0, gpu: 0, copied: 0, largestCopy: 0 };
  watched.uploads = { bytes: 0, made: 0, refilled: 0 };
  window.watched = watched;
  const mark = (name) => {
    watched.marks[name] ??= performance.now();
  };

  new PerformanceObserver((list) => {
    for (const { name } of list.getEntries()) if (name === 'first-contentful-paint') mark('paint');
  }).observe({ type: 'paint', buffered: true });
  const who = (start, end) => {
    const scripts = watched.slow?.filter((one) => one.startTime < end && one.startTime + one.duration > start) ?? [];
    return scripts.map(({ invoker, duration }) => `${invoker} ${Math.round(duration)}`).join(', ');
  };
  new PerformanceObserver((list) => {
    watched.slow = [...(watched.slow ?? []), ...list.getEntries().flatMap(({ scripts }) => scripts)].slice(-40);
    for (const task of watched.long) task.by ||= who(task.start, task.start + task.duration);
  }).observe({ type: 'long-animation-frame', buffered: true });
  new PerformanceObserver((list) => {
    for (const { startTime: start, duration } of list.getEntries())
      watched.long.push({ start, duration, by: who(start, start + duration) });
  }).observe({ type: 'longtask', buffered: true });

  const gl = WebGL2RenderingContext.prototype;
  const { drawElements, bufferData, bufferSubData, bindBuffer, deleteBuffer, getParameter } = gl;
  const sizes = new Map();
  const bound = {};
  gl.drawElements = function (mode, count, ...rest) {
    if (mode === gl.TRIANGLES && count > MANY) {
      mark('surface');
      watched.drawn = count / 3;
      watched.triangles = Math.max(watched.triangles, count / 3);
      watched.frames += 1;
    }
    return drawElements.call(this, mode, count, ...rest);
  };
  gl.bindBuffer = function (target, buffer) {
    bound[target] = buffer;
    return bindBuffer.call(this, target, buffer);
  };
  gl.bufferData = function (target, data, ...rest) {
    const bytes = data?.byteLength ?? 0;
    watched.gpu += bytes - (sizes.get(bound[target]) ?? 0);
    sizes.set(bound[target], bytes);
    if (bytes > LARGE) watched.uploads.made += 1;
    if (bytes > LARGE) watched.uploads.bytes += bytes;
    return bufferData.call(this, target, data, ...rest);
  };
  gl.bufferSubData = function (target, offset, data, from, length) {
    const bytes = (length || data.length) * data.BYTES_PER_ELEMENT;
    if (bytes > LARGE) watched.uploads.refilled += 1;
    if (bytes > LARGE) watched.uploads.bytes += bytes;
    return bufferSubData.call(this, target, offset, data, from, length);
  };
  gl.deleteBuffer = function (buffer) {
    watched.gpu -= sizes.get(buffer) ?? 0;
    sizes.delete(buffer);
    return deleteBuffer.call(this, buffer);
  };
  gl.getParameter = function (name) {
    const info = watched.renderer ? undefined : this.getExtension('WEBGL_debug_renderer_info');
    if (info) watched.renderer = getParameter.call(this, info.UNMASKED_RENDERER_WEBGL);
    return getParameter.call(this, name);
  };

  const typed = Object.getPrototypeOf(Float32Array.prototype);
  const { set } = typed;
  typed.set = function (source, ...rest) {
    if (source.byteLength > LARGE) watched.copied += source.byteLength;
    watched.largestCopy = Math.max(watched.largestCopy, source.byteLength ?? 0);
    return set.call(this, source, ...rest);
  };

  addEventListener('DOMContentLoaded', () => {
    const lab = document.getElementById('lab');
    if (!lab) return;
    new MutationObserver(() => {
      if (['paused', 'running', 'done'].includes(lab.dataset.state)) mark('interactive');
    }).observe(lab, { attributeFilter: ['data-state'] });
    // The parameters come from the engine, with its first answer.
    new MutationObserver(() => {
      if (lab.querySelector('[data-param]')) mark('engine');
    }).observe(lab, { childList: true, subtree: true });
  });
}

/** Records in `self.watched` the size of the module's memory, and whether meshes are transferred or copied. */
export function watchWorker() {
  const LARGE = 20_000;
  const watched = { wasm: 0, frames: 0, handedOver: 0, cloned: 0 };
  self.watched = watched;
  // Any access to the module's memory reveals the memory object.
  const { get } = Object.getOwnPropertyDescriptor(WebAssembly.Memory.prototype, 'buffer');
  let memory;
  Object.defineProperty(WebAssembly.Memory.prototype, 'buffer', {
    configurable: true,
    get() {
      memory = this;
      return get.call(this);
    },
  });
  const { postMessage } = self;
  const arraysIn = (value, depth = 0) => {
    if (ArrayBuffer.isView(value)) return [value];
    if (!value || typeof value !== 'object' || depth > 4) return [];
    return Object.values(value).flatMap((one) => arraysIn(one, depth + 1));
  };
  self.postMessage = (message, ...rest) => {
    const large = arraysIn(message)
      .map((array) => ({ array, bytes: array.byteLength }))
      .filter(({ bytes }) => bytes > LARGE);
    postMessage.call(self, message, ...rest);
    watched.wasm = memory ? get.call(memory).byteLength : 0;
    if (large.length > 0) watched.frames += 1;
    // Transferred arrays are empty afterwards.
    for (const { array, bytes } of large) watched[array.byteLength === 0 ? 'handedOver' : 'cloned'] += bytes;
  };
}
