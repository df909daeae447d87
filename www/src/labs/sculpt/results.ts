import { count } from '../../kit/format';
import { type History, underWay } from '../../kit/history';
import type { LabState } from '../../kit/state';
import type { LabStates } from '../../lab/states';
import { plural, text } from '../../texts';
import type { SculptClient } from './client';
import type { SculptParts } from './parts';
import type { FrameEvent, MeasuredEvent, StageKind, Support } from './protocol';

/** Smallest number of milliseconds between two updates of the plots, which take time to draw. */
const SHOW_EVERY = 250;

/** Displays the results of the Sculpt lab's worker: frames of the model, measures and plots. */
export class SculptResults {
  readonly #client: SculptClient;
  readonly #ui: SculptParts;
  readonly #states: LabStates;
  readonly #history: History;
  readonly #follow: (frame: FrameEvent) => void;
  #frame: FrameEvent | undefined;
  #shownAt = 0;
  #more: Record<string, unknown> = {};
  #support: Support = 'membrane';
  /** Whether the undeformed meshes are displayed or were requested. */
  #originals = false;
  /** Counts the scenes opened, so that the worker's replies for a previous scene are discarded. */
  #scene = 0;

  /** `follow` is called with each frame of the model when it is displayed. */
  constructor(
    client: SculptClient,
    ui: SculptParts,
    states: LabStates,
    history: History,
    follow: (frame: FrameEvent) => void,
  ) {
    this.#client = client;
    this.#ui = ui;
    this.#states = states;
    this.#history = history;
    this.#follow = follow;
  }

  /** Support of the surface. One that holds itself is no detail on a base: it has no bands, nor does a normal miss it. */
  set support(support: Support) {
    if (support !== this.#support) this.#more = {};
    this.#support = support;
  }

  /** Clears all results, for another scene. */
  clear(): void {
    this.#scene += 1;
    this.#frame = undefined;
    this.#originals = false;
    this.#more = {};
    this.#ui.carrier.clear();
    this.#ui.latency.clear();
    this.#ui.measures.clear();
    this.startOver();
  }

  /** Clears the history of steps, for a new run of the same scene. */
  startOver(): void {
    this.#history.clear();
    this.#showHistory();
  }

  /** Displays a frame of the model at the browser's next animation frame; only then does the worker continue. */
  take(frame: FrameEvent): void {
    this.#history.add(frame.reports);
    if (this.#states.value === 'running') this.#ui.page.status.report(() => underWay(this.#history));
    const isPending = this.#frame !== undefined;
    this.#frame = frame;
    if (!isPending) this.#ui.view.change(() => this.#showPending());
  }

  #showPending(): void {
    const frame = this.#frame;
    if (!frame) return;
    this.#frame = undefined;
    this.#show(frame);
    this.#client.post({ kind: 'shown', serial: frame.serial });
  }

  /** Displays measures, after the frame they belong to; the state that follows them thus finds both displayed. */
  measured({ measures, facts }: MeasuredEvent): void {
    this.#showPending();
    const { bands, folded, missed, ...others } = facts;
    Object.assign(this.#more, others, this.#support === 'membrane' && { bands, folded, missed });
    this.#ui.measures.showMeasures(measures);
    this.#ui.measures.extra.value = this.#more;
  }

  showState(state: LabState): void {
    if (state === 'paused' || state === 'done') this.#ui.carrier.stop();
    this.#showHistory();
    this.#ui.page.status.say(this.describe(state));
  }

  /** Returns the text for the status line in a state of the lab. */
  describe(state: LabState): string {
    const last = this.#history.reports.at(-1);
    if (state === 'running') return text('labs.running');
    if (!last) return text('labs.ready');
    const { vertices, components, residual, tolerance } = last;
    const what = text('labs.surfaceSize', {
      vertices: plural('counts.vertex', vertices),
      components: plural('counts.component', components),
    });
    if (state !== 'done') return text('sculpt.pausedAt', { iteration: count(last.iteration), surface: what });
    return text(residual > tolerance ? 'sculpt.notConverged' : 'sculpt.converged', { surface: what });
  }

  /** Requests and displays the undeformed meshes, if the layout of the view includes them. */
  showOriginals(): void {
    if (this.#originals || this.#ui.options.value.layout !== 'row' || !this.#states.ready) return;
    this.#originals = true;
    const scene = this.#scene;
    this.#client.request('originals', undefined).then(
      ({ base, detail }) => {
        if (scene !== this.#scene) return;
        this.#ui.view.show('S0', base);
        this.#ui.view.show('S1', detail ?? base);
      },
      (error) => this.#states.fail(text('sculpt.originalsFailed'), error),
    );
  }

  /**
   * Requests and displays the stages of restructuring shown in a figure of the paper, for which the worker needs no
   * model.
   */
  showStages(kind: StageKind): void {
    const scene = this.#scene;
    this.#client.request('stages', kind).then(
      (stages) => {
        if (scene === this.#scene) this.#ui.view.showStages(stages);
      },
      (error) => this.#states.fail(text('sculpt.stagesFailed'), error),
    );
  }

  #show(frame: FrameEvent): void {
    const { view, carrier, measures, isPreview } = this.#ui;
    view.show('S1dash', frame.result);
    view.show('S0dash', frame.base);
    carrier.frameShown(frame);
    view.show('T', frame.link);
    if (frame.levels) view.showStages(frame.levels);
    isPreview.value = frame.preview;
    this.#follow(frame);
    this.#showLatency(frame.poseId);
    this.#more.frameMs = frame.durationMs;
    const last = frame.reports.at(-1);
    if (last) measures.showReport({ ...last, vertices: frame.result.vertices, triangles: frame.result.triangles });
    measures.extra.value = this.#more;
    if (performance.now() - this.#shownAt > SHOW_EVERY) this.#showHistory();
  }

  #showLatency(poseId: number): void {
    const { latency } = this.#ui;
    if (!latency.frameDrawn(poseId, performance.now()) || !latency.last) return;
    if (latency.displayMs !== undefined) this.#more.alongMs = Math.round(latency.displayMs);
    this.#more.answerMs = Math.round(latency.last.milliseconds);
    this.#more.answerFrames = latency.last.frames;
  }

  #showHistory(): void {
    this.#shownAt = performance.now();
    const last = this.#history.reports.at(-1);
    this.#ui.run.transport.showReport(last);
    this.#ui.page.warnings.showReport(last);
    this.#ui.plots.update();
    this.#ui.run.hasPlots.value = this.#history.reports.length > 0;
  }
}
