import { type ReadonlySignal, signal } from '@preact/signals';
import type { Texture } from 'three';
import type { Warning } from '../../engine/warnings';
import { FileChooser } from '../../importers/chooser';
import type { History } from '../../kit/history';
import { MeasureTable, SurfaceMeasures } from '../../kit/measures';
import { Plots, RunPlots } from '../../kit/plots';
import type { LabState } from '../../kit/state';
import { FigureOf } from '../../kit/ui/figure';
import { Made } from '../../kit/ui/mount';
import { Section } from '../../kit/ui/parts';
import { initialOptions } from '../../kit/view';
import { OptionControls, ViewOptions } from '../../kit/view-options';
import { WarningList } from '../../kit/warnings';
import { DataPanel } from '../../lab/example-panel';
import { LabPage } from '../../lab/page';
import { RunControls, type RunEvents } from '../../lab/run-controls';
import { text } from '../../texts';
import { SurfaceCarrier } from './carrier';
import type { SculptClient } from './client';
import { DragLatency } from './drag-latency';
import type { SculptExample } from './examples';
import { SCULPT_PLOTS, SCULPT_ROWS } from './measures';
import { ACCEPT } from './mesh-files';
import { factsOf, sceneData } from './page';
import { EllipsoidControls, type EllipsoidEvents, Ellipsoids } from './panels/ellipsoids';
import { FilmControls, type FilmEvents, FilmState } from './panels/film';
import { offerLayouts, offerTexture } from './panels/options';
import { SupportControl } from './panels/support';
import { pictureOf } from './picture';
import { posesOf, type SculptPreset, type SculptVariant } from './presets';
import type { MeshTexture, OpenedScene, ParamValues, Support } from './protocol';
import { SculptureView } from './scene';
import { SCULPT_VIEW, type SculptViewOptions } from './view';

/** Parameters that have an effect on a membrane alone. */
const OF_MEMBRANES = ['levels', 'refineFactor', 'smoothing', 'distribute', 'supersample', 'energy', 'topology'];

export interface PartEvents extends RunEvents<SculptExample>, EllipsoidEvents, FilmEvents {
  onVariant: (preset: SculptPreset, variant: SculptVariant) => void;
  onSupport: (support: Support) => void;
  onOptions: (options: SculptViewOptions) => void;
}

/** Controls and views of the Sculpt lab. */
export class SculptParts {
  readonly page: LabPage<SculptExample>;
  readonly run: RunControls;

