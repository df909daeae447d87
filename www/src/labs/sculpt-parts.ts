import type { Texture } from 'three';
import type { SculptClient } from '../sculpt/client';
import { SCENES, type SculptExample } from '../sculpt/examples';
import { posesOf, SCULPT_PRESETS, type SculptPreset, type SculptVariant } from '../sculpt/presets';
import type { MeshTexture, OpenedScene, ParamSpec, ParamValues } from '../sculpt/protocol';
import type { LabState } from '../state';
import { text } from '../texts';
import { h } from '../ui/dom';
import { EllipsoidControls, type EllipsoidEvents } from '../ui/ellipsoids';
import { exercises, SCULPT_EXERCISES } from '../ui/exercises';
import { ExportButtons } from '../ui/exports';
import { FigurePanel } from '../ui/figure';
import { acceptDrops, fileChooser } from '../ui/files';
import { FilmControls, type FilmEvents } from '../ui/film';
import type { History } from '../ui/history';
import { MeasurePanel } from '../ui/measures';
import { ParamControls } from '../ui/params';
import { Plots } from '../ui/plots';
import { SculptOptionControls } from '../ui/sculpt-options';
import { ErrorBanner, StatusLine } from '../ui/status';
import { Transport, type TransportEvents } from '../ui/transport';
import { pictureOf } from '../view/picture';
import { SculptureView, type SculptViewOptions } from '../view/sculpture';
import { DragLatency } from './drag-latency';
import { ACCEPT } from './mesh-files';
import { Saving } from './saving';
import { SurfaceCarrier } from './sculpt-carrier';
import { SCULPT_PLOTS, SCULPT_ROWS } from './sculpt-measures';
import { layOut, ScenePanel } from './sculpt-page';

const INITIAL_VIEW: SculptViewOptions = { layout: 'result', edges: false, ellipsoids: true, color: 'plain' };

export interface PartEvents extends TransportEvents, EllipsoidEvents, FilmEvents {
  onFiles: (files: File[]) => void;
  onExample: (example: SculptExample) => void;
  onExampleId: (id: string) => void;
  onVariant: (preset: SculptPreset, variant: SculptVariant) => void;
  onParam: (name: string, value: unknown) => void;
  onOptions: (options: SculptViewOptions) => void;
  onCancel: () => void;
  onDismiss: () => void;
  onCopyLink: () => void;
  onError: (title: string, error: unknown) => void;
}

/**
 * All controls and views of the Sculpt lab, laid out. They display what they are given and report the user's actions as
 * events.
 */
