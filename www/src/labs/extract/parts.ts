import type { Attractor, ParamValues, Plane, VolumeView } from '../../engine/protocol';
import { fileChooser } from '../../importers/files';
import { folded, h, section, wideButton } from '../../kit/dom';
import { FigurePanel } from '../../kit/figure';
import { COVERAGE_GUIDE } from '../../kit/guides';
import type { History } from '../../kit/history';
import { MeasurePanel } from '../../kit/measures';
import { ENERGY_PLOTS, Plots } from '../../kit/plots';
import type { LabState } from '../../kit/state';
import { initialOptions } from '../../kit/view';
import { OptionControls } from '../../kit/view-options';
import { LabPage } from '../../lab/page';
import { RunControls, type RunEvents } from '../../lab/run-controls';
import { spaceOf, unitOf } from '../../lab/surface-space';
import { Stage } from '../../scene/stage';
import { text } from '../../texts';
import type { ExtractClient } from './client';
import { type ExtractSource, frameOf } from './data';
import type { Example } from './examples';
import { extractData, factsOf } from './page';
import { AttractorControls } from './panels/attractors';
import { ComparePanel } from './panels/compare';
import { CoveragePanel } from './panels/coverage';
import { FrameChoice } from './panels/frame-choice';
import { Histogram } from './panels/histogram';
import { LabelsOffer } from './panels/labels-offer';
import { LargeSourceControls } from './panels/large-source';
import { EventLog } from './panels/log';
import { PyramidPanel } from './panels/pyramid';
import { StartControls } from './panels/start';
import { TimeTable } from './panels/times';
import { isPreset, type Preset, type Variant, variantInForce } from './presets';
import type { LargeSource } from './protocol';
import { EXTRACT_VIEW, type ExtractViewOptions } from './view';

export interface PartEvents extends RunEvents<Example> {
  onLarge: (name: string, source: LargeSource) => void;
  onFrame: (frame: number) => void;
  onVariant: (preset: Preset, variant: Variant) => void;
  onStart: () => void;
  onAttractors: (attractors: Attractor[], what: string, tuning: boolean) => void;
  onOptions: (options: ExtractViewOptions) => void;
  onPlanes: (planes: Plane[]) => void;
  onCompare: () => void;
  onCancelCompare: () => void;
  onCoverage: () => void;
  onCancelCoverage: () => void;
  onSeed: () => void;
  onSegment: () => void;
  onSculpt: () => void;
}

/** Controls and views of the Extract lab. */
export class ExtractParts {
  readonly page: LabPage<Example>;
  readonly run: RunControls;

  readonly #labels: LabelsOffer;
  readonly #slices = h('div', { class: 'slices' });
  readonly stage: Stage;
  readonly measures = new MeasurePanel();
  readonly large: LargeSourceControls;
  /** Number of frames of the open volume. */
  #frameCount = 1;
  readonly #frames: FrameChoice;
  readonly histogram: Histogram;
  readonly start: StartControls;
  readonly pyramid: PyramidPanel;
  readonly attractors: AttractorControls;
  readonly options: OptionControls<typeof EXTRACT_VIEW>;
  readonly compare: ComparePanel;
  readonly coverage: CoveragePanel;
  readonly #figure: FigurePanel<Variant, Preset>;
  readonly #sculpt: HTMLButtonElement;
  readonly #plots: Plots;
  readonly #times = new TimeTable();
  readonly #log = new EventLog();
  readonly #compareHolder: HTMLDetailsElement;

