import { EXAMPLES, type Example } from '../examples';
import { COVERAGE_GUIDE } from '../guides';
import { isPreset, PRESETS, type Preset, type Variant, variantInForce } from '../presets';
import type { Attractor, LargeSource, MeshFormat, ParamSpec, ParamValues, Plane, VolumeView } from '../protocol';
import type { LabState } from '../state';
import { text } from '../texts';
import { AttractorControls } from '../ui/attractors';
import { ComparePanel } from '../ui/compare';
import { CoveragePanel } from '../ui/coverage';
import { h } from '../ui/dom';
import { EXTRACT_EXERCISES, exercises } from '../ui/exercises';
import { ExportButtons } from '../ui/exports';
import { FigurePanel } from '../ui/figure';
import { acceptDrops, fileChooser, VOLUME_FILES } from '../ui/files';
import { Histogram } from '../ui/histogram';
import type { History } from '../ui/history';
import { LargeSourceControls } from '../ui/large-source';
import { EventLog } from '../ui/log';
import { MeasurePanel } from '../ui/measures';
import { ParamControls } from '../ui/params';
import { ENERGY_PLOTS, Plots } from '../ui/plots';
import { PyramidPanel } from '../ui/pyramid';
import { StartControls } from '../ui/start';
import { ErrorBanner, StatusLine } from '../ui/status';
import { TimeTable } from '../ui/times';
import { Transport, type TransportEvents } from '../ui/transport';
import { ViewOptionControls, type ViewOptions } from '../ui/view-options';
import { Stage } from '../view/stage';
import type { ExtractSource } from './extract-opening';
import { DataPanel, folded, layOut } from './extract-page';
import { Saving } from './saving';

const INITIAL_VIEW: ViewOptions = { surface: true, edges: false, color: 'plain', slices: 'walls' };

export interface PartEvents extends TransportEvents {
  onFiles: (files: File[]) => void;
  onLarge: (name: string, source: LargeSource) => void;
  onExample: (example: Example) => void;
  onExampleId: (id: string) => void;
  onVariant: (preset: Preset, variant: Variant) => void;
  onStart: () => void;
  onParam: (name: string, value: unknown) => void;
  onAttractors: (attractors: Attractor[], what: string, tuning: boolean) => void;
  onOptions: (options: ViewOptions) => void;
  onPlanes: (planes: Plane[]) => void;
  onCompare: () => void;
  onCancelCompare: () => void;
  onCoverage: () => void;
  onCancelCoverage: () => void;
  onSeed: () => void;
  onSculpt: () => void;
  onCancel: () => void;
  onDismiss: () => void;
  onCopyLink: () => void;
  onError: (title: string, error: unknown) => void;
}

/**
 * All controls and views of the Extract lab, laid out. They display what they are given and report the user's actions
 * as events.
 */
