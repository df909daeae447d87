import { type ReadonlySignal, signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import type { ImplicitChoice } from 'vesicle';
import { FileChooser } from '../../importers/chooser';
import { History } from '../../kit/history';
import { MeasureTable, SurfaceMeasures } from '../../kit/measures';
import { Plots, RunPlots } from '../../kit/plots';
import type { LabState } from '../../kit/state';
import { FigureOf } from '../../kit/ui/figure';
import { Made } from '../../kit/ui/mount';
import { Button, Folded, Section } from '../../kit/ui/parts';
import { initialOptions } from '../../kit/view';
import type { ViewOptions } from '../../kit/view-options';
import { WarningList } from '../../kit/warnings';
import { DataPanel } from '../../lab/example-panel';
import { LabPage } from '../../lab/page';
import { RunControls, type RunEvents } from '../../lab/run-controls';
import { text } from '../../texts';
import type { ReconstructClient } from './client';
import type { CloudExample } from './examples';
import { FIT_ROWS, RESIDUAL_PLOT } from './measures';
import { cloudData, factsOf } from './page';
import { CloudOptions, cloudOptions, offerCameras } from './panels/cloud-options';
import { type CloudChoice, CloudSetup, CloudSetupFields } from './panels/cloud-setup';
import { EditControls, EditTools } from './panels/edit-tools';
import { KernelPlot } from './panels/kernel-plot';
import { PhaseList, phasesOf } from './panels/phases';
import { LargePhotograph, Photographs, PhotoStrip } from './panels/photo-strip';
import { TimingPanel, Timings } from './panels/timing';
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
  readonly measures = new SurfaceMeasures();
  /** What is uncertain about the fit. */
  readonly warning = signal('');
  readonly setup = new CloudSetup();
  readonly options: ViewOptions<typeof CLOUD_VIEW>;
  readonly photos = new Photographs((index) => this.#lookThrough(index));
  readonly tools = new EditTools((tool) => this.#setTool(tool !== 'none'));
  readonly plots: Plots;
  readonly timing: Timings;
  readonly #events: PartEvents;
  readonly #figure = signal<{ preset: CloudPreset | undefined; variant: CloudVariant | undefined }>({
    ...{ preset: undefined, variant: undefined },
  });
  /** Parameters whose kernel is plotted. */
  readonly #kernelParams = signal<ParamValues>({});
  readonly #phases = signal(phasesOf(new History(), false));
  /** Whether there is a complete surface. */
  readonly #hasSurface = signal(false);
  #photographs: readonly Photograph[] = [];
  #choice: ImplicitChoice | undefined;
  #params: ParamValues = {};

  constructor(root: HTMLElement, history: History, client: ReconstructClient, signal: AbortSignal, events: PartEvents) {
    this.page = new LabPage(root, signal, events, {
      viewLabel: text('reconstruct.viewLabel'),
      drop: text('reconstruct.drop'),
      admission: 'any',
      data: cloudData(<FileChooser onFiles={events.onFiles} accept={ACCEPT} admission="any" />, events.onExample),
    });
    this.run = new RunControls(this.page, events, {
      history,
      fetchMesh: (request) => client.request('export', request),
      residual: 'residual',
    });
    this.view = new ReconstructionView(this.page.canvas, initialOptions(CLOUD_VIEW));
    this.#events = events;
    this.plots = new Plots(history, [RESIDUAL_PLOT], false);
    this.timing = new Timings(client, events.onError);
    this.options = cloudOptions((options) => {
      this.view.setOptions(options);
      events.onOptions(options);
    });
    this.view.onLeave = () => this.photos.choose(undefined);
    this.page.layOut({
      name: 'reconstruct',
      options: <CloudOptions of={this.options} />,
      over: (
        <>
          <Made of={this.view.legend.element} />
          <Made of={this.view.editing.legend.element} />
        </>
      ),
      beside: <LargePhotograph of={this.photos} />,
      stage: (view, status) => (
        <>
          {view}
          {this.run.controls}
          {status}
          <FitWarning>{this.warning}</FitWarning>
          <PhotoStrip of={this.photos} />
        </>
      ),
      setup: (
        <>
          <Section title={text('reconstruct.points')}>
            <DataPanel data={this.page.data} />
            <FigureOf shown={this.#figure} onVariant={events.onVariant} />
            <CloudSetupFields state={this.setup} onChange={events.onChoice} />
          </Section>
          {this.page.paramsSection(true)}
          <Section title={text('reconstruct.sectionEdits')}>
            <EditControls state={this.tools} onClear={events.onTakeBack} />
          </Section>
        </>
      ),
      results: (
        <>
          <Section title={text('labs.sectionProgress')}>
            <PhaseList phases={this.#phases} />
          </Section>
          <Section title={text('labs.sectionSurface')}>
            <WarningList warnings={this.page.warnings} />
            <MeasureTable measures={this.measures} extra={FIT_ROWS} />
          </Section>
          {this.run.saveSection(this.view.subject, <Uses hasSurface={this.#hasSurface} events={events} />)}
          {this.run.finishSections(this.view.editing, this.measures)}
          <Section title={text('labs.sectionPlots')}>
            <RunPlots plots={this.plots} />
            <KernelPlot params={this.#kernelParams} />
            {this.run.plotData}
          </Section>
          <Folded title={text('reconstruct.sectionTiming')}>
            <TimingPanel of={this.timing} />
          </Folded>
        </>
      ),
    });
  }

  /** Shows newly opened points with their cameras and facts. */
  adopt(cloud: Cloud, photographs: Photograph[], example: CloudExample | undefined, name: string): void {
    const { points, colors, normals, warnings } = cloud;
    this.page.warnings.showData(warnings);
    this.#photographs = photographs;
    this.page.saving.name = name;
    this.measures.unit.value = '';
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
    this.warning.value = '';
  }

  /** Shows the parameters in force; hides the constants of kernels that are not in use. */
  showParams(params: ParamValues, preset: CloudPreset | undefined, variant: CloudVariant | undefined): void {
    this.#params = params;
    this.page.showParams(params);
    const isMulti = params.kernel === 'multi-order';
    this.page.hideParams({ sigma: params.kernel !== 'gaussian', delta: !isMulti, tau: !isMulti });
    this.#figure.value = { preset, variant };
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
    const chosen = delta === 'auto' && this.#choice && { delta: this.#choice.delta };
    this.#kernelParams.value = { ...this.#params, ...chosen };
  }

  /** Enables and disables controls; `surface`: whether there is a complete surface. */
  showState(state: LabState, beneath: LabState, ready: boolean, surface: boolean): void {
    const idle = this.run.showState(state, beneath, ready, surface);
    this.timing.isEnabled.value = idle;
    this.run.exports.enabled = surface;
    this.#hasSurface.value = surface;
  }

  /** Shows the phases of a run. `going`: whether it is in progress. */
  showPhases(history: History, going: boolean): void {
    this.#phases.value = phasesOf(history, going);
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

/** Buttons that need a complete surface. */
function Uses({ hasSurface, events }: { hasSurface: ReadonlySignal<boolean>; events: PartEvents }) {
  const use = (name: string, label: string, act: () => void) => (
    <Button class="wide" data-action={name} disabled={!hasSurface.value} onClick={act}>
      {label}
    </Button>
  );
  return (
    <>
      {use('volume', text('reconstruct.saveVolume'), events.onSaveVolume)}
      {use('extract', text('reconstruct.openInExtract'), events.onPassOn)}
      {use('sculpt', text('labs.openInSculpt'), events.onSculpt)}
    </>
  );
}

function FitWarning({ children }: { children: ComponentChildren }) {
  return (
    <p class="warning" role="status" data-warning="">
      {children}
    </p>
  );
}
