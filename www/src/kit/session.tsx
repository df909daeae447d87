import type { ReadonlySignal } from '@preact/signals';
import { useRef } from 'preact/hooks';
import { text } from '../texts';
import { useId } from './ui/id';
import { Button } from './ui/parts';

/** The user's wishes that {@link SessionControls} reports. */
export interface SessionEvents {
  /** Saves a session; `included`: with the data that it was made from. */
  onSaveSession: (included: boolean) => void;
  /** Shows what is kept of work that is not saved. */
  onShowKept: () => void;
}

/** The wishes about code that repeats the run, in labs whose model runs. */
export interface CodeEvents {
  onCopyCode: () => void;
  /** Saves the data as a file that the code reads. */
  onSaveData: () => void;
}

interface SessionProps {
  events: SessionEvents;
  code: CodeEvents | undefined;
  /** Describes a session of the lab. */
  help: string;
  isEnabled: ReadonlySignal<boolean>;
}

/** Controls that save the session, and copy the run as code. */
export function SessionControls({ events, code, help, isEnabled }: SessionProps) {
  const included = useRef<HTMLInputElement>(null);
  const action = (name: string, label: string, help: string, act: () => void) => (
    <Action {...{ name, label, help, act, isEnabled }} />
  );
  return (
    <div class="session">
      {action('session', text('sessions.save'), help, () => events.onSaveSession(included.current?.checked === true))}
      <label class="check">
        <input type="checkbox" data-session="included" ref={included} />
        {text('sessions.include')}
      </label>
      <Button class="wide" data-action="kept" onClick={events.onShowKept}>
        {text('kept.open')}
      </Button>
      {code && action('code', text('sessions.copyCode'), text('sessions.copyCodeHelp'), code.onCopyCode)}
      {code && action('data', text('sessions.saveData'), text('sessions.saveDataHelp'), code.onSaveData)}
    </div>
  );
}

interface ActionProps {
  name: string;
  label: string;
  help: string;
  act: () => void;
  isEnabled: ReadonlySignal<boolean>;
}

function Action({ name, label, help, act, isEnabled }: ActionProps) {
  const id = useId();
  return (
    <>
      <Button class="wide" data-action={name} aria-describedby={id} disabled={!isEnabled.value} onClick={act}>
        {label}
      </Button>
      <p class="help" id={id}>
        {help}
      </p>
    </>
  );
}
