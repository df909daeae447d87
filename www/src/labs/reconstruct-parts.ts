import type { ReconstructClient } from '../reconstruct/client';
import { CLOUDS, type CloudExample } from '../reconstruct/examples';
import { CLOUD_PRESETS, type CloudPreset, type CloudVariant } from '../reconstruct/presets';
import type { Cloud, ParamSpec, ParamValues } from '../reconstruct/protocol';
import type { LabState } from '../state';
import { text } from '../texts';
import { CloudOptionControls } from '../ui/cloud-options';
import { type CloudChoice, CloudSetup } from '../ui/cloud-setup';
import { h } from '../ui/dom';
import { EditTools } from '../ui/edit-tools';
import { exercises, RECONSTRUCT_EXERCISES } from '../ui/exercises';
import { ExportButtons } from '../ui/exports';
import { FigurePanel } from '../ui/figure';
import { acceptDrops, fileChooser } from '../ui/files';
import type { History } from '../ui/history';
import { KernelPlot } from '../ui/kernel-plot';
import { MeasurePanel } from '../ui/measures';
import { ParamControls } from '../ui/params';
import { PhaseList } from '../ui/phases';
import { PhotoStrip } from '../ui/photo-strip';
import { Plots } from '../ui/plots';
import { ErrorBanner, StatusLine } from '../ui/status';
import { TimingPanel } from '../ui/timing';
import { Transport, type TransportEvents } from '../ui/transport';
import { type CloudViewOptions, type Hit, ReconstructionView } from '../view/reconstruction';
import type { Photograph } from './photographs';
import { ACCEPT } from './point-files';
import { FIT_ROWS, RESIDUAL_PLOT } from './reconstruct-measures';
import { CloudPanel, layOut } from './reconstruct-page';
import { Saving } from './saving';

const INITIAL_VIEW: CloudViewOptions = {
  surface: true,
  edges: false,
  points: true,
  constraints: false,
  cameras: false,
  color: 'own',
};

export interface PartEvents extends TransportEvents {
  onFiles: (files: File[]) => void;
  onExample: (example: CloudExample) => void;
  onExampleId: (id: string) => void;
  onVariant: (preset: CloudPreset, variant: CloudVariant) => void;
  onChoice: (choice: CloudChoice, what: string) => void;
  onParam: (name: string, value: unknown) => void;
  onPick: (hit: Hit) => void;
  onTakeBack: () => void;
  onOptions: (options: CloudViewOptions) => void;
  onPhotograph: () => void;
  onDismiss: () => void;
  onSaveVolume: () => void;
  onPassOn: () => void;
  onSculpt: () => void;
  onCopyLink: () => void;
  onError: (title: string, error: unknown) => void;
}

/**
 * All controls and views of the Reconstruct lab, laid out. They display what they are given and report the user's
 * actions as events.
 */
