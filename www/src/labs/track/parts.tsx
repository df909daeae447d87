import { type ReadonlySignal, signal } from '@preact/signals';
import { concerning } from '../../engine/warnings';
import { FileChooser } from '../../importers/chooser';
import { h } from '../../kit/dom';
import type { History } from '../../kit/history';
import { MeasureTable, SurfaceMeasures } from '../../kit/measures';
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
import { text } from '../../texts';
import type { VoxelBox } from './box';
import type { TrackClient } from './client';
import type { TrackExample } from './examples';
import { TRACK_ROWS } from './measures';
import { factsOf, imageData } from './page';
import { ComparePanel, TrackComparison } from './panels/compare';
import { EdgeThreshold, ThresholdState } from './panels/edge-threshold';
import { FigureRow, Stills } from './panels/figure-row';
import { FrameBar, Frames } from './panels/frame-bar';
import { FrameTable, FrameWarnings, NO_FRAMES } from './panels/frame-table';
import { ObjectChoice, type ObjectEvents, ObjectQuestion } from './panels/object-choice';
import { PreparationControls, PreparationState } from './panels/preparation';
import { RegionControls, type RegionEvents, RegionState } from './panels/region';
import { NO_VOLUMES, VolumeCurve, type VolumeCurves } from './panels/volume-curve';
import type { TrackPreset, TrackVariant } from './presets';
import type { Alternative, OpenedImage, ParamValues, Preparation, Vec3 } from './protocol';
import { TrackView } from './scene';
import { TRACK_VIEW, type TrackViewOptions } from './view';

export interface PartEvents extends RunEvents<TrackExample>, RegionEvents, ObjectEvents {
  onVariant: (preset: TrackPreset, variant: TrackVariant) => void;
  onPreparation: (preparation: Preparation, what: string) => void;
  onOptions: (options: TrackViewOptions) => void;
  onFrame: (frame: number) => void;
  onMoved: () => void;
  onCompare: (other: Alternative) => void;
  onCancelCompare: () => void;
  onSave: (what: 'frames' | 'animation' | 'table') => void;
  onSculpt: () => void;
}

/** Controls and views of the Track lab. */
export class TrackParts {
  readonly page: LabPage<TrackExample>;
  readonly run: RunControls;

