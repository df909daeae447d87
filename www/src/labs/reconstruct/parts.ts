import type { ImplicitChoice } from 'vesicle';
import { fileChooser } from '../../importers/files';
import { folded, h, section, wideButton } from '../../kit/dom';
import { FigurePanel } from '../../kit/figure';
import type { History } from '../../kit/history';
import { MeasurePanel } from '../../kit/measures';
import { Plots } from '../../kit/plots';
import type { LabState } from '../../kit/state';
import { initialOptions } from '../../kit/view';
import type { OptionControls } from '../../kit/view-options';
import { LabPage } from '../../lab/page';
import { RunControls, type RunEvents } from '../../lab/run-controls';
import { text } from '../../texts';
import type { ReconstructClient } from './client';
import type { CloudExample } from './examples';
import { FIT_ROWS, RESIDUAL_PLOT } from './measures';
import { cloudData, factsOf } from './page';
import { cloudOptions, offerCameras } from './panels/cloud-options';
import { type CloudChoice, CloudSetup } from './panels/cloud-setup';
import { EditTools } from './panels/edit-tools';
import { KernelPlot } from './panels/kernel-plot';
import { PhaseList } from './panels/phases';
import { PhotoStrip } from './panels/photo-strip';
import { TimingPanel } from './panels/timing';
import type { Photograph } from './photographs';
import { ACCEPT } from './point-files';
import type { CloudPreset, CloudVariant } from './presets';
import type { Cloud, ParamValues } from './protocol';
import { type Hit, ReconstructionView } from './scene';
import { CLOUD_VIEW, type CloudViewOptions } from './view';

export interface PartEvents extends RunEvents<CloudExample> {
  onVariant: (preset: CloudPreset, variant: CloudVariant) => void;
  onChoice: (choice: CloudChoice, what: string) => void;
  onPick: (hit: Hit) => void;
  onTakeBack: () => void;
  onOptions: (options: CloudViewOptions) => void;
  onPhotograph: () => void;
  onSaveVolume: () => void;
  onPassOn: () => void;
  onSculpt: () => void;
}

/** Controls and views of the Reconstruct lab. */
export class ReconstructParts {
  readonly page: LabPage<CloudExample>;
  readonly run: RunControls;

  readonly view: ReconstructionView;
  readonly phases = new PhaseList();
  readonly measures = new MeasurePanel(FIT_ROWS);
  readonly warning = h('p', { class: 'warning', role: 'status', 'data-warning': '' });
  readonly setup: CloudSetup;
  readonly options: OptionControls<typeof CLOUD_VIEW>;
  readonly photos: PhotoStrip;
  readonly tools: EditTools;
  readonly plots: Plots;
  readonly timing: TimingPanel;
  readonly #events: PartEvents;
  readonly #figure: FigurePanel<CloudVariant, CloudPreset>;
  readonly #kernel = new KernelPlot();
  /** Buttons that need a complete surface. */
  readonly #uses: HTMLButtonElement[];
  #photographs: readonly Photograph[] = [];
  #choice: ImplicitChoice | undefined;
  #params: ParamValues = {};

