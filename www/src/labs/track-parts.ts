import type { MeshFormat } from '../protocol';
import type { LabState } from '../state';
import { text } from '../texts';
import type { VoxelBox } from '../track/box';
import type { TrackClient } from '../track/client';
import { IMAGES, type TrackExample } from '../track/examples';
import { TRACK_PRESETS, type TrackPreset, type TrackVariant } from '../track/presets';
import type { Alternative, OpenedImage, ParamSpec, ParamValues, Preparation, Vec3 } from '../track/protocol';
import { h } from '../ui/dom';
import { EdgeThreshold } from '../ui/edge-threshold';
import { exercises, TRACK_EXERCISES } from '../ui/exercises';
import { ExportButtons } from '../ui/exports';
import { FigurePanel } from '../ui/figure';
import { FigureRow } from '../ui/figure-row';
import { acceptDrops, fileChooser } from '../ui/files';
import { FrameBar } from '../ui/frame-bar';
import { FrameTable } from '../ui/frame-table';
import { MeasurePanel } from '../ui/measures';
import { ParamControls } from '../ui/params';
import { PreparationControls } from '../ui/preparation';
import { RegionControls, type RegionEvents } from '../ui/region';
import { ErrorBanner, StatusLine } from '../ui/status';
import { TrackComparePanel } from '../ui/track-compare';
import { TrackOptionControls } from '../ui/track-options';
import { Transport, type TransportEvents } from '../ui/transport';
import { VolumeCurve } from '../ui/volume-curve';
import { TrackView, type TrackViewOptions } from '../view/track';
import { Saving } from './saving';
import { TRACK_ROWS } from './track-measures';
import { ImagePanel, layOut } from './track-page';

export const INITIAL_VIEW: TrackViewOptions = {
  surface: true,
  edges: false,
  votes: 'none',
  region: true,
  slices: 'walls',
  below: 'slices',
};

export interface PartEvents extends TransportEvents, RegionEvents {
  onFiles: (files: File[]) => void;
  onExample: (example: TrackExample) => void;
  onExampleId: (id: string) => void;
  onVariant: (preset: TrackPreset, variant: TrackVariant) => void;
  onPreparation: (preparation: Preparation, what: string) => void;
  onParam: (name: string, value: unknown) => void;
  onOptions: (options: TrackViewOptions) => void;
  onFrame: (frame: number) => void;
  onMoved: () => void;
  onCompare: (other: Alternative) => void;
  onCancelCompare: () => void;
  onSave: (what: 'frames' | 'animation' | 'table') => void;
  onSculpt: () => void;
  onCancel: () => void;
  onDismiss: () => void;
  onCopyLink: () => void;
  onError: (title: string, error: unknown) => void;
}

/**
 * All controls and views of the Track lab, laid out. They display what they are given and report the user's actions as
 * events.
 */
