import { type ReadonlySignal, signal } from '@preact/signals';
import { FileChooser } from '../../importers/chooser';
import { h } from '../../kit/dom';
import { RecentreOffer, type Recentring } from '../../kit/exports';
import type { LabState } from '../../kit/state';
import { Made } from '../../kit/ui/mount';
import { Button, Help, Section, type Undoable } from '../../kit/ui/parts';
import { initialOptions } from '../../kit/view';
import { OptionControls, ViewOptions } from '../../kit/view-options';
import { WarningList } from '../../kit/warnings';
import { DataPanel } from '../../lab/example-panel';
import { type LabEvents, LabPage } from '../../lab/page';
import { text } from '../../texts';
import type { SegmentExample } from './examples';
import { segmentData } from './page';
import { type LabelActs, LabelList, type LabelsShown } from './panels/labels';
import { LabelMeasureTable, type MeasuresShown } from './panels/measures';
import { ToolBar, ToolSettings } from './panels/tools';
import type { ParamValues, VolumeFormat } from './protocol';
import { SegmentView, type SegmentViewEvents } from './scene';
import type { Tools } from './tools';
import { SEGMENT_VIEW } from './view';

/** Formats in which the surfaces of all labels are saved, one file a label in a ZIP archive, or all in one GLB. */
export type SurfaceFormat = 'ply' | 'stl' | 'obj' | 'glb';

export interface PartEvents extends LabEvents<SegmentExample>, SegmentViewEvents {
  labels: LabelActs;
  onApply: () => void;
  onTravel: (direction: 'undo' | 'redo') => void;
  onMapFiles: (files: File[]) => void;
  onOptions: () => void;
  onSaveMap: (format: VolumeFormat) => void;
  onSaveSurfaces: (format: SurfaceFormat) => void;
  onReset: () => void;
}

const MAP_FORMATS: { format: VolumeFormat; label: string; help: string }[] = [
  { format: 'nifti', label: text('segment.nifti'), help: text('segment.niftiHelp') },
  { format: 'nrrd', label: text('segment.nrrd'), help: text('segment.nrrdHelp') },
  { format: 'mha', label: text('segment.mha'), help: text('segment.mhaHelp') },
];
const SURFACE_FORMATS: { format: SurfaceFormat; help: string }[] = [
  { format: 'glb', help: text('segment.glbHelp') },
  { format: 'ply', help: text('segment.zipHelp', { format: 'PLY' }) },
  { format: 'stl', help: text('segment.zipHelp', { format: 'STL' }) },
  { format: 'obj', help: text('segment.zipHelp', { format: 'OBJ' }) },
];

/** What the views of the lab show. */
export interface Shown {
  tools: Tools;
  list: ReadonlySignal<LabelsShown>;
  /** Why no label can be added; empty if one can. */
  refusal: ReadonlySignal<string>;
  undo: ReadonlySignal<Undoable>;
  measures: ReadonlySignal<MeasuresShown>;
}

/** Controls and views of the Segment lab. */
export class SegmentParts {
  readonly page: LabPage<SegmentExample>;

  readonly #slices = h('div', { class: 'slices' });
  readonly view: SegmentView;
  readonly options: ViewOptions<typeof SEGMENT_VIEW>;
  /** An offer to save surfaces moved to the origin. */
  readonly offer = signal<Recentring | undefined>(undefined);
  /** Whether there are labels, and nothing is being loaded. */
  readonly #isReady = signal(false);

