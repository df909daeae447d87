import type { Texture } from 'three';
import type { Warning } from '../../engine/warnings';
import { fileChooser } from '../../importers/files';
import { h, section } from '../../kit/dom';
import { FigurePanel } from '../../kit/figure';
import type { History } from '../../kit/history';
import { MeasurePanel } from '../../kit/measures';
import { Plots } from '../../kit/plots';
import type { LabState } from '../../kit/state';
import { initialOptions } from '../../kit/view';
import { OptionControls } from '../../kit/view-options';
import { LabPage } from '../../lab/page';
import { RunControls, type RunEvents } from '../../lab/run-controls';
import { text } from '../../texts';
import { SurfaceCarrier } from './carrier';
import type { SculptClient } from './client';
import { DragLatency } from './drag-latency';
import type { SculptExample } from './examples';
import { SCULPT_PLOTS, SCULPT_ROWS } from './measures';
import { ACCEPT } from './mesh-files';
import { factsOf, sceneData } from './page';
import { EllipsoidControls, type EllipsoidEvents } from './panels/ellipsoids';
import { FilmControls, type FilmEvents } from './panels/film';
import { offerLayouts, offerTexture } from './panels/options';
import { SupportControl } from './panels/support';
import { pictureOf } from './picture';
import { posesOf, type SculptPreset, type SculptVariant } from './presets';
import type { MeshTexture, OpenedScene, ParamValues, Support } from './protocol';
import { SculptureView } from './scene';
import { SCULPT_VIEW, type SculptViewOptions } from './view';

/** Parameters that have an effect on a membrane alone. */
const OF_MEMBRANES = ['levels', 'refineFactor', 'smoothing', 'distribute', 'supersample', 'energy', 'topology'];

export interface PartEvents extends RunEvents<SculptExample>, EllipsoidEvents, FilmEvents {
  onVariant: (preset: SculptPreset, variant: SculptVariant) => void;
  onSupport: (support: Support) => void;
  onOptions: (options: SculptViewOptions) => void;
}

/** Controls and views of the Sculpt lab. */
export class SculptParts {
  readonly page: LabPage<SculptExample>;
  readonly run: RunControls;

  readonly view: SculptureView;
  readonly carrier: SurfaceCarrier;
  readonly latency = new DragLatency();
  readonly measures = new MeasurePanel(SCULPT_ROWS);
  readonly previewNote = h('p', { class: 'coarse', hidden: true }, text('sculpt.coarsePreview'));
  readonly options: OptionControls<typeof SCULPT_VIEW>;
  readonly ellipsoids: EllipsoidControls;
  readonly film: FilmControls;
  readonly support: SupportControl;
  readonly plots: Plots;
  readonly #onError: PartEvents['onError'];
  readonly #figure: FigurePanel<SculptVariant, SculptPreset>;
  readonly #captions = h('div', { class: 'captions', hidden: true });
  /** Counts textures, so that one that is still being decoded does not replace a newer one. */
  #pictures = 0;
  #texture: Texture | undefined;

  constructor(root: HTMLElement, history: History, client: SculptClient, signal: AbortSignal, events: PartEvents) {
    this.page = new LabPage(root, signal, events, {
      viewLabel: text('sculpt.viewLabel'),
      drop: text('sculpt.drop'),
      admission: 'any',
      data: sceneData(fileChooser(events.onFiles, ACCEPT, undefined, 'any'), events.onExample),
    });
    this.run = new RunControls(this.page, events, {
      history,
      fetchMesh: (request) => client.request('export', request),
      residual: 'unrest',
    });
    this.view = new SculptureView(this.page.canvas, initialOptions(SCULPT_VIEW));
    this.carrier = new SurfaceCarrier(this.view);
    this.#onError = events.onError;
    this.#figure = new FigurePanel<SculptVariant, SculptPreset>(events.onVariant);
    this.ellipsoids = new EllipsoidControls(events);
    this.film = new FilmControls(events);
    this.support = new SupportControl(events.onSupport);
    this.plots = new Plots(history, SCULPT_PLOTS, true);
    this.options = new OptionControls(SCULPT_VIEW, (options) => {
      this.view.setOptions(options);
      events.onOptions(options);
    });
    this.view.onCaptions = (captions) => this.#showCaptions(captions);
    this.page.layOut({
      name: 'sculpt',
      options: this.options.element,
      over: [this.view.legend.element, this.view.editing.legend.element, this.previewNote, this.#captions],
      stage: (view, status) => [view, this.run.transport.element, status],
      setup: [
        section(text('sculpt.sectionScene'), this.page.data.element, this.support.element, this.#figure.element),
        section(text('sculpt.sectionEllipsoids'), this.ellipsoids.element),
        section(text('sculpt.sectionFilm'), this.film.element),
        this.page.paramsSection(),
      ],
      results: [
        section(text('labs.sectionSurface'), this.page.warnings.element, this.measures.element),
        this.run.saveSection(this.view.subject),
        ...this.run.finishSections(this.view.editing, this.measures),
        section(text('labs.sectionPlots'), this.plots.element, this.run.csv),
      ],
    });
  }

  /** Shows a newly opened scene: meshes with their texture, ellipsoids and facts, and warnings `known` before. */
  adopt(
    { box, start, pose, detail, bands, hasChoice, buildMs, texture, warnings }: OpenedScene,
    example: SculptExample | undefined,
    name: string,
    known: readonly Warning[] = [],
  ): void {
    this.page.saving.name = example?.id ?? name;
    this.page.warnings.showData(known, warnings);
    this.measures.unit = '';
    this.support.hasChoice = hasChoice;
    this.view.setScene(box, example?.up ?? 'y', start, [pose, ...posesOf(example)]);
    this.#showTexture(texture);
    this.page.data.show(factsOf({ name, detail, bands, buildMs }), example);
  }

  /** Decodes and shows a texture. If that fails, the surface stays without one. */
  #showTexture(texture: MeshTexture | undefined): void {
    this.#pictures += 1;
    const turn = this.#pictures;
    this.view.texture = null;
    this.#texture?.dispose();
    this.#texture = undefined;
    offerTexture(this.options, texture !== undefined);
    if (!texture) return;
    pictureOf(texture).then(
      (picture) => {
        if (turn !== this.#pictures) return;
        this.#texture = picture;
        this.view.texture = picture;
      },
      (error) => this.#onError(text('sculpt.textureFailed'), error),
    );
  }

  showSupport(support: Support): void {
    this.support.show(support);
    offerLayouts(this.options, support === 'membrane');
    this.page.hideParams(Object.fromEntries(OF_MEMBRANES.map((name) => [name, support === 'surface'])));
  }

  showParams(params: ParamValues, preset: SculptPreset | undefined, variant: SculptVariant | undefined): void {
    this.page.showParams(params);
    this.#figure.show(preset, variant);
  }

  /**
   * Enables and disables controls according to the lab's state; `canPlay`: whether there is a film, which can be played
   * even when the model has converged.
   */
  showState(state: LabState, beneath: LabState, ready: boolean, canPlay: boolean): void {
    const idle = this.run.showState(state, beneath === 'done' && canPlay ? 'paused' : beneath, ready);
    // Saving pauses a run, which would then not go on to the same pose.
    this.page.session.enabled = idle && beneath !== 'running';
  }

  dispose(): void {
    this.run.dispose();
    this.#texture?.dispose();
    this.view.dispose();
  }

  #showCaptions(captions: string[]): void {
    this.#captions.hidden = captions.length === 0;
    this.#captions.replaceChildren(...captions.map((caption) => h('span', {}, caption)));
  }
}