  constructor(root: HTMLElement, history: History, client: ReconstructClient, signal: AbortSignal, events: PartEvents) {
    this.page = new LabPage(root, signal, events, {
      viewLabel: text('reconstruct.viewLabel'),
      drop: text('reconstruct.drop'),
      admission: 'any',
      data: cloudData(fileChooser(events.onFiles, ACCEPT, undefined, 'any'), events.onExample),
    });
    this.run = new RunControls(this.page, events, {
      history,
      fetchMesh: (request) => client.request('export', request),
      residual: 'residual',
    });
    this.view = new ReconstructionView(this.page.canvas, initialOptions(CLOUD_VIEW));
    this.#events = events;
    this.setup = new CloudSetup(events.onChoice);
    this.tools = new EditTools((tool) => this.#setTool(tool !== 'none'), events.onTakeBack);
    this.plots = new Plots(history, [RESIDUAL_PLOT], false);
    this.timing = new TimingPanel(client, events.onError);
    this.#figure = new FigurePanel<CloudVariant, CloudPreset>(events.onVariant);
    this.options = cloudOptions((options) => {
      this.view.setOptions(options);
      events.onOptions(options);
    });
    this.photos = new PhotoStrip((index) => this.#lookThrough(index));
    this.view.onLeave = () => this.photos.choose(undefined);
    this.#uses = [
      wideButton(text('reconstruct.saveVolume'), 'volume', events.onSaveVolume),
      wideButton(text('reconstruct.openInExtract'), 'extract', events.onPassOn),
      wideButton(text('labs.openInSculpt'), 'sculpt', events.onSculpt),
    ];
    this.page.layOut({
      name: 'reconstruct',
      options: this.options.element,
      over: [this.view.legend.element, this.view.editing.legend.element],
      beside: [this.photos.large],
      stage: (view, status) => [view, this.run.transport.element, status, this.warning, this.photos.element],
      setup: [
        section(text('reconstruct.points'), this.page.data.element, this.#figure.element, this.setup.element),
        this.page.paramsSection(true),
        section(text('reconstruct.sectionEdits'), this.tools.element),
      ],
      results: [
        section(text('labs.sectionProgress'), this.phases.element),
        section(text('labs.sectionSurface'), this.page.warnings.element, this.measures.element),
        this.run.saveSection(this.view.subject, ...this.#uses),
        ...this.run.finishSections(this.view.editing, this.measures),
        section(text('labs.sectionPlots'), this.plots.element, this.#kernel.element, this.run.csv),
        folded(text('reconstruct.sectionTiming'), this.timing.element),
      ],
    });
  }

  /** Shows newly opened points with their cameras and facts. */
  adopt(cloud: Cloud, photographs: Photograph[], example: CloudExample | undefined, name: string): void {
    const { points, colors, normals, warnings } = cloud;
    this.page.warnings.showData(warnings);
    this.#photographs = photographs;
    this.page.saving.name = name;
    this.measures.unit = '';
    const cameras = photographs.map((one) => one.view);
    this.view.setCloud({ points, colors, cameras, up: example?.up ?? 'z', front: example?.front ?? 1 });
    offerCameras(this.options, photographs.length > 0);
    this.photos.show(photographs);
    this.timing.clear();
    this.showChoice(undefined);
    const facts = { name, points: points.length / 3, colors: colors !== undefined, normals: normals !== undefined };
    this.page.data.show(factsOf({ ...facts, cameras: photographs.length }), example);
  }

  clearSurface(): void {
    this.view.clearSurface();
    this.measures.clear();
    this.warning.textContent = '';
  }

  /** Shows the parameters in force; hides the constants of kernels that are not in use. */
  showParams(params: ParamValues, preset: CloudPreset | undefined, variant: CloudVariant | undefined): void {
    this.#params = params;
    this.page.showParams(params);
    const isMulti = params.kernel === 'multi-order';
    this.page.hideParams({ sigma: params.kernel !== 'gaussian', delta: !isMulti, tau: !isMulti });
    this.#figure.show(preset, variant);
    this.#showKernel();
  }

  /** Shows what the model chose from the points for automatic parameters; undefined while it is not known. */
  showChoice(choice: ImplicitChoice | undefined): void {
    this.#choice = choice;
    const { sides: _, ...numbers } = { ...choice };
    this.page.showChosen(numbers);
    this.#showKernel();
  }

  #showKernel(): void {
    const { delta } = this.#params;
    this.#kernel.show({ ...this.#params, ...(delta === 'auto' && this.#choice && { delta: this.#choice.delta }) });
  }

  /** Enables and disables controls; `surface`: whether there is a complete surface. */
  showState(state: LabState, beneath: LabState, ready: boolean, surface: boolean): void {
    const idle = this.run.showState(state, beneath, ready, surface);
    this.timing.enabled = idle;
    this.run.exports.enabled = surface;
    for (const button of this.#uses) button.disabled = !surface;
  }

  dispose(): void {
    this.run.dispose();
    this.view.dispose();
  }

  #setTool(on: boolean): void {
    this.page.root.toggleAttribute('data-placing', on);
    this.view.onPick = on ? this.#events.onPick : undefined;
  }

  #lookThrough(index: number | undefined): void {
    this.view.lookThrough(index === undefined ? undefined : this.#photographs[index]?.view, index);
    this.#events.onPhotograph();
  }
}
