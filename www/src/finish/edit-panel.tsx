import type { ComponentChildren } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { callOf } from '../engine/edits';
import { sized } from '../kit/measures';
import { ParamControls } from '../kit/params';
import { Button, Help, Refusal } from '../kit/ui/parts';
import { plural, text } from '../texts';
import type { Editing, Form, Picking } from './editing';

/** The code may scroll, and the keyboard has to reach it then. */
const REACHABLE = { tabIndex: 0, role: 'region', 'aria-label': text('finish.code') } as const;
/** Largest number of components listed; the smaller ones can still be chosen by click. */
const MOST_LISTED = 100;

/** Controls that edit a surface after a run, and measure distances on it. */
export function EditPanel({ editing }: { editing: Editing }) {
  const edited = editing.edited.value;
  const hasLog = (edited?.log.length ?? 0) > 0;
  return (
    <div class="finish" aria-busy={editing.isWorking.value}>
      <Help>{text('finish.help')}</Help>
      <p class="help" role="status" data-finish="status">
        {editing.status}
      </p>
      <Refusal>{editing.error}</Refusal>
      <div class="buttons">
        <Act {...{ editing, name: 'undo', act: editing.undo, isOffered: edited?.undoable === true }}>
          {text('controls.undo')}
        </Act>
        <Act {...{ editing, name: 'redo', act: editing.redo, isOffered: (edited?.undone.length ?? 0) > 0 }}>
          {text('controls.redo')}
        </Act>
        <Button data-finish="cancel" disabled={!editing.isWorking.value} onClick={editing.cancel}>
          {text('controls.cancel')}
        </Button>
      </div>
      <ol class="edit-log" aria-label={text('finish.log')}>
        {edited?.log.map((edit, index) => (
          <li key={index}>
            <code>{callOf(edit)}</code>
          </li>
        ))}
      </ol>
      <details hidden={!hasLog}>
        <summary>{text('finish.code')}</summary>
        <pre class="code" {...REACHABLE}>
          {editing.code}
        </pre>
        <div class="buttons">
          <Act {...{ editing, name: 'copy', act: editing.copy }}>{text('finish.copy')}</Act>
          <Act {...{ editing, name: 'save-initial', act: editing.saveInitial }}>{text('finish.saveInitial')}</Act>
        </div>
        <Help>{text('finish.codeHelp')}</Help>
      </details>
      <Operations editing={editing} />
    </div>
  );
}

function Operations({ editing }: { editing: Editing }) {
  const act = (name: string, label: string, act: () => Promise<void>) => <Act {...{ editing, name, act }}>{label}</Act>;
  return (
    <>
      <Group title={text('finish.sampling')} form={editing.decimation}>
        {act('decimate', text('finish.decimate'), editing.decimate)}
      </Group>
      <Group form={editing.bounded}>{act('decimate-within', text('finish.bounded'), editing.decimateWithin)}</Group>
      <Group form={editing.remeshing}>{act('remesh', text('finish.remesh'), editing.remesh)}</Group>
      <Group title={text('finish.smoothing')} form={editing.smoothing}>
        {act('smooth', text('finish.smooth'), editing.smooth)}
      </Group>
      <Group title={text('finish.components')} controls={<Components editing={editing} />}>
        {act('keep', text('finish.keep'), editing.keep)}
        {act('delete', text('finish.delete'), editing.remove)}
        {act('keep-largest', text('finish.keepLargest'), editing.keepLargest)}
        {act('fill', text('finish.fill'), editing.fill)}
      </Group>
      <Picker editing={editing} picking="choose" label={text('finish.choose')} />
      <Help>{text('finish.componentsHelp')}</Help>
      <Group title={text('finish.cutting')} form={editing.cutting} onChange={() => void editing.preview()}>
        {act('preview', text('finish.preview'), editing.preview)}
        {act('cut', text('finish.cut'), editing.cut)}
      </Group>
      <h3>{text('finish.measuring')}</h3>
      <Picker editing={editing} picking="measure" label={text('finish.measure')} />
      <p class="help" role="status" data-finish="distance">
        {editing.distance}
      </p>
      <Help>{text('finish.measureHelp')}</Help>
    </>
  );
}

interface ActProps {
  editing: Editing;
  name: string;
  act: () => Promise<void>;
  /** Whether there is something to do, besides that the surface can be edited. */
  isOffered?: boolean;
  children: string;
}

/** A button of an operation. */
function Act({ editing, name, act, isOffered = true, children }: ActProps) {
  return (
    <Button data-finish={name} disabled={!editing.isIdle.value || !isOffered} onClick={() => void act()}>
      {children}
    </Button>
  );
}

interface GroupProps {
  title?: string;
  form?: Form;
  controls?: ComponentChildren;
  onChange?: () => void;
  /** The buttons. */
  children: ComponentChildren;
}

/** An operation: its settings and its buttons. */
function Group({ title, form, controls, onChange, children }: GroupProps) {
  const change =
    ({ params }: Form) =>
    (name: string, value: unknown) => {
      params.show({ [name]: value });
      onChange?.();
    };
  return (
    <div>
      {title && <h3>{title}</h3>}
      {form ? <ParamControls params={form.params} skip={[]} onChange={change(form)} /> : controls}
      <div class="buttons">{children}</div>
    </div>
  );
}

/** A checkbox that passes clicks on the surface on; only one of them is checked at a time. */
function Picker({ editing, picking, label }: { editing: Editing; picking: Picking; label: string }) {
  return (
    <label>
      <input
        type="checkbox"
        aria-label={label}
        checked={editing.picking.value === picking}
        disabled={!editing.isIdle.value}
        onChange={({ currentTarget }) => void editing.pick(currentTarget.checked ? picking : undefined)}
      />{' '}
      {label}
    </label>
  );
}

/** List of a surface's connected components, from the largest volume on, of which some are chosen. */
function Components({ editing }: { editing: Editing }) {
  const [all, unit] = [editing.edited.value?.components ?? [], editing.unit.value];
  const boxes = useRef(new Map<number, HTMLInputElement>());
  const clicked = editing.clicked.value;
  useLayoutEffect(() => {
    if (clicked !== undefined) boxes.current.get(clicked)?.scrollIntoView({ block: 'nearest' });
  }, [clicked, editing.chosen.value]);
  const sizeOf = (index: number, rank: number) => {
    const { vertices = 0, volume = 0, area = 0 } = all[index] ?? {};
    const sizes = { rank: rank + 1, volume: sized(volume, 3, unit), area: sized(area, 2, unit) };
    return text('finish.component', { ...sizes, vertices: plural('counts.vertex', vertices) });
  };
  return (
    <ul class="components" aria-label={text('finish.components')}>
      {editing.ranked.value.slice(0, MOST_LISTED).map((index, rank) => (
        <li key={index}>
          <label>
            <input
              type="checkbox"
              data-component={index}
              checked={editing.chosen.value.has(index)}
              ref={(box) => {
                if (box) boxes.current.set(index, box);
                else boxes.current.delete(index);
              }}
              onChange={({ currentTarget }) => editing.choose(index, currentTarget.checked)}
            />{' '}
            {sizeOf(index, rank)}
          </label>
        </li>
      ))}
    </ul>
  );
}