  constructor(root: HTMLElement, history: History, client: ExtractClient, signal: AbortSignal, events: PartEvents) {
    const large = new LargeSourceControls(events.onLarge);
    const frames = new FrameChoice(events.onFrame);
    const chooser = fileChooser(events.onFiles);
    this.page = new LabPage(root, signal, events, {
      viewLabel: text('extract.viewLabel'),
      drop: text('extract.drop'),
      admission: 'volume',
      onFolder: (folder) => events.onLarge(folder.name, { zarr: folder }),
      data: extractData(chooser, [frames.element, large.element], events.onExample),
      ownControls: ['iso'],
    });
    this.run = new RunControls(this.page, events, {
      history,
      fetchMesh: (request) => client.request('export', request),
    });
    this.large = large;
    this.#frames = frames;
    this.#labels = new LabelsOffer(events.onSegment);
    this.stage = new Stage(this.page.canvas, this.#slices, initialOptions(EXTRACT_VIEW), events.onPlanes);
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
    this.options = new OptionControls(EXTRACT_VIEW, (options) => {
      this.stage.setOptions(options);
      events.onOptions(options);
    });
    this.compare = new ComparePanel({ onStart: events.onCompare, onCancel: events.onCancelCompare });
    this.coverage = new CoveragePanel(COVERAGE_GUIDE, {
      onStart: events.onCoverage,
      onCancel: events.onCancelCoverage,
      onSeed: events.onSeed,
      onGoTo: (point) => this.stage.lookAt(point),
      onMark: (parts) => this.stage.showUncovered(parts),
    });
    this.#compareHolder = folded(text('extract.sectionCompare'), this.compare.element);
    this.#sculpt = wideButton(text('labs.openInSculpt'), 'sculpt', events.onSculpt);
    this.#plots = new Plots(history, ENERGY_PLOTS, true);
    this.page.warnings.actions = { point: (point) => this.stage.goTo(point) };
    this.page.layOut({
      name: 'extract',
      options: this.options.element,
      over: [this.stage.legend.element, this.stage.editing.legend.element],
      stage: (view, status) => [view, this.run.transport.element, status, this.#slices],
      setup: [
        section(text('extract.sectionData'), this.page.data.element, this.#labels.element, this.#figure.element),
        section(text('extract.sectionIntensities'), this.histogram.element),
        section(text('extract.sectionStart'), this.start.element),
        section(text('extract.sectionPyramid'), this.pyramid.element),
        section(text('extract.sectionAttractors'), this.attractors.element),
        this.page.paramsSection(true),
      ],
      results: [
        section(text('labs.sectionSurface'), this.page.warnings.element, this.measures.element),
        section(text('extract.sectionCoverage'), this.coverage.element),
        this.run.saveSection(this.stage.subject, this.#sculpt),
        ...this.run.finishSections(this.stage.editing, this.measures),
        section(text('labs.sectionProgress'), this.#plots.element, this.run.csv),
        section(text('extract.sectionEvents'), this.#log.element),
        section(text('extract.sectionTimes'), this.#times.element),
        this.#compareHolder,
      ],
    });
  }

  /** Shows a newly opened volume, and clears results of the previous one. */
  adopt(volume: VolumeView, source: ExtractSource, labels: number): void {
    const { example, unit = unitOf(volume) } = source;
    this.#labels.show(example ? 0 : labels);
    this.page.saving.name = volume.name;
    this.page.warnings.showData(source.warnings, volume.warnings);
    const shown = example?.unit ?? unit;
    this.measures.unit = shown;
    this.stage.unit = shown;
    this.run.unit = shown;
    this.run.surfaceSpace = spaceOf(volume, shown);
    this.histogram.setVolume(volume);
    this.page.data.show(factsOf(volume, shown), example);
    this.#frameCount = volume.frames;
    this.showFrame(source);
    this.large.showTotal(volume.large?.bytes);
    this.start.isLarge = volume.large !== undefined;
    this.stage.setVolume(volume);
    this.compare.clear();
    this.coverage.unit = this.stage.unit;
    this.coverage.clear();
    if (isPreset(example) && example.compares) this.#compareHolder.open = true;
  }

  showFrame(source: ExtractSource): void {
    this.#frames.show(frameOf(source), this.#frameCount);
  }

  showParams(params: ParamValues, example: Example | undefined): void {
    this.page.showParams(params);
    if (typeof params.iso === 'number') this.histogram.setIso(params.iso);
    if (isPreset(example)) this.#figure.show(example, variantInForce(example, params));
    else this.#figure.show(undefined);
  }

  refuseParam(name: string, message: string): void {
    if (name === 'iso') this.histogram.showError(message);
    else this.page.refuseParam(name, message);
  }

  /** Shows the attractors in force in the list on the page, in the 3D view and on the slices. */
  showAttractors(attractors: Attractor[]): void {
    this.attractors.show(attractors);
    this.stage.showAttractors(attractors);
  }

  showHistory(): void {
    this.run.showWarnings();
    this.#plots.update();
    this.#times.update(this.run.history);
    this.run.csv.disabled = this.run.history.reports.length === 0;
    this.#log.update(this.run.history);
  }

  /** Shows the run's history after it was cleared, or set back by undo; {@link showHistory} suffices after steps. */
  replaceHistory(): void {
    this.#log.clear();
    this.run.transport.showReport(this.run.history.reports.at(-1));
    this.showHistory();
  }

  showState(state: LabState, beneath: LabState, ready: boolean): void {
    const idle = this.run.showState(state, beneath, ready);
    this.#sculpt.disabled = !idle;
    this.compare.enabled = idle;
    this.coverage.enabled = idle;
  }

  dispose(): void {
    this.run.dispose();
    this.stage.dispose();
  }

  #setPlacing(placing: boolean): void {
    this.stage.onPlace = placing ? (point) => this.attractors.add(point) : undefined;
    this.page.root.toggleAttribute('data-placing', placing);
    this.page.status.say(placing ? text('extract.placeAttractors') : '');
  }
}