export class ReconstructParts {
  readonly #canvas = h('canvas', {
    tabindex: 0,
    role: 'application',
    'aria-label': text('reconstruct.viewLabel'),
  });
  readonly view = new ReconstructionView(this.#canvas, INITIAL_VIEW);
  readonly status = new StatusLine();
  readonly phases = new PhaseList();
  readonly measures = new MeasurePanel(FIT_ROWS);
  readonly warning = h('p', { class: 'warning', role: 'status', 'data-warning': '' });
  readonly banner: ErrorBanner;
  readonly data: CloudPanel;
  readonly setup: CloudSetup;
  readonly options: CloudOptionControls;
  readonly photos: PhotoStrip;
  readonly tools: EditTools;
  readonly transport: Transport;
  readonly saving: Saving;
  readonly plots: Plots;
  readonly timing: TimingPanel;
  readonly csv: HTMLButtonElement;
  readonly #root: HTMLElement;
  readonly #events: PartEvents;
  readonly #figure: FigurePanel<CloudVariant, CloudPreset>;
  readonly #kernel = new KernelPlot();
  readonly #exports: ExportButtons;
  readonly #volume: HTMLButtonElement;
  readonly #extract: HTMLButtonElement;
  readonly #sculpt: HTMLButtonElement;
  readonly #paramsHolder = h('div');
  #params: ParamControls | undefined;
  #photographs: readonly Photograph[] = [];

  constructor(root: HTMLElement, history: History, client: ReconstructClient, signal: AbortSignal, events: PartEvents) {
    this.#root = root;
    this.#events = events;
    this.banner = new ErrorBanner(events.onDismiss);
    this.data = new CloudPanel(CLOUDS, CLOUD_PRESETS, fileChooser(events.onFiles, ACCEPT), events.onExample);
    this.setup = new CloudSetup(events.onChoice);
    this.tools = new EditTools((tool) => this.#setTool(tool !== 'none'), events.onTakeBack);
    this.transport = new Transport(events);
    this.plots = new Plots(history, [RESIDUAL_PLOT], false);
    this.timing = new TimingPanel(client, events.onError);
    this.#figure = new FigurePanel<CloudVariant, CloudPreset>(events.onVariant);
    this.saving = new Saving(
      (format) => client.request('export', { format }),
      (text) => this.status.say(text),
    );
    this.#exports = new ExportButtons((format, type) => {
      this.saving.mesh(format, type).catch((error) => events.onError(text('labs.saveFailed'), error));
    });
    this.options = new CloudOptionControls(INITIAL_VIEW, (options) => {
      this.view.setOptions(options);
      events.onOptions(options);
    });
    this.photos = new PhotoStrip((index) => this.#lookThrough(index));
    this.view.onLeave = () => this.photos.choose(undefined);
    this.#volume = button(text('reconstruct.saveVolume'), events.onSaveVolume, 'volume');
    this.#extract = button(text('reconstruct.openInExtract'), events.onPassOn, 'extract');
    this.#sculpt = button(text('labs.openInSculpt'), events.onSculpt, 'sculpt');
    this.csv = h(
      'button',
      { type: 'button', onclick: () => this.saving.plots(history, 'residual'), disabled: true },
      text('labs.plotData'),
    );
    this.#layOut(signal);
  }

  #layOut(signal: AbortSignal): void {
    const drop = h('div', { class: 'drop', hidden: true }, text('reconstruct.drop'));
    acceptDrops(drop, this.#events.onFiles, signal);
    layOut(this.#root, {
      data: this.data.element,
      figure: this.#figure.element,
      setup: this.setup.element,
      params: this.#paramsHolder,
      tools: this.tools.element,
      transport: this.transport.element,
      options: this.options.element,
      legend: this.view.legend.element,
      banner: this.banner.element,
      status: this.status.element,
      canvas: this.#canvas,
      photograph: this.photos.large,
      photos: this.photos.element,
      drop,
      phases: this.phases.element,
      measures: this.measures.element,
      warning: this.warning,
      exports: this.#exports.element,
      volume: this.#volume,
      extract: this.#extract,
      sculpt: this.#sculpt,
      link: button(text('labs.copyLink'), this.#events.onCopyLink, 'link'),
      plots: this.plots.element,
      kernel: this.#kernel.element,
      csv: this.csv,
      timing: this.timing.element,
      exercises: exercises(RECONSTRUCT_EXERCISES, this.#events.onExampleId),
    });
  }

  makeParams(specs: ParamSpec[]): void {
    if (this.#params) return;
    this.#params = new ParamControls(specs, [], this.#events.onParam);
    this.#paramsHolder.replaceWith(this.#params.element);
  }

  /** Shows newly opened points with their cameras and facts. */
  adopt(cloud: Cloud, photographs: Photograph[], example: CloudExample | undefined, name: string): void {
    const { points, colors, normals } = cloud;
    this.#photographs = photographs;
    this.saving.name = name.replace(/^.*\//, '');
    this.measures.unit = '';
    const cameras = photographs.map((one) => one.view);
    this.view.setCloud({ points, colors, cameras, up: example?.up ?? 'z', front: example?.front ?? 1 });
    this.options.hasCameras = photographs.length > 0;
    this.photos.show(photographs);
    this.timing.clear();
    const facts = { points: points.length / 3, colors: colors !== undefined, normals: normals !== undefined };
    this.data.show({ name, ...facts, cameras: photographs.length }, example);
  }

  clearSurface(): void {
    this.view.clearSurface();
    this.measures.clear();
    this.warning.textContent = '';
  }

  /** Shows the parameters in force; hides the constants of kernels that are not in use. */
  showParams(params: ParamValues, preset: CloudPreset | undefined, variant: CloudVariant | undefined): void {
    this.#params?.show(params);
    const isMulti = params.kernel === 'multi-order';
    this.#params?.hide({ sigma: params.kernel !== 'gaussian', delta: !isMulti, tau: !isMulti });
    this.#kernel.show(params);
    this.#figure.show(preset, variant);
  }

  refuseParam(name: string, message: string, inForce: ParamValues): void {
    this.#params?.show(inForce);
    this.#params?.showError(name, message);
  }

  showState(state: LabState, ready: boolean, surface: boolean): void {
    this.transport.showState(state, ready);
    this.#exports.enabled = surface;
    this.#volume.disabled = !surface;
    this.#extract.disabled = !surface;
    this.#sculpt.disabled = !surface;
    this.timing.enabled = ready && state !== 'loading';
  }

  dispose(): void {
    this.view.dispose();
  }

  #setTool(on: boolean): void {
    this.#root.toggleAttribute('data-placing', on);
    this.view.onPick = on ? this.#events.onPick : undefined;
  }

  #lookThrough(index: number | undefined): void {
    this.view.lookThrough(index === undefined ? undefined : this.#photographs[index]?.view, index);
    this.#events.onPhotograph();
  }
}

function button(text: string, onclick: () => void, name: string): HTMLButtonElement {
  return h('button', { type: 'button', class: 'wide', onclick, 'data-action': name }, text);
}
