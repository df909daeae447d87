type Listeners = { [K in keyof HTMLElementEventMap as `on${K}`]?: (event: HTMLElementEventMap[K]) => void };
type Attributes = Listeners & { [name: string]: unknown };

/**
 * Creates an HTML element with attributes, listeners (`on…`) and children. Attributes that are false or undefined are
 * omitted.
 */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) setAttribute(element, name, value);
  element.append(...children);
  return element;
}

function setAttribute(element: HTMLElement, name: string, value: unknown): void {
  if (name.startsWith('on')) element.addEventListener(name.slice(2), value as EventListener);
  else if (value === true) element.setAttribute(name, '');
  else if (value !== false && value !== undefined) element.setAttribute(name, String(value));
}

/**
 * Returns a canvas's 2D context that draws on the CPU, for small images. With an accelerated context, after a few
 * images, the browser would wait until the GPU has completed all rendering of the 3D view: up to half a second without
 * a GPU.
 */
export function context2d(canvas: HTMLCanvasElement): CanvasRenderingContext2D | null {
  return canvas.getContext('2d', { willReadFrequently: true });
}

/** Returns the value of a custom property (design token) of the style sheet in the current colour scheme. */
export function token(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/**
 * Calls `callback` whenever the user's preference for a light or dark scheme changes, to redraw what does not follow
 * the style sheet. Returns what ends that.
 */
export function onSchemeChange(callback: () => void): () => void {
  const scheme = matchMedia('(prefers-color-scheme: dark)');
  scheme.addEventListener('change', callback);
  return () => scheme.removeEventListener('change', callback);
}

/** Returns whether the user prefers reduced motion, as set in the system or browser. */
export function prefersReducedMotion(): boolean {
  return matchMedia('(prefers-reduced-motion: reduce)').matches;
}

let ids = 0;
/** Returns an element id that is unique on the page and begins with `prefix`. */
export function uniqueId(prefix: string): string {
  return `${prefix}-${++ids}`;
}
