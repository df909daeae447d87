import { callOf, toCode } from '../engine/edits';
import { shortened } from '../engine/placing';
import type { Edit, ParamSpec, ParamValues, SurfacePoint, Unit, Vec3 } from '../engine/protocol';

import { h } from '../kit/dom';
import { download } from '../kit/download';
import { figure } from '../kit/format';
import { ParamControls, Params } from '../kit/params';
import { elementOf } from '../kit/ui/mount';
import type { EditedView } from '../scene/edited-view';
import { plural, text } from '../texts';
import { ComponentList } from './component-list';
import { type Finishing, isCancelled } from './finishing';
import type { Edited } from './protocol';

/** Name under which the surface before the edits is saved, and the program for them reads it. */
const INITIAL = 'surface.ply';
/** Ratio of the bounds of edge lengths of remeshing to the length given, and its inverse. */
const SPREAD = 1.5;
const AXES = ['x', 'y', 'z'];
const SIDES = [text('finish.below'), text('finish.above')];

/** Controls that edit a surface after a run, and measure distances on it. */
export class EditPanel {
  readonly element: HTMLElement;
  /** Unit of length, or empty. */
  unit: Unit = '';
  readonly #finishing: Finishing;
  readonly #view: EditedView;
  readonly #buttons: HTMLButtonElement[] = [];
  readonly #components = new ComponentList();
  readonly #status = h('p', { class: 'help', role: 'status', 'data-finish': 'status' });
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #log = h('ol', { class: 'edit-log', 'aria-label': text('finish.log') });
  readonly #code = h('pre', { class: 'code', tabindex: 0, 'aria-label': text('finish.code') });
  readonly #codeHolder: HTMLElement;
  readonly #distance = h('p', { class: 'help', role: 'status', 'data-finish': 'distance' });
  readonly #undo = this.#button('undo', text('controls.undo'), () => this.#change('undo'));
  readonly #redo = this.#button('redo', text('controls.redo'), () => this.#change('redo'));
  readonly #cancel = h(
    'button',
    { type: 'button', 'data-finish': 'cancel', disabled: true, onclick: () => this.#finishing.cancel() },
    text('controls.cancel'),
  );
  readonly #decimation: ParamValues = { targetTriangles: 1000 };
  readonly #bounded: ParamValues = { maxDistance: 0.1 };
  readonly #remeshing: ParamValues = { edge: 1 };
  readonly #smoothing: ParamValues = { iterations: 10, keepVolume: true };
  readonly #cutting: ParamValues = { axis: 'z', position: 50, side: SIDES[0] };
  readonly #decimationForm: Form;
  readonly #boundedForm: Form;
  readonly #remeshingForm: Form;
  readonly #measuring: HTMLInputElement;
  readonly #choosing: HTMLInputElement;
  #from: SurfacePoint | undefined;
  #enabled = false;
  #unfolded = false;
  /** Number of tasks in progress, and of those during which no other may begin. */
  #working = 0;
  #blocking = 0;

