import { text } from '../texts';
import { h, uniqueId } from './dom';

/** The question that is asked: another one takes its place. */
let asked: HTMLDialogElement | undefined;

/**
 * Asks a question in a dialog: what is lost if the user goes on. Resolves to whether they do; `go` is the label of the button
 * for that. Dialogs of the browser are not used: pages that embed the app in a frame may not have them.
 */
export function mayLose(title: string, losses: readonly string[], go: string): Promise<boolean> {
  asked?.close('');
  const id = uniqueId('question');
  const stay = h('button', { value: '', class: 'primary', autofocus: true }, text('work.stay'));
  const dialog = h(
    'dialog',
    { class: 'question', role: 'alertdialog', 'aria-labelledby': id, 'aria-describedby': `${id}-text` },
    h('h2', { id }, title),
    h('p', { id: `${id}-text` }, [...losses, text('work.hint')].join(' ')),
    h('form', { method: 'dialog' }, stay, h('button', { value: 'go' }, go)),
  );
  document.body.append(dialog);
  asked = dialog;
  return new Promise((resolve) => {
    dialog.addEventListener('close', () => {
      if (asked === dialog) asked = undefined;
      dialog.remove();
      resolve(dialog.returnValue === 'go');
    });
    dialog.showModal();
  });
}
