import { type ReadonlySignal, signal } from '@preact/signals';
import { fileChooser } from '../../importers/files';
import { h, section, wideButton } from '../../kit/dom';
import { RecentreOffer } from '../../kit/exports';
import type { LabState } from '../../kit/state';
import { elementOf } from '../../kit/ui/mount';
import { Button, Help, type Undoable } from '../../kit/ui/parts';
import { initialOptions } from '../../kit/view';
import { OptionControls } from '../../kit/view-options';
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
  readonly options: OptionControls<typeof SEGMENT_VIEW>;
  readonly offer = new RecentreOffer();
  /** Whether there are labels, and nothing is being loaded. */
  readonly #isReady = signal(false);

  constructor(root: HTMLElement, closed: AbortSignal, shown: Shown, events: PartEvents) {
    const choosers = [
      fileChooser(events.onFiles, undefined, text('segment.openVolume'), 'labelled'),
      fileChooser(events.onMapFiles, undefined, text('segment.openMap')),
    ];
    this.page = new LabPage(root, closed, events, {
      viewLabel: text('segment.viewLabel'),
      drop: text('segment.drop'),
      admission: 'labelled',
      data: segmentData(choosers, events.onExample),
      sessionHelp: text('segment.sessionHelp'),
    });
    this.view = new SegmentView(this.page.canvas, this.#slices, initialOptions(SEGMENT_VIEW), events);
    this.options = new OptionControls(SEGMENT_VIEW, (options) => {
      this.view.setOptions(options);
      events.onOptions();
    });
    this.page.warnings.actions = { label: events.labels.activate, point: (point) => this.view.goTo(point) };
    const { tools, list, refusal, undo, measures } = shown;
    const isReady = this.#isReady;
    const reset = wideButton(text('segment.reset'), 'reset', events.onReset);
    reset.title = text('segment.resetHelp');
    this.page.layOut({
      name: 'segment',
      options: this.options.element,
      stage: (view, status) => [
        elementOf(<ToolBar {...{ tools, undo }} onTravel={events.onTravel} />),
        h('div', { class: 'four' }, view, this.#slices),
        status,
      ],
      setup: [
        section(text('segment.sectionLabels'), elementOf(<LabelList {...{ list, refusal }} acts={events.labels} />)),
        section(
          text('segment.sectionTool'),
          elementOf(<ToolSettings {...{ tools, isReady }} onApply={events.onApply} />),
        ),
        section(text('segment.sectionVolume'), this.page.data.element, reset),
        this.page.paramsSection(),
      ],
      results: [
        section(
          text('segment.sectionMeasures'),
          this.page.warnings.element,
          elementOf(<LabelMeasureTable shown={measures} />),
        ),
        section(text('segment.sectionMap'), elementOf(<MapExports isReady={isReady} onSave={events.onSaveMap} />)),
        section(
          text('segment.sectionSurfaces'),
          elementOf(<SurfaceExports isReady={isReady} onSave={events.onSaveSurfaces} />),
          this.offer.element,
        ),
        this.page.saveSection(this.view.subject),
      ],
    });
  }

  showParams(params: ParamValues): void {
    this.page.showParams(params);
  }

  /** Enables and disables controls according to the lab's state. `ready`: whether there is a label map. */
  showState(state: LabState, ready: boolean): void {
    const idle = this.page.showLoading(state, ready);
    this.#isReady.value = idle;
    if (!idle) this.offer.hide();
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