  readonly #slices = h('div', { class: 'slices' });
  readonly view: TrackView;
  readonly measures = new SurfaceMeasures();
  readonly table = signal(NO_FRAMES);
  readonly options: ViewOptions<typeof TRACK_VIEW>;
  readonly preparation = new PreparationState();
  readonly region = new RegionState();
  readonly object = new ObjectQuestion();
  readonly frames: Frames;
  readonly #curves = signal(NO_VOLUMES);
  #nextCurves = NO_VOLUMES;
  #curvesPending = 0;
  readonly stills: Stills;
  readonly compare = new TrackComparison();
  readonly #figure = signal<{ preset: TrackPreset | undefined; variant: TrackVariant | undefined }>({
    ...{ preset: undefined, variant: undefined },
  });
  /** What can be saved: all frames, and the surface of the one shown. */
  readonly #saves = signal({ all: false, here: false });
  readonly #threshold = new ThresholdState();
  /**
   * Half width k, in voxels, of the windows in which the tracker finds the boundary; the preview of an edge threshold
   * uses it.
   */
  #window = 2;

  constructor(root: HTMLElement, history: History, client: TrackClient, signal: AbortSignal, events: PartEvents) {
    this.page = new LabPage(root, signal, events, {
      viewLabel: text('track.viewLabel'),
      drop: text('track.drop'),
      admission: 'frames',
      data: imageData(<FileChooser onFiles={events.onFiles} admission="frames" />, events.onExample),
      ownControls: ['threshold'],
      onParams: (specs) => {
        this.#threshold.spec.value = specs.find(({ name }) => name === 'threshold');
      },
    });
    this.run = new RunControls(this.page, events, {
      history,
      fetchMesh: (request) => client.request('export', { ...request, frame: this.frames.frame }),
      suffix: () => `-${this.frames.frame + 1}`,
      concerningSurface: (warnings) => concerning(warnings, { frame: this.frames.frame }),
    });
    this.view = new TrackView(this.page.canvas, this.#slices, initialOptions(TRACK_VIEW));
    this.#slices.addEventListener('keydown', (event) => {
      if (event.key === 'Enter' && event.target instanceof HTMLInputElement && event.target.type === 'range')
        events.onHere();
    });
    this.frames = new Frames(events.onFrame);
    const stopAt = (frame: number) => {
      this.frames.stop();
      events.onFrame(frame);
    };
    this.stills = new Stills((voxel: Vec3) => this.view.goToVoxel(voxel), stopAt);
    this.options = new ViewOptions(TRACK_VIEW, (options) => {
      this.view.setOptions(options);
      this.#slices.hidden = options.below !== 'slices';
      this.stills.choose(options.below);
      events.onOptions(options);
    });
    this.view.onRegion = (region: VoxelBox) => events.onRegion(region);
    this.view.onMoved = events.onMoved;
    this.page.warnings.actions.value = { frame: stopAt, point: (point) => this.view.goTo(point) };
    this.page.layOut({
      name: 'track',
      options: <OptionControls of={this.options} />,
      over: <Made of={this.view.editing.legend.element} />,
      stage: (view, status) => (
        <>
          {view}
          <FrameBar of={this.frames} />
          {this.run.controls}
          {status}
          <ObjectChoice of={this.object} events={events} />
          <Made of={this.#slices} />
          <FigureRow of={this.stills} />
        </>
      ),
      setup: (
        <>
          <Section title={text('track.sectionImage')}>
            <DataPanel data={this.page.data} />
            <FigureOf shown={this.#figure} onVariant={events.onVariant} />
          </Section>
          <Section title={text('track.sectionBoundary')}>
            <EdgeThreshold
              state={this.#threshold}
              onChange={(value) => events.onParam('threshold', value)}
              onTry={(value) => this.view.preview(value, this.#window)}
            />
          </Section>
          <Section title={text('track.sectionRegion')}>
            <RegionControls state={this.region} events={events} />
          </Section>
          <Folded title={text('track.sectionPreparation')}>
            <PreparationControls state={this.preparation} onChange={events.onPreparation} />
          </Folded>
          {this.page.paramsSection()}
        </>
      ),
      results: (
        <>
          <Section title={text('track.sectionCurve')}>
            <VolumeCurve curves={this.#curves} onFrame={stopAt} />
            <FrameWarnings shown={this.table} />
          </Section>
          <Section title={text('track.sectionSurface')}>
            <WarningList warnings={this.page.warnings} />
            <MeasureTable measures={this.measures} extra={TRACK_ROWS} />
          </Section>
          {this.run.saveSection(this.view.subject, <Saves can={this.#saves} events={events} />)}
          {this.run.finishSections(this.view.editing, this.measures, () => this.frames.stop())}
          <Folded title={text('labs.frames')}>
            <FrameTable shown={this.table} />
          </Folded>
          <Folded title={text('track.sectionCompare')}>
            <ComparePanel of={this.compare} onStart={events.onCompare} onCancel={events.onCancelCompare} />
          </Folded>
        </>
      ),
    });
  }

  /** Shows the facts about a newly opened image. */
  adopt(opened: OpenedImage, example: TrackExample | undefined, name: string): void {
    const unit = example?.unit ?? unitOf(opened.volume);
    this.page.saving.name = example?.id ?? name;
    this.measures.unit.value = unit;
    this.run.unit = unit;
    this.run.surfaceSpace = spaceOf(opened.volume, unit);
    this.page.data.show(factsOf(opened, name, unit), example);
  }

  showParams(params: ParamValues, noise: number, suggested: number, most: number): void {
    this.#window = Number(params.window);
    this.page.showParams(params);
    this.#threshold.show({ threshold: Number(params.threshold), noise, suggested, largest: most });
  }

  showFigure(preset: TrackPreset | undefined, variant: TrackVariant | undefined): void {
    this.#figure.value = { preset, variant };
  }

  refuseParam(name: string, message: string): void {
    if (name === 'threshold') this.#threshold.showError(message);
    else this.page.refuseParam(name, message);
  }

  /**
   * Enables and disables controls according to the lab's state. `tracked`: number of frames with a surface; `here`:
   * whether the displayed frame has one.
   */
  showState(state: LabState, beneath: LabState, ready: boolean, tracked: number, here: boolean): void {
    const idle = this.run.showState(state, beneath, ready, here);
    this.run.exports.enabled = idle && here;
    this.#saves.value = { all: idle && tracked > 0, here: idle && here };
    // While the lab asks for the object, there is nothing to run.
    if (this.object.isOpen.peek()) this.run.transport.showState(beneath, false);
    this.object.isEnabled.value = idle;
    this.region.isEnabled.value = idle;
    this.compare.isEnabled.value = idle && beneath === 'done';
  }

  /** Shows volume curves at the next animation frame. */
  showCurves(curves: VolumeCurves): void {
    this.#nextCurves = curves;
    this.#curvesPending ||= requestAnimationFrame(() => {
      this.#curvesPending = 0;
      this.#curves.value = this.#nextCurves;
    });
  }

  dispose(): void {
    cancelAnimationFrame(this.#curvesPending);
    this.run.dispose();
    this.frames.stop();
    this.view.dispose();
  }
}

/** Buttons that save all frames, or pass on the surface of one. */
function Saves({ can, events }: { can: ReadonlySignal<{ all: boolean; here: boolean }>; events: PartEvents }) {
  const { all, here } = can.value;
  const save = (what: 'frames' | 'animation' | 'table', label: string) => (
    <Button class="wide" data-action={`save-${what}`} disabled={!all} onClick={() => events.onSave(what)}>
      {label}
    </Button>
  );
  return (
    <>
      {save('frames', text('track.saveFrames'))}
      {save('animation', text('track.saveAnimation'))}
      {save('table', text('track.saveTable'))}
      <Button class="wide" data-action="sculpt" disabled={!here} onClick={events.onSculpt}>
        {text('labs.openInSculpt')}
      </Button>
    </>
  );
}
