import { fileChooser } from '../../importers/files';
import { h, section, wideButton } from '../../kit/dom';
import { RecentreOffer } from '../../kit/exports';
import type { LabState } from '../../kit/state';
import { initialOptions } from '../../kit/view';
import { OptionControls } from '../../kit/view-options';
import { type LabEvents, LabPage } from '../../lab/page';
import { text } from '../../texts';
import type { SegmentExample } from './examples';
import { segmentData } from './page';
import { LabelList, type LabelListEvents } from './panels/label-list';
import { LabelMeasureTable } from './panels/label-measures';
import { SegmentTools, type ToolEvents } from './panels/tools';
import type { ParamValues, VolumeFormat } from './protocol';
import { SegmentView, type SegmentViewEvents } from './scene';
import { SEGMENT_VIEW } from './view';

/** Formats in which the surfaces of all labels are saved, one file a label in a ZIP archive, or all in one GLB. */
export type SurfaceFormat = 'ply' | 'stl' | 'obj' | 'glb';

export interface PartEvents extends LabEvents<SegmentExample>, LabelListEvents, ToolEvents, SegmentViewEvents {
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

/** Controls and views of the Segment lab. */
export class SegmentParts {
  readonly page: LabPage<SegmentExample>;

  readonly #slices = h('div', { class: 'slices' });
  readonly view: SegmentView;
  readonly measures = new LabelMeasureTable();
  readonly options: OptionControls<typeof SEGMENT_VIEW>;
  readonly labels: LabelList;
  readonly tools: SegmentTools;
  readonly offer = new RecentreOffer();
  readonly #saves: HTMLButtonElement[];

  constructor(root: HTMLElement, signal: AbortSignal, events: PartEvents) {
    const choosers = [
      fileChooser(events.onFiles, undefined, text('segment.openVolume'), 'labelled'),
      fileChooser(events.onMapFiles, undefined, text('segment.openMap')),
    ];
    this.page = new LabPage(root, signal, events, {
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
    this.labels = new LabelList(events);
    this.page.warnings.actions = { label: (label) => events.onActive(label), point: (point) => this.view.goTo(point) };
    this.tools = new SegmentTools(events);
    const maps = MAP_FORMATS.map(({ format, label, help }) =>
      button(label, help, { 'data-map': format }, () => events.onSaveMap(format)),
    );
    const surfaces = SURFACE_FORMATS.map(({ format, help }) =>
      button(format.toUpperCase(), help, { 'data-export': format }, () => events.onSaveSurfaces(format)),
    );
    this.#saves = [...maps, ...surfaces];
    const reset = wideButton(text('segment.reset'), 'reset', events.onReset);
    reset.title = text('segment.resetHelp');
    const exported = (help: string, ...buttons: HTMLElement[]) =>
      h('div', {}, h('div', { class: 'buttons exports' }, ...buttons), h('p', { class: 'help' }, help));
    this.page.layOut({
      name: 'segment',
      options: this.options.element,
      stage: (view, status) => [this.tools.bar, h('div', { class: 'four' }, view, this.#slices), status],
      setup: [
        section(text('segment.sectionLabels'), this.labels.element),
        section(text('segment.sectionTool'), this.tools.settings),
        section(text('segment.sectionVolume'), this.page.data.element, reset),
        this.page.paramsSection(),
      ],
      results: [
        section(text('segment.sectionMeasures'), this.page.warnings.element, this.measures.element),
        section(text('segment.sectionMap'), exported(text('segment.mapsHelp'), ...maps)),
        section(
          text('segment.sectionSurfaces'),
          exported(text('segment.surfacesHelp'), ...surfaces),
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
    this.tools.enabled = idle;
    for (const save of this.#saves) save.disabled = !idle;
    if (!idle) this.offer.hide();
  }

  dispose(): void {
    this.view.dispose();
  }
}

function button(label: string, help: string, data: Record<string, string>, onclick: () => void): HTMLButtonElement {
  return h('button', { type: 'button', title: help, 'aria-label': help, onclick, ...data }, label);
}