  constructor(root: HTMLElement, closed: AbortSignal, shown: Shown, events: PartEvents) {
    const choosers = (
      <>
        <FileChooser onFiles={events.onFiles} label={text('segment.openVolume')} admission="labelled" />
        <FileChooser onFiles={events.onMapFiles} label={text('segment.openMap')} />
      </>
    );
    this.page = new LabPage(root, closed, events, {
      viewLabel: text('segment.viewLabel'),
      drop: text('segment.drop'),
      admission: 'labelled',
      data: segmentData(choosers, events.onExample),
      sessionHelp: text('segment.sessionHelp'),
    });
    this.view = new SegmentView(this.page.canvas, this.#slices, initialOptions(SEGMENT_VIEW), events);
    this.options = new ViewOptions(SEGMENT_VIEW, (options) => {
      this.view.setOptions(options);
      events.onOptions();
    });
    this.page.warnings.actions.value = { label: events.labels.activate, point: (point) => this.view.goTo(point) };
    const { tools, list, refusal, undo, measures } = shown;
    const isReady = this.#isReady;
    this.page.layOut({
      name: 'segment',
      options: <OptionControls of={this.options} />,
      stage: (view, status) => (
        <>
          <ToolBar {...{ tools, undo }} onTravel={events.onTravel} />
          <div class="four">
            {view}
            <Made of={this.#slices} />
          </div>
          {status}
        </>
      ),
      setup: (
        <>
          <Section title={text('segment.sectionLabels')}>
            <LabelList {...{ list, refusal }} acts={events.labels} />
          </Section>
          <Section title={text('segment.sectionTool')}>
            <ToolSettings {...{ tools, isReady }} onApply={events.onApply} />
          </Section>
          <Section title={text('segment.sectionVolume')}>
            <DataPanel data={this.page.data} />
            <Button class="wide" data-action="reset" title={text('segment.resetHelp')} onClick={events.onReset}>
              {text('segment.reset')}
            </Button>
          </Section>
          {this.page.paramsSection()}
        </>
      ),
      results: (
        <>
          <Section title={text('segment.sectionMeasures')}>
            <WarningList warnings={this.page.warnings} />
            <LabelMeasureTable shown={measures} />
          </Section>
          <Section title={text('segment.sectionMap')}>
            <MapExports isReady={isReady} onSave={events.onSaveMap} />
          </Section>
          <Section title={text('segment.sectionSurfaces')}>
            <SurfaceExports isReady={isReady} onSave={events.onSaveSurfaces} />
            <RecentreOffer offer={this.offer} />
          </Section>
          {this.page.saveSection(this.view.subject)}
        </>
      ),
    });
  }

  showParams(params: ParamValues): void {
    this.page.showParams(params);
  }

  /** Enables and disables controls according to the lab's state. `ready`: whether there is a label map. */
  showState(state: LabState, ready: boolean): void {
    const idle = this.page.showLoading(state, ready);
    this.#isReady.value = idle;
    if (!idle) this.offer.value = undefined;
  }

  dispose(): void {
    this.view.dispose();
  }
}

interface ExportProps<Format> {
  isReady: ReadonlySignal<boolean>;
  onSave: (format: Format) => void;
}

/** Buttons that save the label map. */
function MapExports({ isReady, onSave }: ExportProps<VolumeFormat>) {
  return (
    <div>
      <div class="buttons exports">
        {MAP_FORMATS.map(({ format, label, help }) => (
          <Button
            {...{ key: format, 'data-map': format, title: help, 'aria-label': help, disabled: !isReady.value }}
            onClick={() => onSave(format)}
          >
            {label}
          </Button>
        ))}
      </div>
      <Help>{text('segment.mapsHelp')}</Help>
    </div>
  );
}

/** Buttons that save the surfaces of all labels. */
function SurfaceExports({ isReady, onSave }: ExportProps<SurfaceFormat>) {
  return (
    <div>
      <div class="buttons exports">
        {SURFACE_FORMATS.map(({ format, help }) => (
          <Button
            {...{ key: format, 'data-export': format, title: help, 'aria-label': help, disabled: !isReady.value }}
            onClick={() => onSave(format)}
          >
            {format.toUpperCase()}
          </Button>
        ))}
      </div>
      <Help>{text('segment.surfacesHelp')}</Help>
    </div>
  );
}
