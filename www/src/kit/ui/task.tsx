import type { ComponentChildren } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { text } from '../../texts';
import { Button } from './parts';

/** How far a task is that takes a while. */
export interface TaskState {
  isRunning: boolean;
  /** Its progress, up to the `max` of its controls. */
  progress: number;
  /** A message beside its buttons. */
  message: string;
  /** What cancelling would stop, if not all of it. */
  cancel?: string;
}

export const IDLE: TaskState = { isRunning: false, progress: 0, message: '' };
export const begun = (message: string): TaskState => ({ isRunning: true, progress: 0, message });
export const ended = (message: string): TaskState => ({ isRunning: false, progress: 0, message });

interface TaskProps {
  task: TaskState;
  /** Name of the attribute `data-…` of the buttons, whose values are `start` and `cancel`. */
  name: string;
  /** Text of the button that starts the task. */
  start: string;
  /** Name of the progress bar for screen readers. */
  progress: string;
  /** Value of the progress bar at the end of the task. */
  max?: number;
  isEnabled: boolean;
  onStart: () => void;
  onCancel: () => void;
  /** Further buttons, which are hidden during the task. */
  others?: ComponentChildren;
  /** Further buttons, which are shown only during the task. */
  during?: ComponentChildren;
}

/** Controls of a task that takes a while: buttons to start and cancel it, its progress, and a message. */
export function Task(props: TaskProps) {
  const { task, name, start, progress, max = 1, isEnabled, onStart, onCancel, others, during } = props;
  const { isRunning, message } = task;
  const [starter, canceller] = [useRef<HTMLButtonElement>(null), useRef<HTMLButtonElement>(null)];
  const wasRunning = useRef(false);
  // Read before the button is hidden: hiding takes the focus from it.
  const hadFocus = canceller.current !== null && document.activeElement === canceller.current;
  useLayoutEffect(() => {
    if (isRunning && !wasRunning.current) canceller.current?.focus();
    if (!isRunning && hadFocus) starter.current?.focus();
    wasRunning.current = isRunning;
  }, [isRunning]);
  const data = (value: string) => ({ [`data-${name}`]: value });
  return (
    <>
      <div class="buttons">
        <Button {...data('start')} ref={starter} hidden={isRunning} disabled={!isEnabled} onClick={onStart}>
          {start}
        </Button>
        <Button {...data('cancel')} ref={canceller} hidden={!isRunning} onClick={onCancel}>
          {task.cancel ?? text('controls.cancel')}
        </Button>
        {isRunning ? during : others}
      </div>
      <progress
        max={max}
        value={Number.isFinite(task.progress) ? task.progress : 0}
        hidden={!isRunning}
        aria-label={progress}
      />
      <p class="help" role="status">
        {message}
      </p>
    </>
  );
}
