import { type ReadonlySignal, signal } from '@preact/signals';
import type { Attractor, ParamValues, Plane, VolumeView } from '../../engine/protocol';
import { FileChooser } from '../../importers/chooser';
import { h } from '../../kit/dom';
import type { History } from '../../kit/history';
import { MeasureTable, SurfaceMeasures } from '../../kit/measures';
import { ENERGY_PLOTS, Plots, RunPlots } from '../../kit/plots';
import type { LabState } from '../../kit/state';
import { FigureOf } from '../../kit/ui/figure';
import { Made } from '../../kit/ui/mount';
import { Button, Folded, Section } from '../../kit/ui/parts';
import { initialOptions } from '../../kit/view';
import { OptionControls, ViewOptions } from '../../kit/view-options';
import { WarningList } from '../../kit/warnings';
import { DataPanel } from '../../lab/example-panel';
import { LabPage } from '../../lab/page';
import { RunControls, type RunEvents } from '../../lab/run-controls';
import { spaceOf, unitOf } from '../../lab/surface-space';
import { Stage } from '../../scene/stage';
import { text } from '../../texts';
import type { ExtractClient } from './client';
import { type ExtractSource, frameOf } from './data';
import type { Example } from './examples';
import { extractData, factsOf } from './page';
import { AttractorControls, Attractors } from './panels/attractors';
import { ComparePanel, Comparison } from './panels/compare';
import { Coverage, CoveragePanel } from './panels/coverage';
import { FrameChoice } from './panels/frame-choice';
import { Histogram, IsoState } from './panels/histogram';
import { LabelsOffer } from './panels/labels-offer';
import { LargeReading, LargeSourceControls } from './panels/large-source';
import { EventList, EventLog } from './panels/log';
import { Pyramid, PyramidPanel } from './panels/pyramid';
import { StartControls, StartState } from './panels/start';
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

  /** Number of labels if the volume looks like a label map. */
  readonly #labels = signal(0);
  readonly #slices = h('div', { class: 'slices' });
  readonly stage: Stage;
  readonly measures = new SurfaceMeasures();
  readonly large = new LargeReading();
  /** Number of frames of the open volume. */
  #frameCount = 1;
  readonly #frame = signal({ frame: 0, frames: 1 });
  readonly #iso: IsoState;
  readonly start: StartState;
  readonly pyramid: Pyramid;
  readonly attractors: Attractors;
  readonly options: ViewOptions<typeof EXTRACT_VIEW>;
  readonly compare = new Comparison();
  readonly coverage: Coverage;
  readonly #figure = signal<{ preset: Preset | undefined; variant: Variant | undefined }>({
    ...{ preset: undefined, variant: undefined },
  });
  readonly #isReady = signal(false);
  readonly #plots: Plots;
  readonly #times = signal<Pick<History, 'times'>>({ times: new Map() });
  readonly #log = new EventLog();
  readonly #isComparing = signal(false);

  constructor(root: HTMLElement, history: History, client: ExtractClient, signal: AbortSignal, events: PartEvents) {
    const more = (
      <>
        <FrameChoice open={this.#frame} onFrame={events.onFrame} />
        <LargeSourceControls reading={this.large} onOpen={events.onLarge} />
      </>
    );
    this.page = new LabPage(root, signal, events, {
      viewLabel: text('extract.viewLabel'),
      drop: text('extract.drop'),
      admission: 'volume',
      onFolder: (folder) => events.onLarge(folder.name, { zarr: folder }),
      data: extractData(<FileChooser onFiles={events.onFiles} />, more, events.onExample),
      ownControls: ['iso'],
    });
    this.run = new RunControls(this.page, events, {
      history,
      fetchMesh: (request) => client.request('export', request),
    });
    this.stage = new Stage(this.page.canvas, this.#slices, initialOptions(EXTRACT_VIEW), events.onPlanes);
    this.#iso = new IsoState((iso) => events.onParam('iso', iso));
    this.start = new StartState(events.onStart);
    this.pyramid = new Pyramid(
      (level) => this.stage.thumbnail(level),
      (level) => this.stage.showLevel(level),
    );
    this.stage.onMoved = () => this.pyramid.redraw();
    this.attractors = new Attractors({
      onChange: events.onAttractors,
      onPlacing: (placing) => this.#setPlacing(placing),
      onGoTo: (point) => this.stage.goTo(point),
      crosshair: () => this.stage.crosshair,
    });
    this.options = new ViewOptions(EXTRACT_VIEW, (options) => {
      this.stage.setOptions(options);
      events.onOptions(options);
    });
    this.coverage = new Coverage({
      onStart: events.onCoverage,
      onCancel: events.onCancelCoverage,
      onSeed: events.onSeed,
      onGoTo: (point) => this.stage.lookAt(point),
      onMark: (parts) => this.stage.showUncovered(parts),
    });
    this.#plots = new Plots(history, ENERGY_PLOTS, true);
    this.page.warnings.actions.value = { point: (point) => this.stage.goTo(point) };
    this.page.layOut({
      name: 'extract',
      options: <OptionControls of={this.options} />,
      over: (
        <>
          <Made of={this.stage.legend.element} />
          <Made of={this.stage.editing.legend.element} />
        </>
      ),
      stage: (view, status) => (
        <>
          {view}
          {this.run.controls}
          {status}
          <Made of={this.#slices} />
        </>
      ),
      setup: (
        <>
          <Section title={text('extract.sectionData')}>
            <DataPanel data={this.page.data} />
            <LabelsOffer labels={this.#labels} onSegment={events.onSegment} />
            <FigureOf shown={this.#figure} onVariant={events.onVariant} />
          </Section>
          <Section title={text('extract.sectionIntensities')}>
            <Histogram state={this.#iso} />
          </Section>
          <Section title={text('extract.sectionStart')}>
            <StartControls state={this.start} />
          </Section>
          <Section title={text('extract.sectionPyramid')}>
            <PyramidPanel pyramid={this.pyramid} />
          </Section>
          <Section title={text('extract.sectionAttractors')}>
            <AttractorControls of={this.attractors} />
          </Section>
          {this.page.paramsSection(true)}
        </>
      ),
      results: (
        <>
          <Section title={text('labs.sectionSurface')}>
            <WarningList warnings={this.page.warnings} />
            <MeasureTable measures={this.measures} />
          </Section>
          <Section title={text('extract.sectionCoverage')}>
            <CoveragePanel of={this.coverage} />
          </Section>
          {this.run.saveSection(this.stage.subject, <ToSculpt isReady={this.#isReady} onSculpt={events.onSculpt} />)}
          {this.run.finishSections(this.stage.editing, this.measures)}
          <Section title={text('labs.sectionProgress')}>
            <RunPlots plots={this.#plots} />
            {this.run.plotData}
          </Section>
          <Section title={text('extract.sectionEvents')}>
            <EventList log={this.#log} />
          </Section>
          <Section title={text('extract.sectionTimes')}>
            <TimeTable run={this.#times} />
          </Section>
          <Folded title={text('extract.sectionCompare')} isOpen={this.#isComparing}>
            <ComparePanel of={this.compare} onStart={events.onCompare} onCancel={events.onCancelCompare} />
          </Folded>
        </>
      ),
    });
  }

  /** Shows a newly opened volume, and clears results of the previous one. */
  adopt(volume: VolumeView, source: ExtractSource, labels: number): void {
    const { example, unit = unitOf(volume) } = source;
    this.#labels.value = example ? 0 : labels;
    this.page.saving.name = volume.name;
    this.page.warnings.showData(source.warnings, volume.warnings);
    const shown = example?.unit ?? unit;
    this.measures.unit.value = shown;
    this.stage.unit = shown;
    this.run.unit = shown;
    this.run.surfaceSpace = spaceOf(volume, shown);
    this.#iso.volume.value = volume;
    this.page.data.show(factsOf(volume, shown), example);
    this.#frameCount = volume.frames;
    this.showFrame(source);
    this.large.showTotal(volume.large?.bytes);
    this.start.isLarge.value = volume.large !== undefined;
    this.stage.setVolume(volume);
    this.compare.clear();
    this.coverage.unit = this.stage.unit;
    this.coverage.clear();
    if (isPreset(example) && example.compares) this.#isComparing.value = true;
  }

  showFrame(source: ExtractSource): void {
    this.#frame.value = { frame: frameOf(source), frames: this.#frameCount };
  }

  showParams(params: ParamValues, example: Example | undefined): void {
    this.page.showParams(params);
    if (typeof params.iso === 'number') this.#iso.setIso(params.iso);
    const preset = isPreset(example) ? example : undefined;
    this.#figure.value = { preset, variant: preset && variantInForce(preset, params) };
  }

  refuseParam(name: string, message: string): void {
    if (name === 'iso') this.#iso.showError(message);
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
    this.#times.value = { times: this.run.history.times };
    this.run.hasPlots.value = this.run.history.reports.length > 0;
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
    this.#isReady.value = idle;
    this.compare.isEnabled.value = idle;
    this.coverage.isEnabled.value = idle;
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

function ToSculpt({ isReady, onSculpt }: { isReady: ReadonlySignal<boolean>; onSculpt: () => void }) {
  return (
    <Button class="wide" data-action="sculpt" disabled={!isReady.value} onClick={onSculpt}>
      {text('labs.openInSculpt')}
    </Button>
  );
}