export class ExtractParts {
  readonly #canvas = h('canvas', {
    tabindex: 0,
    role: 'application',
    'aria-label': text('extract.viewLabel'),
  });
  readonly #slices = h('div', { class: 'slices' });
  readonly stage: Stage;
  readonly status = new StatusLine();
  readonly measures = new MeasurePanel();
  readonly banner: ErrorBanner;
  readonly data: DataPanel;
  readonly large: LargeSourceControls;
  readonly histogram: Histogram;
  readonly start: StartControls;
  readonly pyramid: PyramidPanel;
  readonly attractors: AttractorControls;
  readonly options: ViewOptionControls;
  readonly transport: Transport;
  readonly compare: ComparePanel;
  readonly coverage: CoveragePanel;
  readonly saving: Saving;
  readonly #root: HTMLElement;
  readonly #history: History;
  readonly #events: PartEvents;
  readonly #figure: FigurePanel<Variant, Preset>;
  readonly #exports: ExportButtons;
  readonly #sculpt: HTMLButtonElement;
  readonly #cancel: HTMLButtonElement;
  readonly #csv: HTMLButtonElement;
  readonly #plots: Plots;
  readonly #times = new TimeTable();
  readonly #log = new EventLog();
  readonly #compareHolder: HTMLDetailsElement;
  readonly #paramsHolder = h('div');
  #params: ParamControls | undefined;

  constructor(
    root: HTMLElement,
    history: History,
    fetchMesh: (format: MeshFormat) => Promise<Uint8Array>,
    signal: AbortSignal,
    events: PartEvents,
  ) {
    this.#root = root;
    this.#history = history;
    this.#events = events;
    this.stage = new Stage(this.#canvas, this.#slices, INITIAL_VIEW, events.onPlanes);
    this.banner = new ErrorBanner(events.onDismiss);
    const chooser = fileChooser(events.onFiles, `${VOLUME_FILES},.zip`);
    this.large = new LargeSourceControls(events.onLarge);
    this.data = new DataPanel(EXAMPLES, PRESETS, chooser, this.large.element, events.onExample);
    this.#figure = new FigurePanel<Variant, Preset>(events.onVariant);
    this.histogram = new Histogram((iso) => events.onParam('iso', iso));
    this.start = new StartControls(events.onStart);
    this.pyramid = new PyramidPanel(
      (level) => this.stage.thumbnail(level),
      (level) => this.stage.showLevel(level),
    );
    this.stage.onMoved = () => this.pyramid.redraw();
    this.attractors = new AttractorControls({
      onChange: events.onAttractors,
      onPlacing: (placing) => this.#setPlacing(placing),
      onGoTo: (point) => this.stage.goTo(point),
      crosshair: () => this.stage.crosshair,
    });
    this.options = new ViewOptionControls(INITIAL_VIEW, (options) => {
      this.stage.setOptions(options);
      events.onOptions(options);
    });
    this.transport = new Transport(events);
    this.compare = new ComparePanel({ onStart: events.onCompare, onCancel: events.onCancelCompare });
    this.coverage = new CoveragePanel(COVERAGE_GUIDE, {
      onStart: events.onCoverage,
      onCancel: events.onCancelCoverage,
      onSeed: events.onSeed,
      onGoTo: (point) => this.stage.lookAt(point),
      onMark: (parts) => this.stage.showUncovered(parts),
    });
    this.#compareHolder = folded(text('extract.sectionCompare'), this.compare.element);
    this.saving = new Saving(fetchMesh, (text) => this.status.say(text));
    this.#exports = new ExportButtons((format, type) => {
      this.saving.mesh(format, type).catch((error) => events.onError(text('labs.saveFailed'), error));
    });
    this.#sculpt = h(
      'button',
      { type: 'button', class: 'wide', 'data-action': 'sculpt', onclick: events.onSculpt },
      text('labs.openInSculpt'),
    );
    this.#cancel = h(
      'button',
      { type: 'button', hidden: true, 'data-action': 'cancel', onclick: events.onCancel },
      text('labs.cancel'),
    );
    this.#plots = new Plots(history, ENERGY_PLOTS, true);
    this.#csv = h(
      'button',
      { type: 'button', onclick: () => this.saving.plots(history), disabled: true },
      text('labs.plotData'),
    );
    this.#layOut(signal);
  }

  #layOut(signal: AbortSignal): void {
    const drop = h('div', { class: 'drop', hidden: true }, text('extract.drop'));
    acceptDrops(drop, this.#events.onFiles, signal, (folder) => this.#events.onLarge(folder.name, { zarr: folder }));
    layOut(this.#root, {
      data: this.data.element,
      figure: this.#figure.element,
      histogram: this.histogram.element,
      start: this.start.element,
      params: this.#paramsHolder,
      transport: this.transport.element,
      cancel: this.#cancel,
      pyramid: this.pyramid.element,
      attractors: this.attractors.element,
      options: this.options.element,
      legend: this.stage.legend.element,
      banner: this.banner.element,
      status: this.status.element,
      canvas: this.#canvas,
      slices: this.#slices,
      drop,
      measures: this.measures.element,
      coverage: this.coverage.element,
      exports: this.#exports.element,
      sculpt: this.#sculpt,
      link: h('button', { type: 'button', class: 'wide', onclick: this.#events.onCopyLink }, text('labs.copyLink')),
      plots: this.#plots.element,
      csv: this.#csv,
      times: this.#times.element,
      log: this.#log.element,
      compare: this.#compareHolder,
      exercises: exercises(EXTRACT_EXERCISES, this.#events.onExampleId),
    });
  }

  makeParams(specs: ParamSpec[]): void {
    if (this.#params) return;
    this.#params = new ParamControls(specs, ['iso'], this.#events.onParam);
    this.#paramsHolder.replaceWith(this.#params.element);
  }

  /** Shows a newly opened volume, and clears results of the previous one. */
  adopt(volume: VolumeView, { example, unit = 'mm' }: ExtractSource): void {
    this.saving.name = volume.name;
    this.measures.unit = example?.unit ?? unit;
    this.stage.unit = example?.unit ?? unit;
    this.histogram.setVolume(volume);
    this.data.show(volume, example);
    this.large.showTotal(volume.large?.bytes);
    this.stage.setVolume(volume);
    this.compare.clear();
    this.coverage.unit = this.stage.unit;
    this.coverage.clear();
    if (isPreset(example) && example.compares) this.#compareHolder.open = true;
  }

  labelOf(param: string): string {
    return this.#params?.labelOf(param) ?? param;
  }

  showParams(params: ParamValues, example: Example | undefined): void {
    this.#params?.show(params);
    if (typeof params.iso === 'number') this.histogram.setIso(params.iso);
    if (isPreset(example)) this.#figure.show(example, variantInForce(example, params));
    else this.#figure.show(undefined);
  }

  refuseParam(name: string, message: string): void {
    if (name === 'iso') this.histogram.showError(message);
    else this.#params?.showError(name, message);
  }

  /** Shows the attractors in force in the list on the page, in the 3D view and on the slices. */
  showAttractors(attractors: Attractor[]): void {
    this.attractors.show(attractors);
    this.stage.showAttractors(attractors);
  }

  showHistory(): void {
    this.#plots.update();
    this.#times.update(this.#history);
    this.#csv.disabled = this.#history.reports.length === 0;
    this.#log.update(this.#history);
  }

  /** Shows the run's history after it was cleared, or set back by undo; {@link showHistory} suffices after steps. */
  replaceHistory(): void {
    this.#log.clear();
    this.transport.showReport(this.#history.reports.at(-1));
    this.showHistory();
  }

  showState(state: LabState, beneath: LabState, ready: boolean): void {
    this.#root.dataset.state = state;
    this.transport.showState(beneath, ready);
    const idle = ready && state !== 'loading';
    this.#exports.enabled = idle;
    this.#sculpt.disabled = !idle;
    this.compare.enabled = idle;
    this.coverage.enabled = idle;
    this.#cancel.hidden = state !== 'loading' || !ready;
  }

  dispose(): void {
    this.stage.dispose();
  }

  #setPlacing(placing: boolean): void {
    this.stage.onPlace = placing ? (point) => this.attractors.add(point) : undefined;
    this.#root.toggleAttribute('data-placing', placing);
    this.status.say(placing ? text('extract.placeAttractors') : '');
  }
}