  readonly view: SculptureView;
  readonly carrier: SurfaceCarrier;
  readonly latency = new DragLatency();
  readonly measures = new SurfaceMeasures();
  /** Whether the surface that is drawn is a coarse preview. */
  readonly isPreview = signal(false);
  readonly options: ViewOptions<typeof SCULPT_VIEW>;
  readonly ellipsoids = new Ellipsoids();
  readonly film = new FilmState();
  readonly #support = signal<Support>('membrane');
  /** Whether there is a choice of what supports the surface. */
  readonly #hasChoice = signal(false);
  readonly plots: Plots;
  readonly #onError: PartEvents['onError'];
  readonly #figure = signal<{ preset: SculptPreset | undefined; variant: SculptVariant | undefined }>({
    ...{ preset: undefined, variant: undefined },
  });
  /** Captions of the surfaces side by side. */
  readonly #captions = signal<readonly string[]>([]);
  /** Counts textures, so that one that is still being decoded does not replace a newer one. */
  #pictures = 0;
  #texture: Texture | undefined;

  constructor(root: HTMLElement, history: History, client: SculptClient, signal: AbortSignal, events: PartEvents) {
    this.page = new LabPage(root, signal, events, {
      viewLabel: text('sculpt.viewLabel'),
      drop: text('sculpt.drop'),
      admission: 'any',
      data: sceneData(<FileChooser onFiles={events.onFiles} accept={ACCEPT} admission="any" />, events.onExample),
    });
    this.run = new RunControls(this.page, events, {
      history,
      fetchMesh: (request) => client.request('export', request),
      residual: 'unrest',
    });
    this.view = new SculptureView(this.page.canvas, initialOptions(SCULPT_VIEW));
    this.carrier = new SurfaceCarrier(this.view);
    this.#onError = events.onError;
    this.plots = new Plots(history, SCULPT_PLOTS, true);
    this.options = new ViewOptions(SCULPT_VIEW, (options) => {
      this.view.setOptions(options);
      events.onOptions(options);
    });
    this.view.onCaptions = (captions) => {
      this.#captions.value = captions;
    };
    this.page.layOut({
      name: 'sculpt',
      options: <OptionControls of={this.options} />,
      over: (
        <>
          <Made of={this.view.legend.element} />
          <Made of={this.view.editing.legend.element} />
          <PreviewNote isShown={this.isPreview} />
          <Captions captions={this.#captions} />
        </>
      ),
      stage: (view, status) => (
        <>
          {view}
          {this.run.controls}
          {status}
        </>
      ),
      setup: (
        <>
          <Section title={text('sculpt.sectionScene')}>
            <DataPanel data={this.page.data} />
            <SupportControl support={this.#support} hasChoice={this.#hasChoice} onSupport={events.onSupport} />
            <FigureOf shown={this.#figure} onVariant={events.onVariant} />
          </Section>
          <Section title={text('sculpt.sectionEllipsoids')}>
            <EllipsoidControls state={this.ellipsoids} events={events} />
          </Section>
          <Section title={text('sculpt.sectionFilm')}>
            <FilmControls state={this.film} events={events} />
          </Section>
          {this.page.paramsSection()}
        </>
      ),
      results: (
        <>
          <Section title={text('labs.sectionSurface')}>
            <WarningList warnings={this.page.warnings} />
            <MeasureTable measures={this.measures} extra={SCULPT_ROWS} />
          </Section>
          {this.run.saveSection(this.view.subject)}
          {this.run.finishSections(this.view.editing, this.measures)}
          <Section title={text('labs.sectionPlots')}>
            <RunPlots plots={this.plots} />
            {this.run.plotData}
          </Section>
        </>
      ),
    });
  }

  /** Shows a newly opened scene: meshes with their texture, ellipsoids and facts, and warnings `known` before. */
  adopt(
    { box, start, pose, detail, bands, hasChoice, buildMs, texture, warnings }: OpenedScene,
    example: SculptExample | undefined,
    name: string,
    known: readonly Warning[] = [],
  ): void {
    this.page.saving.name = example?.id ?? name;
    this.page.warnings.showData(known, warnings);
    this.measures.unit.value = '';
    this.#hasChoice.value = hasChoice;
    this.view.setScene(box, example?.up ?? 'y', start, [pose, ...posesOf(example)]);
    this.#showTexture(texture);
    this.page.data.show(factsOf({ name, detail, bands, buildMs }), example);
  }

  /** Decodes and shows a texture. If that fails, the surface stays without one. */
  #showTexture(texture: MeshTexture | undefined): void {
    this.#pictures += 1;
    const turn = this.#pictures;
    this.view.texture = null;
    this.#texture?.dispose();
    this.#texture = undefined;
    offerTexture(this.options, texture !== undefined);
    if (!texture) return;
    pictureOf(texture).then(
      (picture) => {
        if (turn !== this.#pictures) return;
        this.#texture = picture;
        this.view.texture = picture;
      },
      (error) => this.#onError(text('sculpt.textureFailed'), error),
    );
  }

  showSupport(support: Support): void {
    this.#support.value = support;
    offerLayouts(this.options, support === 'membrane');
    this.page.hideParams(Object.fromEntries(OF_MEMBRANES.map((name) => [name, support === 'surface'])));
  }

  showParams(params: ParamValues, preset: SculptPreset | undefined, variant: SculptVariant | undefined): void {
    this.page.showParams(params);
    this.#figure.value = { preset, variant };
  }

  /**
   * Enables and disables controls according to the lab's state; `canPlay`: whether there is a film, which can be played
   * even when the model has converged.
   */
  showState(state: LabState, beneath: LabState, ready: boolean, canPlay: boolean): void {
    const idle = this.run.showState(state, beneath === 'done' && canPlay ? 'paused' : beneath, ready);
    // Saving pauses a run, which would then not go on to the same pose.
    this.page.canSave.value = idle && beneath !== 'running';
  }

  dispose(): void {
    this.run.dispose();
    this.#texture?.dispose();
    this.view.dispose();
  }
}

/** Says that a preview is coarser than the surface. */
function PreviewNote({ isShown }: { isShown: ReadonlySignal<boolean> }) {
  return (
    <p class="coarse" hidden={!isShown.value}>
      {text('sculpt.coarsePreview')}
    </p>
  );
}

/** Captions of the surfaces side by side, if there are several. */
function Captions({ captions }: { captions: ReadonlySignal<readonly string[]> }) {
  return (
    <div class="captions" hidden={captions.value.length === 0}>
      {captions.value.map((caption) => (
        <span key={caption}>{caption}</span>
      ))}
    </div>
  );
}