  constructor(finishing: Finishing, view: EditedView) {
    this.#finishing = finishing;
    this.#view = view;
    this.#decimationForm = form(this.#decimation, [
      spec('targetTriangles', 'integer', text('finish.triangles'), text('finish.decimateHelp'), { min: 1 }),
    ]);
    this.#boundedForm = form(this.#bounded, [
      spec('maxDistance', 'number', text('finish.distance'), text('finish.boundedHelp'), { min: 0 }),
    ]);
    this.#remeshingForm = form(this.#remeshing, [
      spec('edge', 'number', text('finish.edge'), text('finish.remeshHelp')),
    ]);
    this.#choosing = this.#picker(text('finish.choose'), (at) => this.#components.toggle(at.triangle));
    this.#measuring = this.#picker(text('finish.measure'), (at) => void this.#measure(at));
    const save = this.#button('save-initial', text('finish.saveInitial'), async () => this.#saveInitial());
    const copy = this.#button('copy', text('finish.copy'), () => this.#copy());
    this.#codeHolder = h(
      'details',
      { hidden: true },
      h('summary', {}, text('finish.code')),
      this.#code,
      h('div', { class: 'buttons' }, copy, save),
      h('p', { class: 'help' }, text('finish.codeHelp')),
    );
    this.element = h(
      'div',
      { class: 'finish' },
      h('p', { class: 'help' }, text('finish.help')),
      this.#status,
      this.#error,
      h('div', { class: 'buttons' }, this.#undo, this.#redo, this.#cancel),
      this.#log,
      this.#codeHolder,
      ...this.#operations(),
    );
    this.show(undefined);
  }

  /** Whether there is a surface to edit. */
  set enabled(enabled: boolean) {
    const begins = enabled && !this.#enabled;
    this.#enabled = enabled;
    this.#enable();
    if (begins) void this.#open();
  }

  /** Whether the panel is unfolded: it then shows the components of the surface. */
  set unfolded(unfolded: boolean) {
    this.#unfolded = unfolded;
    void this.#open();
  }

  /** Shows the surface after an edit; undefined if there is none. */
  show(edited: Edited | undefined): void {
    this.#from = undefined;
    this.#distance.textContent = '';
    this.#view.showLines([]);
    this.#components.show(edited, this.unit);
    const log = edited?.log ?? [];
    this.#log.replaceChildren(...log.map((edit) => h('li', {}, h('code', {}, callOf(edit)))));
    this.#code.textContent = toCode(log, INITIAL);
    this.#codeHolder.hidden = log.length === 0;
    if (edited) this.#suggest(edited);
    else this.#endPicking();
    this.#enable();
  }

  async #open(): Promise<void> {
    if (!this.#enabled || !this.#unfolded || this.#working > 0 || this.#finishing.edited) return;
    // Controls stay enabled meanwhile: a button that is disabled while it is pressed loses the click.
    await this.attempt(() => this.#finishing.open(), { blocking: false });
  }

  #operations(): HTMLElement[] {
    const smoothing = form(this.#smoothing, [
      spec('iterations', 'integer', text('finish.iterations'), text('finish.smoothHelp'), { min: 0 }),
      spec('keepVolume', 'boolean', text('finish.keepVolume'), text('finish.keepVolumeHelp')),
    ]);
    const cutting = form(
      this.#cutting,
      [
        spec('axis', 'choice', text('finish.axis'), text('finish.axisHelp'), { choices: AXES }),
        spec('position', 'number', text('finish.position'), text('finish.positionHelp'), {
          min: 0,
          max: 100,
          unit: '%',
        }),
        spec('side', 'choice', text('finish.side'), text('finish.sideHelp'), { choices: SIDES }),
      ],
      () => void this.#preview(),
    );
    const edit = (name: string, label: string, make: () => Edit) =>
      this.#button(name, label, () => this.#change('edit', make));
    const keep = (indices: number[]): Edit => ({ op: 'keepComponents', indices });
    return [
      group(text('finish.sampling'), this.#decimationForm.element, [
        edit('decimate', text('finish.decimate'), () => ({ op: 'decimate', ...this.#decimation }) as Edit),
      ]),
      group('', this.#boundedForm.element, [
        edit('decimate-within', text('finish.bounded'), () => ({ op: 'decimateWithin', ...this.#bounded }) as Edit),
      ]),
      group('', this.#remeshingForm.element, [edit('remesh', text('finish.remesh'), () => this.#remesh())]),
      group(text('finish.smoothing'), smoothing.element, [
        edit('smooth', text('finish.smooth'), () => ({ op: 'smooth', ...this.#smoothing }) as Edit),
      ]),
      group(text('finish.components'), this.#components.element, [
        edit('keep', text('finish.keep'), () => keep(this.#components.chosen.chosen)),
        edit('delete', text('finish.delete'), () => keep(this.#components.chosen.others)),
        edit('keep-largest', text('finish.keepLargest'), () => keep([this.#components.largest])),
        edit('fill', text('finish.fill'), () => ({ op: 'removeCavities' })),
      ]),
      h('label', {}, this.#choosing, ' ', text('finish.choose')),
      h('p', { class: 'help' }, text('finish.componentsHelp')),
      group(text('finish.cutting'), cutting.element, [
        this.#button('preview', text('finish.preview'), () => this.#preview()),
        edit('cut', text('finish.cut'), () => ({ op: 'cut', ...this.#plane() })),
      ]),
      h('h3', {}, text('finish.measuring')),
      h('label', {}, this.#measuring, ' ', text('finish.measure')),
      this.#distance,
      h('p', { class: 'help' }, text('finish.measureHelp')),
    ];
  }

  #button(name: string, label: string, act: () => Promise<void>): HTMLButtonElement {
    const button = h('button', { type: 'button', 'data-finish': name, onclick: () => void act() }, label);
    this.#buttons.push(button);
    return button;
  }

  /** Creates a checkbox that passes clicks on the surface to `take`; only one of them is checked at a time. */
  #picker(label: string, take: (at: SurfacePoint) => void): HTMLInputElement {
    const box = h('input', { type: 'checkbox', 'aria-label': label });
    box.addEventListener('change', async () => {
      for (const other of [this.#choosing, this.#measuring]) if (other !== box) other.checked = false;
      this.#view.pick(undefined);
      this.#view.showLines([]);
      if (box.checked && (await this.attempt(() => this.#finishing.open()))) this.#view.pick(take);
    });
    return box;
  }

  #endPicking(): void {
    for (const box of [this.#choosing, this.#measuring]) box.checked = false;
    this.#view.pick(undefined);
  }

  /** Proposes half the triangles, and the present length of edges. */
  #suggest({ measures: { info } }: Edited): void {
    this.#decimation.targetTriangles = Math.max(4, Math.round(info.triangles / 2));
    this.#bounded.maxDistance = Number((info.edge.mean / 10).toPrecision(2));
    this.#remeshing.edge = Number(info.edge.mean.toPrecision(3));
    this.#decimationForm.show();
    this.#boundedForm.show();
    this.#remeshingForm.show();
  }

  #enable(): void {
    const { edited } = this.#finishing;
    const idle = this.#enabled && this.#blocking === 0;
    this.element.setAttribute('aria-busy', String(this.#working > 0));
    for (const button of this.#buttons) button.disabled = !idle;
    this.#undo.disabled ||= !edited?.undoable;
    this.#redo.disabled ||= !edited?.undone.length;
    this.#cancel.disabled = this.#working === 0;
    this.#choosing.disabled = !idle;
    this.#measuring.disabled = !idle;
  }

  /** Changes the surface; `make` is called when it is open, as most edits depend on it. */
  async #change(kind: 'edit' | 'undo' | 'redo', make: () => Edit | undefined = () => undefined): Promise<void> {
    await this.attempt(async () => {
      await this.#finishing.open();
      const edit = make();
      await this.#finishing.change(kind, (edit && { edit }) as never);
      const { info } = this.#finishing.edited?.measures ?? {};
      if (info)
        this.#status.textContent = text('finish.done', { triangles: plural('counts.triangle', info.triangles) });
    });
  }

  /**
   * Does some work; controls are disabled meanwhile if it is `blocking`. An error is shown, with what `state` says of the
   * surface then: by default, nothing has changed. Returns whether the work was done.
   */
  async attempt(
    work: () => Promise<unknown>,
    { blocking = true, state = () => text('finish.unchanged') } = {},
  ): Promise<boolean> {
    this.#error.textContent = '';
    this.#status.textContent = text('finish.working');
    const focused = document.activeElement;
    this.#count(1, blocking);
    try {
      await work();
      if (this.#working === 1 && this.#status.textContent === text('finish.working')) this.#status.textContent = '';
      return true;
    } catch (error) {
      const reason = error instanceof Error ? error.message : String(error);
      this.#status.textContent = isCancelled(error) ? text('finish.cancelled', { state: state() }) : '';
      this.#error.textContent = isCancelled(error) ? '' : text('finish.refused', { state: state(), reason });
      return false;
    } finally {
      this.#count(-1, blocking);
      // Buttons lose the focus when they are disabled, as Cancel is now; it comes back when they are enabled.
      const { activeElement } = document;
      const isLost = activeElement === document.body || activeElement === this.#cancel;
      if (isLost && this.#blocking === 0 && focused instanceof HTMLElement) focused.focus();
    }
  }

  #count(change: 1 | -1, blocking: boolean): void {
    this.#working += change;
    if (blocking) this.#blocking += change;
    this.#enable();
  }

  #remesh(): Edit {
    const edge = Number(this.#remeshing.edge);
    const [min, max] = [edge / SPREAD, edge * SPREAD].map((bound) => Number(bound.toPrecision(4)));
    return { op: 'remesh', min: min ?? 0, max: max ?? 0 };
  }

  /** Returns the plane of the cut, whose normal points to the side to be removed. */
  #plane(): { origin: Vec3; normal: Vec3 } {
    const axis = AXES.indexOf(String(this.#cutting.axis));
    const { min, max } = this.#finishing.edited?.measures.info.bounds ?? { min: [0, 0, 0], max: [0, 0, 0] };
    const size = Math.max(...min.map((low, k) => (max[k] ?? 0) - low));
    const along = (k: number, part: number) => {
      const low = min[k] ?? 0;
      return shortened(low + part * ((max[k] ?? 0) - low), 6, size);
    };
    const origin = min.map((_, k) => along(k, k === axis ? 0.01 * Number(this.#cutting.position) : 0.5)) as Vec3;
    const normal: Vec3 = [0, 0, 0];
    normal[axis] = this.#cutting.side === SIDES[0] ? 1 : -1;
    return { origin, normal };
  }

  async #preview(): Promise<void> {
    if (!this.#enabled || this.#blocking > 0) return;
    await this.attempt(async () => {
      await this.#finishing.open();
      this.#view.showLines(await this.#finishing.request('section', this.#plane()));
    });
  }

  async #measure(at: SurfacePoint): Promise<void> {
    const from = this.#from;
    this.#from = from ? undefined : at;
    if (!from) {
      this.#distance.textContent = text('finish.secondPoint');
      return;
    }
    this.#view.showLines([...from.point, ...at.point]);
    await this.attempt(async () => {
      const { straight, geodesic } = await this.#finishing.request('measure', [from, at]);
      const [a, b] = [straight, geodesic].map((length) => `${figure(length)} ${this.unit}`.trim());
      this.#distance.textContent = Number.isFinite(geodesic)
        ? text('finish.distances', { straight: a ?? '', geodesic: b ?? '' })
        : text('finish.apart', { straight: a ?? '' });
    });
  }

  #saveInitial(): void {
    if (this.#finishing.initial) download(INITIAL, this.#finishing.initial, 'application/octet-stream');
  }

  async #copy(): Promise<void> {
    await this.attempt(async () => {
      await navigator.clipboard.writeText(this.#code.textContent ?? '');
      this.#status.textContent = text('finish.copied');
    });
  }
}

function spec(
  name: string,
  type: ParamSpec['type'],
  label: string,
  help: string,
  more: Partial<ParamSpec> = {},
): ParamSpec {
  return { name, type, label, help, default: undefined, ...more };
}

interface Form {
  element: HTMLElement;
  /** Shows the values. */
  show: () => void;
}

/** Creates controls that keep `values` up to date. */
function form(values: ParamValues, specs: ParamSpec[], onChange: () => void = () => undefined): Form {
  const params = new Params();
  const show = () => params.show(values);
  params.specs.value = specs;
  show();
  const change = (name: string, value: unknown) => {
    values[name] = value;
    show();
    onChange();
  };
  return { element: elementOf(<ParamControls params={params} skip={[]} onChange={change} />), show };
}

function group(title: string, controls: HTMLElement, buttons: HTMLButtonElement[]): HTMLElement {
  return h('div', {}, ...(title ? [h('h3', {}, title)] : []), controls, h('div', { class: 'buttons' }, ...buttons));
}
