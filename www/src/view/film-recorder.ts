/** Media types of films, the best codec first. */
const TYPES = ['video/webm;codecs=vp9', 'video/webm;codecs=vp8', 'video/webm'];
/** Largest width and height of films in pixels: what encoders manage while a model runs. */
export const MOST_FILM = 4096;
/** Bits a second for each pixel: compression is hardly visible on plain surfaces. */
const BITS = 6;
const MOST_BITS = 40e6;

/** Returns the media type in which this browser records WebM; undefined if it cannot. */
export function filmType(): string | undefined {
  return TYPES.find((type) => globalThis.MediaRecorder?.isTypeSupported(type));
}

/** Records the content of a canvas as a WebM film, in real time, one frame at each call of {@link addFrame}. */
export class FilmRecorder {
  readonly #recorder: MediaRecorder;
  readonly #track: CanvasCaptureMediaStreamTrack;
  readonly #chunks: Blob[] = [];

  constructor(canvas: HTMLCanvasElement, mimeType: string) {
    const stream = canvas.captureStream(0);
    this.#track = stream.getVideoTracks()[0] as CanvasCaptureMediaStreamTrack;
    const videoBitsPerSecond = Math.min(MOST_BITS, BITS * canvas.width * canvas.height);
    this.#recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond });
    this.#recorder.addEventListener('dataavailable', ({ data }) => this.#chunks.push(data));
    this.#recorder.start(1000);
  }

  addFrame(): void {
    this.#track.requestFrame();
  }

  /** Ends the recording and returns the film. */
  async finish(): Promise<Uint8Array> {
    const stopped = new Promise((resolve) => this.#recorder.addEventListener('stop', resolve, { once: true }));
    this.#recorder.stop();
    await stopped;
    this.#track.stop();
    return new Uint8Array(await new Blob(this.#chunks).arrayBuffer());
  }
}