export class TrackParts {
  readonly #canvas = h('canvas', {
    tabindex: 0,
    role: 'application',
    'aria-label': text('track.viewLabel'),
  });
  readonly #slices = h('div', { class: 'slices' });
  readonly view = new TrackView(this.#canvas, this.#slices, INITIAL_VIEW);
  readonly status = new StatusLine();
  readonly measures = new MeasurePanel(TRACK_ROWS);
  readonly table = new FrameTable();
  readonly banner: ErrorBanner;
  readonly data: ImagePanel;
  readonly options: TrackOptionControls;
  readonly preparation: PreparationControls;
  readonly region: RegionControls;
  readonly transport: Transport;
  readonly frames: FrameBar;
  readonly curve: VolumeCurve;
  readonly stills: FigureRow;
  readonly compare: TrackComparePanel;
  readonly saving: Saving;
  readonly #root: HTMLElement;
  readonly #events: PartEvents;
  readonly #figure: FigurePanel<TrackVariant, TrackPreset>;
  readonly #exports: ExportButtons;
  readonly #saves: HTMLButtonElement[];
  readonly #sculpt: HTMLButtonElement;
  readonly #cancel: HTMLButtonElement;
  readonly #paramsHolder = h('div');
  readonly #thresholdHolder = h('div');
  #params: ParamControls | undefined;
  #threshold: EdgeThreshold | undefined;
  /**
   * Half width k, in voxels, of the windows in which the tracker finds the boundary; the preview of an edge threshold
   * uses it.
   */
  #window = 2;

  constructor(root: HTMLElement, client: TrackClient, signal: AbortSignal, events: PartEvents) {
    this.#root = root;
    this.#events = events;
    this.banner = new ErrorBanner(events.onDismiss);
    this.data = new ImagePanel(IMAGES, TRACK_PRESETS, fileChooser(events.onFiles), events.onExample);
    this.#figure = new FigurePanel<TrackVariant, TrackPreset>(events.onVariant);
    this.preparation = new PreparationControls(events.onPreparation);
    this.region = new RegionControls(events);
    this.transport = new Transport(events);
    this.frames = new FrameBar(events.onFrame);
    this.curve = new VolumeCurve((frame) => {
      this.frames.stop();
      events.onFrame(frame);
    });
    this.stills = new FigureRow(
      (voxel: Vec3) => this.view.goToVoxel(voxel),
      (frame) => {
        this.frames.stop();
        events.onFrame(frame);
      },
    );
    this.compare = new TrackComparePanel({ onStart: events.onCompare, onCancel: events.onCancelCompare });
    this.saving = new Saving(
      (format) => client.request('export', { frame: this.frames.frame, format }),
      (text) => this.status.say(text),
    );
    this.#exports = new ExportButtons((format, type) => this.#saveMesh(format, type));
    this.#saves = [
      button(text('track.saveFrames'), () => events.onSave('frames'), 'save-frames'),
      button(text('track.saveAnimation'), () => events.onSave('animation'), 'save-animation'),
      button(text('track.saveTable'), () => events.onSave('table'), 'save-table'),
    ];
    this.#sculpt = button(text('labs.openInSculpt'), events.onSculpt, 'sculpt');
    this.options = new TrackOptionControls(INITIAL_VIEW, (options) => {
      this.view.setOptions(options);
      this.#slices.hidden = options.below !== 'slices';
      this.stills.below = options.below;
      events.onOptions(options);
    });
    this.#cancel = h(
      'button',
      { type: 'button', hidden: true, 'data-action': 'cancel', onclick: events.onCancel },
      text('labs.cancel'),
    );
    this.view.onRegion = (region: VoxelBox) => events.onRegion(region);
    this.view.onMoved = events.onMoved;
    this.#layOut(signal);
  }

  #layOut(signal: AbortSignal): void {
    const drop = h('div', { class: 'drop', hidden: true }, text('track.drop'));
    acceptDrops(drop, this.#events.onFiles, signal);
    layOut(this.#root, {
      data: this.data.element,
      figure: this.#figure.element,
      preparation: this.preparation.element,
      region: this.region.element,
      threshold: this.#thresholdHolder,
      params: this.#paramsHolder,
      transport: this.transport.element,
      frames: this.frames.element,
      cancel: this.#cancel,
      options: this.options.element,
      banner: this.banner.element,
      status: this.status.element,
      canvas: this.#canvas,
      slices: this.#slices,
      stills: this.stills.element,
      drop,
      measures: this.measures.element,
      warnings: this.table.warnings,
      curve: this.curve.element,
      table: this.table.element,
      compare: this.compare.element,
      exports: this.#exports.element,
      saves: h('div', {}, ...this.#saves, this.#sculpt),
      link: button(text('labs.copyLink'), this.#events.onCopyLink, 'link'),
      exercises: exercises(TRACK_EXERCISES, this.#events.onExampleId),
    });
  }

  makeParams(specs: ParamSpec[]): void {
    if (this.#params) return;
    const { onParam } = this.#events;
    this.#params = new ParamControls(specs, ['threshold'], onParam);
    this.#paramsHolder.replaceWith(this.#params.element);
    const threshold = specs.find(({ name }) => name === 'threshold');
    if (!threshold) return;
    this.#threshold = new EdgeThreshold(
      threshold,
      (value) => onParam('threshold', value),
      (value) => this.view.preview(value, this.#window),
    );
    this.#thresholdHolder.replaceWith(this.#threshold.element);
  }

  /** Shows the facts about a newly opened image. */
  adopt(opened: OpenedImage, example: TrackExample | undefined, name: string): void {
    this.saving.name = (example?.id ?? name).replace(/^.*\//, '');
    this.measures.unit = example?.unit ?? 'mm';
    this.data.show(opened, example, name);
  }

  labelOf(param: string): string {
    return this.#params?.labelOf(param) ?? param;
  }

  showParams(params: ParamValues, noise: number, suggested: number, most: number): void {
    this.#window = Number(params.window);
    this.#params?.show(params);
    this.#threshold?.show(Number(params.threshold), noise, suggested, most);
  }

  showFigure(preset: TrackPreset | undefined, variant: TrackVariant | undefined): void {
    this.#figure.show(preset, variant);
  }

  refuseParam(name: string, message: string): void {
    if (name === 'threshold') this.#threshold?.showError(message);
    else this.#params?.showError(name, message);
  }

  /**
   * Enables and disables controls according to the lab's state. `ready`: whether there is a tracker; `tracked`: number
   * of frames with a surface; `here`: whether the displayed frame has one.
   */
  showState(state: LabState, ready: boolean, tracked: number, here: boolean): void {
    this.transport.showState(state, ready);
    const idle = ready && state !== 'loading';
    this.#exports.enabled = idle && here;
    this.#sculpt.disabled = !idle || !here;
    for (const save of this.#saves) save.disabled = !idle || tracked === 0;
    this.compare.enabled = idle && state === 'done';
    this.#cancel.hidden = state !== 'loading' || !ready;
  }

  dispose(): void {
    this.frames.stop();
    this.view.dispose();
  }

  #saveMesh(format: MeshFormat, type: string): void {
    this.saving
      .mesh(format, type, `-${this.frames.frame + 1}`)
      .catch((error) => this.#events.onError(text('labs.saveFailed'), error));
  }
}

function button(text: string, onclick: () => void, name: string): HTMLButtonElement {
  return h('button', { type: 'button', class: 'wide', onclick, 'data-action': name }, text);
}