export class SculptParts {
  readonly #canvas = h('canvas', {
    tabindex: 0,
    role: 'application',
    'aria-label': text('sculpt.viewLabel'),
  });
  readonly view = new SculptureView(this.#canvas, INITIAL_VIEW);
  readonly carrier = new SurfaceCarrier(this.view);
  readonly latency = new DragLatency();
  readonly status = new StatusLine();
  readonly measures = new MeasurePanel(SCULPT_ROWS);
  readonly previewNote = h('p', { class: 'coarse', hidden: true }, text('sculpt.coarsePreview'));
  readonly banner: ErrorBanner;
  readonly data: ScenePanel;
  readonly options: SculptOptionControls;
  readonly ellipsoids: EllipsoidControls;
  readonly film: FilmControls;
  readonly transport: Transport;
  readonly saving: Saving;
  readonly plots: Plots;
  readonly csv: HTMLButtonElement;
  readonly #root: HTMLElement;
  readonly #events: PartEvents;
  readonly #figure: FigurePanel<SculptVariant, SculptPreset>;
  readonly #exports: ExportButtons;
  readonly #captions = h('div', { class: 'captions', hidden: true });
  readonly #cancel: HTMLButtonElement;
  readonly #paramsHolder = h('div');
  #params: ParamControls | undefined;
  /** Counts textures, so that one that is still being decoded does not replace a newer one. */
  #pictures = 0;
  #texture: Texture | undefined;

  constructor(root: HTMLElement, history: History, client: SculptClient, signal: AbortSignal, events: PartEvents) {
    this.#root = root;
    this.#events = events;
    this.banner = new ErrorBanner(events.onDismiss);
    this.data = new ScenePanel(SCENES, SCULPT_PRESETS, fileChooser(events.onFiles, ACCEPT), events.onExample);
    this.#figure = new FigurePanel<SculptVariant, SculptPreset>(events.onVariant);
    this.ellipsoids = new EllipsoidControls(events);
    this.film = new FilmControls(events);
    this.transport = new Transport(events);
    this.plots = new Plots(history, SCULPT_PLOTS, true);
    this.saving = new Saving(
      (format) => client.request('export', { format }),
      (text) => this.status.say(text),
    );
    this.#exports = new ExportButtons((format, type) => {
      this.saving.mesh(format, type).catch((error) => events.onError(text('labs.saveFailed'), error));
    });
    this.options = new SculptOptionControls(INITIAL_VIEW, (options) => {
      this.view.setOptions(options);
      events.onOptions(options);
    });
    this.view.onCaptions = (captions) => this.#showCaptions(captions);
    this.#cancel = h(
      'button',
      { type: 'button', hidden: true, 'data-action': 'cancel', onclick: events.onCancel },
      text('labs.cancel'),
    );
    this.csv = h(
      'button',
      { type: 'button', onclick: () => this.saving.plots(history, 'unrest'), disabled: true },
      text('labs.plotData'),
    );
    this.#layOut(signal);
  }

  #layOut(signal: AbortSignal): void {
    const drop = h('div', { class: 'drop', hidden: true }, text('sculpt.drop'));
    acceptDrops(drop, this.#events.onFiles, signal);
    layOut(this.#root, {
      data: this.data.element,
      figure: this.#figure.element,
      ellipsoids: this.ellipsoids.element,
      film: this.film.element,
      params: this.#paramsHolder,
      transport: this.transport.element,
      cancel: this.#cancel,
      options: this.options.element,
      legend: this.view.legend.element,
      coarse: this.previewNote,
      captions: this.#captions,
      banner: this.banner.element,
      status: this.status.element,
      canvas: this.#canvas,
      drop,
      measures: this.measures.element,
      exports: this.#exports.element,
      link: button(text('labs.copyLink'), this.#events.onCopyLink, 'link'),
      plots: this.plots.element,
      csv: this.csv,
      exercises: exercises(SCULPT_EXERCISES, this.#events.onExampleId),
    });
  }

  makeParams(specs: ParamSpec[]): void {
    if (this.#params) return;
    this.#params = new ParamControls(specs, [], this.#events.onParam);
    this.#paramsHolder.replaceWith(this.#params.element);
  }

  /** Shows a newly opened scene: meshes with their texture, ellipsoids and facts. */
  adopt(
    { box, start, pose, detail, bands, buildMs, texture }: OpenedScene,
    example: SculptExample | undefined,
    name: string,
  ): void {
    this.saving.name = (example?.id ?? name).replace(/^.*\//, '');
    this.measures.unit = '';
    this.view.setScene(box, example?.up ?? 'y', start, [pose, ...posesOf(example)]);
    this.#showTexture(texture);
    this.data.show({ name, detail, bands, made: buildMs }, example);
  }

  /** Decodes and shows a texture. If that fails, the surface stays without one. */
  #showTexture(texture: MeshTexture | undefined): void {
    this.#pictures += 1;
    const turn = this.#pictures;
    this.view.texture = null;
    this.#texture?.dispose();
    this.#texture = undefined;
    this.options.textured = texture !== undefined;
    if (!texture) return;
    pictureOf(texture).then(
      (picture) => {
        if (turn !== this.#pictures) return;
        this.#texture = picture;
        this.view.texture = picture;
      },
      (error) => this.#events.onError(text('sculpt.textureFailed'), error),
    );
  }

  labelOf(param: string): string {
    return this.#params?.labelOf(param) ?? param;
  }

  showParams(params: ParamValues, preset: SculptPreset | undefined, variant: SculptVariant | undefined): void {
    this.#params?.show(params);
    this.#figure.show(preset, variant);
  }

  refuseParam(name: string, message: string, inForce: ParamValues): void {
    this.#params?.show(inForce);
    this.#params?.showError(name, message);
  }

  /**
   * Enables and disables controls according to the lab's state. `ready`: whether there is a model; `canPlay`: whether
   * there is a film, which can be played even when the model has converged.
   */
  showState(state: LabState, ready: boolean, canPlay: boolean): void {
    this.transport.showState(state === 'done' && canPlay ? 'paused' : state, ready);
    this.#exports.enabled = ready && state !== 'loading';
    this.#cancel.hidden = state !== 'loading' || !ready;
  }

  dispose(): void {
    this.#texture?.dispose();
    this.view.dispose();
  }

  #showCaptions(captions: string[]): void {
    this.#captions.hidden = captions.length === 0;
    this.#captions.replaceChildren(...captions.map((caption) => h('span', {}, caption)));
  }
}

function button(text: string, onclick: () => void, name: string): HTMLButtonElement {
  return h('button', { type: 'button', class: 'wide', onclick, 'data-action': name }, text);
}
