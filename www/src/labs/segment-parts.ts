import { SEGMENT_EXAMPLES, type SegmentExample } from '../segment/examples';
import type { ParamSpec, ParamValues, VolumeFormat } from '../segment/protocol';
import type { LabState } from '../state';
import { text } from '../texts';
import { h } from '../ui/dom';
import { acceptDrops, fileChooser } from '../ui/files';
import { LabelList, type LabelListEvents } from '../ui/label-list';
import { LabelMeasureTable } from '../ui/label-measures';
import { ParamControls } from '../ui/params';
import { SegmentOptionControls } from '../ui/segment-options';
import { SegmentTools, type ToolEvents } from '../ui/segment-tools';
import { ErrorBanner, StatusLine } from '../ui/status';
import { SegmentView, type SegmentViewEvents, type SegmentViewOptions } from '../view/segmentation';
import { INITIAL_VIEW } from './segment-link';
import { layOut, SegmentDataPanel } from './segment-page';

/** Formats in which the surfaces of all labels are saved, one file a label in a ZIP archive, or all in one GLB. */
export type SurfaceFormat = 'ply' | 'stl' | 'obj' | 'glb';

export interface PartEvents extends LabelListEvents, ToolEvents, SegmentViewEvents {
  onFiles: (files: File[]) => void;
  onMapFiles: (files: File[]) => void;
  onExample: (example: SegmentExample) => void;
  onParam: (name: string, value: unknown) => void;
  onOptions: () => void;
  onSaveMap: (format: VolumeFormat) => void;
  onSaveSurfaces: (format: SurfaceFormat) => void;
  onCopyLink: () => void;
  onReset: () => void;
  onCancel: () => void;
  onDismiss: () => void;
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

/**
 * All controls and views of the Segment lab, laid out. They display what they are given and report the user's actions as
 * events.
 */
export class SegmentParts {
  readonly #canvas = h('canvas', { tabindex: 0, role: 'application', 'aria-label': text('segment.viewLabel') });
  readonly #slices = h('div', { class: 'slices' });
  readonly view: SegmentView;
  readonly status = new StatusLine();
  readonly measures = new LabelMeasureTable();
  readonly banner: ErrorBanner;
  readonly data: SegmentDataPanel;
  readonly options: SegmentOptionControls;
  readonly labels: LabelList;
  readonly tools: SegmentTools;
  readonly #events: PartEvents;
  readonly #saves: HTMLButtonElement[];
  readonly #cancel: HTMLButtonElement;
  readonly #paramsHolder = h('div');
  #params: ParamControls | undefined;

  constructor(root: HTMLElement, signal: AbortSignal, events: PartEvents) {
    this.#events = events;
    this.view = new SegmentView(this.#canvas, this.#slices, INITIAL_VIEW, events);
    this.banner = new ErrorBanner(events.onDismiss);
    const chooser = fileChooser(events.onFiles, undefined, text('segment.openVolume'));
    const mapChooser = fileChooser(events.onMapFiles, undefined, text('segment.openMap'));
    this.data = new SegmentDataPanel(SEGMENT_EXAMPLES, chooser, mapChooser, events.onExample);
    this.options = new SegmentOptionControls(INITIAL_VIEW, (options: SegmentViewOptions) => {
      this.view.setOptions(options);
      events.onOptions();
    });
    this.labels = new LabelList(events);
    this.tools = new SegmentTools(events);
    const maps = MAP_FORMATS.map(({ format, label, help }) =>
      button(label, help, { 'data-map': format }, () => events.onSaveMap(format)),
    );
    const surfaces = SURFACE_FORMATS.map(({ format, help }) =>
      button(format.toUpperCase(), help, { 'data-export': format }, () => events.onSaveSurfaces(format)),
    );
    this.#saves = [...maps, ...surfaces];
    this.#cancel = h(
      'button',
      { type: 'button', hidden: true, 'data-action': 'cancel', onclick: events.onCancel },
      text('labs.cancel'),
    );
    const drop = h('div', { class: 'drop', hidden: true }, text('segment.drop'));
    acceptDrops(drop, events.onFiles, signal);
    const exported = (help: string, ...buttons: HTMLElement[]) =>
      h('div', {}, h('div', { class: 'buttons exports' }, ...buttons), h('p', { class: 'help' }, help));
    layOut(root, {
      data: this.data.element,
      labels: this.labels.element,
      toolBar: this.tools.bar,
      toolSettings: this.tools.settings,
      params: this.#paramsHolder,
      cancel: this.#cancel,
      options: this.options.element,
      banner: this.banner.element,
      status: this.status.element,
      canvas: this.#canvas,
      slices: this.#slices,
      drop,
      measures: this.measures.element,
      maps: exported(text('segment.mapsHelp'), ...maps),
      exports: exported(text('segment.surfacesHelp'), ...surfaces),
      reset: h(
        'button',
        {
          type: 'button',
          class: 'wide',
          onclick: events.onReset,
          'data-action': 'reset',
          title: text('segment.resetHelp'),
        },
        text('segment.reset'),
      ),
      link: h(
        'button',
        { type: 'button', class: 'wide', onclick: events.onCopyLink, 'data-action': 'link' },
        text('labs.copyLink'),
      ),
    });
  }

  makeParams(specs: ParamSpec[]): void {
    if (this.#params) return;
    this.#params = new ParamControls(specs, [], this.#events.onParam);
    this.#paramsHolder.replaceWith(this.#params.element);
  }

  showParams(params: ParamValues): void {
    this.#params?.show(params);
  }

  refuseParam(name: string, message: string): void {
    this.#params?.showError(name, message);
  }

  /** Enables and disables controls according to the lab's state. `ready`: whether there is a label map. */
  showState(state: LabState, ready: boolean): void {
    const idle = ready && state !== 'loading';
    this.tools.enabled = idle;
    for (const save of this.#saves) save.disabled = !idle;
    this.#cancel.hidden = state !== 'loading' || !ready;
  }

  dispose(): void {
    this.view.dispose();
  }
}

function button(label: string, help: string, data: Record<string, string>, onclick: () => void): HTMLButtonElement {
  return h('button', { type: 'button', title: help, 'aria-label': help, onclick, ...data }, label);
}
