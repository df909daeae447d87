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

/** Shortest time between frames, milliseconds: encoders drop frames that come faster than they manage. */
const FRAME_MS = 1000 / 31;
/** Time in which an encoder must have encoded a first frame, milliseconds, and the time between attempts. */
const [PATIENCE, PAUSE] = [5000, 100];

/** Records the content of a canvas as a WebM film, in real time, with up to 30 frames a second. */
export class FilmRecorder {
  readonly #recorder: MediaRecorder;
  readonly #track: CanvasCaptureMediaStreamTrack;
  readonly #chunks: Blob[] = [];
  #last = Number.NEGATIVE_INFINITY;

  constructor(canvas: HTMLCanvasElement, mimeType: string) {
    const stream = canvas.captureStream(0);
    this.#track = stream.getVideoTracks()[0] as CanvasCaptureMediaStreamTrack;
    const videoBitsPerSecond = Math.min(MOST_BITS, BITS * canvas.width * canvas.height);
    this.#recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond });
    this.#recorder.addEventListener('dataavailable', ({ data }) => this.#chunks.push(data));
    this.#recorder.start(1000);
  }

  /** Records the canvas's content as a frame, unless the one before has just been recorded. */
  addFrame(): void {
    const now = performance.now();
    if (now - this.#last < FRAME_MS) return;
    this.#last = now;
    this.#track.requestFrame();
  }

  /** Ends the recording and returns the film, which is empty if the encoder did not manage a single frame. */
  async finish(): Promise<Uint8Array> {
    const isRecording = () => this.#recorder.state === 'recording';
    for (let waited = 0; waited < PATIENCE && !this.#hasData && isRecording(); waited += PAUSE) {
      this.addFrame();
      this.#recorder.requestData();
      await new Promise((resolve) => setTimeout(resolve, PAUSE));
    }
    await this.cancel();
    return new Uint8Array(await new Blob(this.#chunks).arrayBuffer());
  }

  async cancel(): Promise<void> {
    if (this.#recorder.state !== 'inactive') {
      const stopped = new Promise((resolve) => this.#recorder.addEventListener('stop', resolve, { once: true }));
      this.#recorder.stop();
      await stopped;
    }
    this.#track.stop();
  }

  get #hasData(): boolean {
    return this.#chunks.some(({ size }) => size > 0);
  }
}
