import { text } from '../texts';
import { h } from './dom';
import { DOCUMENTATION } from './guides';
import type { TransportEvents } from './transport';

export interface Shortcut {
  key: string;
  /** Whether Ctrl, or ⌘, has to be pressed. */
  ctrl?: boolean;
  shown: string;
  text: string;
  act: () => void;
}

const VIEW_KEYS: [string, string][] = [
  ['← → ↑ ↓', text('controls.keyTurn')],
  ['+ −', text('controls.keyZoom')],
  [text('controls.keyHomeName'), text('controls.keyHome')],
  [text('controls.keyTabName'), text('controls.keyTab')],
];

/** Keys of a slice's slider; not all labs have slices. */
const SLICE_KEYS: [string, string][] = [
  ['+ − 0', text('controls.keySliceZoom')],
  ['⇧ ← → ↑ ↓', text('controls.keySlicePan')],
];

/**
 * Returns the keyboard shortcuts of a lab: those for its run, where `toggleText` describes the space key, then the
 * lab's `own` ones, then undo and redo.
 */
export function labShortcuts(
  { onToggle, onStep, onReset, onUndo, onRedo }: TransportEvents,
  own: Shortcut[] = [],
  toggleText = text('labs.playOrPause'),
): Shortcut[] {
  return [
    { key: ' ', shown: text('labs.keySpace'), text: toggleText, act: onToggle },
    { key: 's', shown: 's', text: text('labs.oneStep'), act: () => onStep(1) },
    { key: 'd', shown: 'd', text: text('labs.tenSteps'), act: () => onStep(10) },
    { key: 'r', shown: 'r', text: text('labs.resetKey'), act: onReset },
    ...own,
    { key: 'z', ctrl: true, shown: text('labs.keyUndo'), text: text('labs.undo'), act: onUndo },
    { key: 'shift+z', ctrl: true, shown: text('labs.keyRedo'), text: text('labs.redo'), act: onRedo },
    { key: 'y', ctrl: true, shown: text('labs.keyRedoToo'), text: text('labs.redo'), act: onRedo },
  ];
}

/**
 * Installs the keyboard shortcuts of a lab and a dialog that lists them, opened by `?` or by the button `opener`, with
 * links to further help; both are removed when `signal` is aborted.
 */
export function offerShortcuts(shortcuts: Shortcut[], opener: HTMLElement, guide: string, signal: AbortSignal): void {
  const list: Shortcut = { key: '?', shown: '?', text: text('controls.keyList'), act: () => dialog.showModal() };
  const dialog = shortcutDialog([...shortcuts, list], opener, guide, signal);
  document.body.append(dialog);
  listenForShortcuts([...shortcuts, list], signal);
}

/** Handles shortcuts anywhere on the page, until `signal` is aborted, unless the focused element uses the key. */
function listenForShortcuts(shortcuts: Shortcut[], signal: AbortSignal): void {
  const typing = new Typing(signal);
  const onKey = (event: KeyboardEvent) => {
    if (event.altKey || event.repeat) return;
    const withCtrl = event.ctrlKey || event.metaKey;
    const pressed = withCtrl && event.shiftKey ? `shift+${event.key.toLowerCase()}` : event.key;
    const shortcut = shortcuts.find(({ key, ctrl = false }) => key === pressed && ctrl === withCtrl);
    if (!shortcut || (withCtrl ? typing.isIn(event.target) : isTakenBy(event))) return;
    event.preventDefault();
    shortcut.act();
  };
  window.addEventListener('keydown', onKey, { signal });
}

/**
 * Tracks which field contains typing that is not committed yet: there Ctrl+Z undoes the typing, not a step of the lab.
 */
class Typing {
  #field: EventTarget | null = null;

  constructor(signal: AbortSignal) {
    const begin = ({ target }: Event) => {
      this.#field = target;
    };
    const forget = () => {
      this.#field = null;
    };
    window.addEventListener('input', begin, { signal });
    for (const end of ['change', 'blur']) window.addEventListener(end, forget, { capture: true, signal });
  }

  isIn(target: EventTarget | null): boolean {
    return (
      target !== null && target === this.#field && !(target instanceof HTMLInputElement && target.type === 'range')
    );
  }
}

const UNTYPED = ['range', 'checkbox', 'radio'];

/**
 * Returns whether the focused element uses the pressed key itself, so that it is no shortcut: space presses buttons,
 * letters are typed into fields and select in lists, and dialogs use all keys.
 */
function isTakenBy({ target, key }: KeyboardEvent): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest('dialog, select, textarea, [contenteditable]')) return true;
  if (target instanceof HTMLInputElement && key !== 'Escape')
    return !UNTYPED.includes(target.type) || (key === ' ' && target.type !== 'range');
  return key === ' ' && target.closest('button, summary, a, label.button') !== null;
}

/**
 * Creates the dialog that lists the keyboard shortcuts, opened by the button `opener`; removed when `signal` is
 * aborted.
 */
function shortcutDialog(
  shortcuts: Shortcut[],
  opener: HTMLElement,
  guide: string,
  signal: AbortSignal,
): HTMLDialogElement {
  const row = ([key, text]: [string, string], name = '') =>
    h('div', { class: name }, h('dt', {}, h('kbd', {}, key)), h('dd', {}, text));
  const list = h(
    'dl',
    { class: 'keys' },
    ...[...shortcuts.map(({ shown, text }): [string, string] => [shown, text]), ...VIEW_KEYS].map((keys) => row(keys)),
    ...SLICE_KEYS.map((keys) => row(keys, 'slice-keys')),
  );
  const form = h('form', { method: 'dialog' }, h('button', { class: 'primary' }, text('controls.close')));
  const dialog = h(
    'dialog',
    { 'aria-labelledby': 'keys-title' },
    h('h2', { id: 'keys-title' }, text('controls.keyboardShortcuts')),
    list,
    furtherHelp(guide),
    form,
  );
  opener.addEventListener('click', () => dialog.showModal(), { signal });
  signal.addEventListener('abort', () => dialog.remove());
  return dialog;
}

/**
 * Creates the list of links to the documentation and other pages; they open in new tabs, so that the lab keeps its
 * model.
 */
function furtherHelp(guide: string): HTMLElement {
  const link = (href: string, text: string) => h('li', {}, h('a', { class: 'link', href, target: '_blank' }, text));
  return h(
    'nav',
    { 'aria-labelledby': 'further-title' },
    h('h3', { id: 'further-title' }, text('controls.furtherHelp')),
    h(
      'ul',
      { class: 'further-help' },
      link(guide, text('controls.howLabWorks')),
      link(DOCUMENTATION, text('controls.documentation')),
      link('./bench.html', text('controls.benchmarks')),
      link('./embed/index.html', text('controls.integrations')),
      link('./licences.txt', text('controls.licences')),
    ),
  );
}
