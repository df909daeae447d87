import { type PerspectiveCamera, type Scene, WebGLRenderer } from 'three';
import { h } from '../kit/dom';
import { text } from '../texts';

const NONE = text('view.noWebGl');
const LOST = text('view.contextLost');

/** WebGL 2 rendering on a canvas; handles a missing graphics context, and one that is lost and restored. */
export class WebGlRendering {
  readonly #canvas: HTMLCanvasElement;
  readonly #renderer: WebGLRenderer | undefined;
  /** Message shown in place of the rendering if there is no graphics context. */
  readonly #note = h('p', { class: 'view-note', role: 'alert' });
  #inSoftware: boolean | undefined;
  #disposed = false;

  /** `onBack` is called when a lost graphics context has been restored and the scene must be rendered again. */
  constructor(canvas: HTMLCanvasElement, onBack: () => void) {
    this.#canvas = canvas;
    this.#renderer = rendererFor(canvas);
    canvas.addEventListener('webglcontextlost', () => this.#showNote(LOST));
    canvas.addEventListener('webglcontextrestored', () => {
      this.#note.remove();
      onBack();
    });
  }

  /** Sets the size of renderings, `ratio` pixels to a unit. */
  setSize(width: number, height: number, ratio = Math.min(devicePixelRatio, 2)): void {
    this.#renderer?.setPixelRatio(ratio);
    this.#renderer?.setSize(width, height, false);
  }

  /** Largest width and height of renderings, in pixels; 0 without a graphics context. */
  get largest(): number {
    const context = this.#renderer?.getContext();
    if (!context) return 0;
    const { MAX_RENDERBUFFER_SIZE, MAX_VIEWPORT_DIMS } = context;
    return Math.min(context.getParameter(MAX_RENDERBUFFER_SIZE), ...context.getParameter(MAX_VIEWPORT_DIMS));
  }

  /** Size of renderings in pixels; browsers make it smaller than it was set if memory does not suffice. */
  get size(): [number, number] {
    const { drawingBufferWidth = 0, drawingBufferHeight = 0 } = this.#renderer?.getContext() ?? {};
    return [drawingBufferWidth, drawingBufferHeight];
  }

  render(scene: Scene, camera: PerspectiveCamera): void {
    if (this.#renderer) this.#renderer.render(scene, camera);
    else this.#showNote(NONE);
  }

  /**
   * Whether WebGL renders without a GPU, so that rendering is slow. Queried on first use only, because it blocks the
   * page.
   */
  get inSoftware(): boolean {
    if (!this.#renderer) return false;
    this.#inSoftware ??= isSoftware(this.#renderer.getContext());
    return this.#inSoftware;
  }

  /** Releases the graphics context and its GPU memory; browsers limit the number of contexts of a page. */
  dispose(): void {
    this.#disposed = true;
    this.#renderer?.dispose();
    this.#renderer?.forceContextLoss();
  }

  #showNote(text: string): void {
    if (this.#disposed || this.#note.isConnected) return;
    this.#note.textContent = text;
    this.#canvas.after(this.#note);
  }
}

/**
 * Creates the renderer of three.js, or returns undefined without WebGL 2. The graphics context is requested here
 * because three.js logs an error if there is none.
 */
function rendererFor(canvas: HTMLCanvasElement): WebGLRenderer | undefined {
  const context = canvas.getContext('webgl2', { alpha: true, antialias: true, depth: true, stencil: false });
  if (!context) return undefined;
  const renderer = new WebGLRenderer({ canvas, context, antialias: true, alpha: true });
  renderer.localClippingEnabled = true;
  // Checking a shader for errors blocks until it is compiled.
  renderer.debug.checkShaderErrors = false;
  return renderer;
}

/**
 * Returns whether a graphics context renders without a GPU: with SwiftShader in Chromium, llvmpipe in Mesa, WARP in
 * Windows.
 */
function isSoftware(context: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const info = context.getExtension('WEBGL_debug_renderer_info');
  const renderer = context.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : context.RENDERER);
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(renderer));
}
