type Listeners = { [K in keyof HTMLElementEventMap as `on${K}`]?: (event: HTMLElementEventMap[K]) => void };
type Attributes = Listeners & { [name: string]: unknown };

/** A new element. Attributes that are false or undefined are left out; `on…` are listeners. */
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
 * What draws on a small picture, by the processor. The browser would rather draw it with the graphics card and, after a few
 * pictures, wait for all that the view in 3D has asked of the card: up to half a second where there is none.
 */
export function pen(canvas: HTMLCanvasElement): CanvasRenderingContext2D | null {
  return canvas.getContext('2d', { willReadFrequently: true });
}

/** A titled part of a column. */
export function section(title: string, ...children: (Node | string)[]): HTMLElement {
  return h('section', { class: 'panel' }, h('h2', {}, title), ...children);
}

/** A letter of a formula; a Latin letter after a Greek one is its index, and so is what stands after a low line. */
export function symbol(text: string): HTMLElement {
  const [, base = text, index = ''] = /^([α-ω])([A-Za-z])$/.exec(text) ?? /^(\w)_(\w+)$/.exec(text) ?? [];
  return h('span', { class: 'symbol' }, base, ...(index ? [h('sub', {}, index)] : []));
}

/** A picture from a 24 by 24 path; decoration only, the text beside it says the same. */
export function icon(path: string): SVGSVGElement {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 0 24 24');
  svg.setAttribute('class', 'icon');
  svg.setAttribute('aria-hidden', 'true');
  const shape = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  shape.setAttribute('d', path);
  svg.append(shape);
  return svg;
}

/** The value of a colour (or other) token of the style sheet, in the scheme in force. */
export function token(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Calls back when the reader's light or dark preference changes. */
export function onSchemeChange(callback: () => void): void {
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', callback);
}

/** Whether the reader asked for nothing to move that was not asked for. */
export function wantsStillness(): boolean {
  return matchMedia('(prefers-reduced-motion: reduce)').matches;
}

let ids = 0;
/** An id that no other element has. */
export function uniqueId(prefix: string): string {
  return `${prefix}-${++ids}`;
}
