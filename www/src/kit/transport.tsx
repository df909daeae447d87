import { signal } from '@preact/signals';
import type { StepReport } from '../engine/protocol';
import { text } from '../texts';
import { prefersReducedMotion } from './dom';
import { count } from './format';
import type { LabState } from './state';
import { Button, Icon, Travel, type Undoable } from './ui/parts';

const PLAY = 'M7 4.5v15l12-7.5z';
const PAUSE = 'M6 5h4.5v14H6zM13.5 5H18v14h-4.5z';
const STEP = 'M6 5v14l9-7zM16 5h2.5v14H16z';
const STEPS = 'M3 5v14l7.5-7zM10.5 5v14L18 12zM18.5 5H21v14h-2.5z';
const RESET = 'M12 5V1L6 6.5 12 12V8a5 5 0 1 1-5 5H4a8 8 0 1 0 8-8z';

export interface TransportEvents {
  onToggle: () => void;
  onStep: (count: number) => void;
  onReset: () => void;
  onUndo: () => void;
  onRedo: () => void;
}

/** A run, as its controls show it. */
export class RunState {
  /** The state of the lab, and whether there is a model to run. */
  readonly state = signal<{ lab: LabState; hasModel: boolean }>({ lab: 'loading', hasModel: false });
  readonly undo = signal<Undoable>({});
  /** The report of the last step. */
  readonly report = signal<StepReport | undefined>(undefined);

  showUndo(undoable: string | undefined, redoable: string | undefined): void {
    this.undo.value = { undoable, redoable };
  }

  showState(lab: LabState, hasModel: boolean): void {
    this.state.value = { lab, hasModel };
  }

  showReport(report: StepReport | undefined): void {
    this.report.value = report;
  }
}

/** Buttons that control a run (play, pause, step, reset, undo, redo), and its progress. */
export function Transport({ run, events }: { run: RunState; events: TransportEvents }) {
  const { lab, hasModel } = run.state.value;
  const undo = run.undo.value;
  const isRunning = lab === 'running';
  const isIdle = hasModel && lab !== 'loading';
  const cannotStep = !isIdle || isRunning || lab === 'done';
  return (
    <fieldset class="transport" aria-label={text('controls.runControls')}>
      <div class="buttons">
        <Button class="primary play" disabled={!isIdle || lab === 'done'} onClick={events.onToggle}>
          <span class="icon-holder">
            <Icon path={isRunning ? PAUSE : PLAY} />
          </span>
          <span>{text(isRunning ? 'controls.pause' : 'controls.play')}</span>
        </Button>
        <Labelled path={STEP} label={text('controls.step')} disabled={cannotStep} act={() => events.onStep(1)} />
        <Labelled path={STEPS} label={text('controls.tenSteps')} disabled={cannotStep} act={() => events.onStep(10)} />
        <Labelled path={RESET} label={text('controls.reset')} disabled={!isIdle} act={events.onReset} />
        <Travel direction="undo" undo={undo} hasWord onClick={events.onUndo} />
        <Travel direction="redo" undo={undo} hasWord onClick={events.onRedo} />
      </div>
      <Progress run={run} />
    </fieldset>
  );
}

/** The iteration and the phase of a run, and how far it is. */
function Progress({ run }: { run: RunState }) {
  const { lab } = run.state.value;
  const report = run.report.value;
  const share = report && Number.isFinite(report.progress) ? report.progress : 0;
  // A progress bar without a value is animated: the duration is unknown.
  const isAnimated = lab === 'loading' && !prefersReducedMotion();
  return (
    <>
      <div class="where">
        <span class="iteration">{text('controls.iteration', { number: count(report?.iteration ?? 0) })}</span>
        <span class="phase">{report?.phase}</span>
      </div>
      <progress
        max={1}
        value={isAnimated ? undefined : lab === 'done' ? 1 : share}
        aria-label={text('controls.progress')}
      />
    </>
  );
}

function Labelled({ path, label, disabled, act }: { path: string; label: string; disabled: boolean; act: () => void }) {
  return (
    <Button disabled={disabled} onClick={act}>
      <Icon path={path} />
      <span>{label}</span>
    </Button>
  );
}
