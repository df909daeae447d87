import { type PerspectiveCamera, type Scene, WebGLRenderer } from 'three';
import { h } from '../ui/dom';

const NONE =
  'There is no 3D view: this browser offers no WebGL 2, or it is switched off. All else works: the model runs, with its plots and measures.';
const LOST =
  'The graphics card has taken the 3D view away. It comes back by itself as soon as it can; the model is not touched by it, and runs on.';

/** What makes pictures on a canvas: WebGL 2, which may not be there, and may be taken away and come back. */
export class Drawing {
  readonly #canvas: HTMLCanvasElement;
  readonly #renderer: WebGLRenderer | undefined;
  /** In place of the picture. */
  readonly #note = h('p', { class: 'view-note', role: 'alert' });
  #inSoftware: boolean | undefined;
  #disposed = false;

  /** `onBack`: what was drawn is gone, and can be drawn again. */
  constructor(canvas: HTMLCanvasElement, onBack: () => void) {
    this.#canvas = canvas;
    this.#renderer = rendererFor(canvas);
    canvas.addEventListener('webglcontextlost', () => this.#say(LOST));
    canvas.addEventListener('webglcontextrestored', () => {
      this.#note.remove();
      onBack();
    });
  }

  setSize(width: number, height: number): void {
    this.#renderer?.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#renderer?.setSize(width, height, false);
  }

  render(scene: Scene, camera: PerspectiveCamera): void {
    if (this.#renderer) this.#renderer.render(scene, camera);
    else this.#say(NONE);
  }

  /** Asked only when it matters: the page has to wait for the answer. */
  get inSoftware(): boolean {
    if (!this.#renderer) return false;
    this.#inSoftware ??= isSoftware(this.#renderer.getContext());
    return this.#inSoftware;
  }

  /** Gives the GPU's memory back; browsers allow a page only so many contexts. */
  dispose(): void {
    this.#disposed = true;
    this.#renderer?.dispose();
    this.#renderer?.forceContextLoss();
  }

  #say(text: string): void {
    if (this.#disposed || this.#note.isConnected) return;
    this.#note.textContent = text;
    this.#canvas.after(this.#note);
  }
}

/** Asked for here and not by three, which complains to the console where there is none. */
function rendererFor(canvas: HTMLCanvasElement): WebGLRenderer | undefined {
  const context = canvas.getContext('webgl2', { alpha: true, antialias: true, depth: true, stencil: false });
  if (!context) return undefined;
  const renderer = new WebGLRenderer({ canvas, context, antialias: true, alpha: true });
  // Who asks whether a shader has errors waits until it is compiled.
  renderer.debug.checkShaderErrors = false;
  return renderer;
}

/** Whether pictures are made by the processor: SwiftShader in Chromium, llvmpipe in Mesa, WARP in Windows. */
function isSoftware(context: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const info = context.getExtension('WEBGL_debug_renderer_info');
  const renderer = context.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : context.RENDERER);
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(String(renderer));
}
