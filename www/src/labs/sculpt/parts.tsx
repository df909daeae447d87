import { signal } from '@preact/signals';
import type { Texture } from 'three';
import type { Warning } from '../../engine/warnings';
import { FileChooser } from '../../importers/chooser';
import { h } from '../../kit/dom';
import type { History } from '../../kit/history';
import { MeasureTable, SurfaceMeasures } from '../../kit/measures';
import { Plots } from '../../kit/plots';
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
import { EllipsoidControls, type EllipsoidEvents } from './panels/ellipsoids';
import { FilmControls, type FilmEvents } from './panels/film';
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
  readonly previewNote = h('p', { class: 'coarse', hidden: true }, text('sculpt.coarsePreview'));
  readonly options: ViewOptions<typeof SCULPT_VIEW>;
  readonly ellipsoids: EllipsoidControls;
  readonly film: FilmControls;
  readonly support: SupportControl;
  readonly plots: Plots;
  readonly #onError: PartEvents['onError'];
  readonly #figure = signal<{ preset: SculptPreset | undefined; variant: SculptVariant | undefined }>({
    ...{ preset: undefined, variant: undefined },
  });
  readonly #captions = h('div', { class: 'captions', hidden: true });
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
    this.ellipsoids = new EllipsoidControls(events);
    this.film = new FilmControls(events);
    this.support = new SupportControl(events.onSupport);
    this.plots = new Plots(history, SCULPT_PLOTS, true);
    this.options = new ViewOptions(SCULPT_VIEW, (options) => {
      this.view.setOptions(options);
      events.onOptions(options);
    });
    this.view.onCaptions = (captions) => this.#showCaptions(captions);
    this.page.layOut({
      name: 'sculpt',
      options: <OptionControls of={this.options} />,
      over: [this.view.legend.element, this.view.editing.legend.element, this.previewNote, this.#captions].map(
        (element, index) => <Made key={index} of={element} />,
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
            <Made of={this.support.element} />
            <FigureOf shown={this.#figure} onVariant={events.onVariant} />
          </Section>
          <Section title={text('sculpt.sectionEllipsoids')}>
            <Made of={this.ellipsoids.element} />
          </Section>
          <Section title={text('sculpt.sectionFilm')}>
            <Made of={this.film.element} />
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
            <Made of={this.plots.element} />
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
    this.support.hasChoice = hasChoice;
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
    this.support.show(support);
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

  #showCaptions(captions: string[]): void {
    this.#captions.hidden = captions.length === 0;
    this.#captions.replaceChildren(...captions.map((caption) => h('span', {}, caption)));
  }
}
