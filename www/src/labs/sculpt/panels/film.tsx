import { computed, signal, useSignal } from '@preact/signals';
import { Check, Field, NumberInput } from '../../../kit/ui/field';
import { useId } from '../../../kit/ui/id';
import { Button, Help } from '../../../kit/ui/parts';
import { plural, text } from '../../../texts';
import { type Film, lastFrame } from '../film';

/** Default number of frames from one keyframe of a film to the next. */
export const FRAMES_BETWEEN = 24;
/** Largest number of frames from one keyframe of a film to the next. */
const MOST_BETWEEN = 600;

export interface FilmEvents {
  /** Called to add the current pose of the ellipsoids as a keyframe. */
  onAddKey: () => void;
  /** Called to remove the keyframe with this index, from 0. */
  onRemoveKey: (index: number) => void;
  onBetween: (frames: number) => void;
  onLoop: (loop: boolean) => void;
  /** Called to go to a frame of the film without playing it. */
  onSeek: (frame: number) => void;
  onRecord: () => void;
  onCancelRecord: () => void;
}

/** The film, as its controls show it. */
export class FilmState {
  readonly film = signal<Film | undefined>(undefined);
  readonly frame = signal(0);
  /** Number of frames between keyframes, also of a film that is still to be made. */
  readonly between = signal(FRAMES_BETWEEN);
  /** Progress of a recording, 0 to 1; undefined if none is in progress. */
  readonly recording = signal<number | undefined>(undefined);
  /** Index of the keyframe at the current frame; undefined between keyframes, or if the film has none. */
  readonly present = computed(() => {
    const [film, frame] = [this.film.value, this.frame.value];
    if (!film || !('keys' in film) || frame % film.between !== 0) return undefined;
    return (frame / film.between) % film.keys.length;
  });

  show(film: Film | undefined, frame: number): void {
    this.film.value = film;
    this.frame.value = frame;
    if (film && 'keys' in film) this.between.value = film.between;
  }
}

interface FilmProps {
  state: FilmState;
  events: FilmEvents;
}

/** Controls of the Sculpt lab's film: keyframes, position, playback options and recording. */
export function FilmControls({ state, events }: FilmProps) {
  const film = state.film.value;
  const present = state.present.value;
  const isStill = !film || lastFrame(film) < 1;
  return (
    <div class="film">
      <Help>{text('sculptPanels.filmHelp')}</Help>
      <Keys {...{ state, events }} />
      <div class="buttons">
        <Button data-film="add" onClick={events.onAddKey}>
          {text('sculptPanels.addKeyframe')}
        </Button>
        <Button
          data-film="remove"
          disabled={present === undefined}
          onClick={() => present !== undefined && events.onRemoveKey(present)}
        >
          {text('sculptPanels.removeKeyframe')}
        </Button>
      </div>
      <Position {...{ state, events }} />
      <Between {...{ state, events }} />
      <Check
        {...{ 'data-film': 'loop', label: text('sculptPanels.filmLoop'), on: film?.loop ?? false }}
        {...{ set: events.onLoop, disabled: !film }}
      />
      <Recording {...{ state, events, isStill }} />
      <p class="help" role="status">
        {statusOf(film)}
      </p>
    </div>
  );
}

function statusOf(film: Film | undefined): string {
  if (film && 'motion' in film) return text('sculptPanels.motionComputed');
  const keys = film?.keys.length ?? 0;
  return keys === 0 ? text('sculptPanels.noKeyframes') : plural('sculptPanels.keyframeCount', keys);
}

/** A button for each keyframe. */
function Keys({ state, events }: FilmProps) {
  const film = state.film.value;
  const between = film && 'keys' in film ? film.between : 0;
  const keys = film && 'keys' in film ? film.keys : [];
  return (
    <fieldset class="buttons chips" aria-label={text('sculptPanels.keyframes')}>
      {keys.map((_, index) => {
        const label = text('sculptPanels.keyframeName', { number: index + 1 });
        return (
          <Button
            key={index}
            {...{ 'aria-label': label, title: label, 'data-key': index + 1 }}
            aria-pressed={index === state.present.value}
            onClick={() => events.onSeek(index * between)}
          >
            {index + 1}
          </Button>
        );
      })}
    </fieldset>
  );
}

/** The frame of the film that is shown. */
function Position({ state, events }: FilmProps) {
  const id = useId();
  const [film, frame] = [state.film.value, state.frame.value];
  const last = film ? Math.max(1, lastFrame(film)) : 1;
  return (
    <>
      <div class="row">
        <label for={id}>{text('controls.frame')}</label>
        <output aria-live="off">{film ? text('controls.frameOf', { frame, last }) : '–'}</output>
      </div>
      <input
        {...{ type: 'range', id, min: 0, max: last, step: 1, value: frame, disabled: !film || lastFrame(film) < 1 }}
        onInput={({ currentTarget }) => events.onSeek(currentTarget.valueAsNumber)}
      />
    </>
  );
}

/** The number of frames between keyframes. */
function Between({ state, events }: FilmProps) {
  const film = state.film.value;
  const isRefused = useSignal(false);
  const enter = (frames: number) => {
    isRefused.value = !(Number.isInteger(frames) && frames >= 1 && frames <= MOST_BETWEEN);
    if (isRefused.value) return;
    state.between.value = frames;
    events.onBetween(frames);
  };
  return (
    <Field
      isRow
      label={text('sculptPanels.framesBetween')}
      error={isRefused.value ? text('sculptPanels.framesBetweenError', { most: MOST_BETWEEN }) : ''}
    >
      {(tied) => (
        <NumberInput
          {...{ ...tied, min: 1, max: MOST_BETWEEN, step: 1, required: true, shown: String(state.between.value) }}
          disabled={film !== undefined && 'motion' in film}
          onEnter={enter}
        />
      )}
    </Field>
  );
}

function Recording({ state, events, isStill }: FilmProps & { isStill: boolean }) {
  const recording = state.recording.value;
  const isRecording = recording !== undefined;
  return (
    <>
      <div class="buttons">
        <Button data-film="record" hidden={isRecording} disabled={isStill} onClick={events.onRecord}>
          {text('sculptPanels.recordGlb')}
        </Button>
        <Button data-film="cancel" hidden={!isRecording} onClick={events.onCancelRecord}>
          {text('controls.cancel')}
        </Button>
      </div>
      <progress
        {...{ max: 1, value: recording ?? 0, hidden: !isRecording }}
        aria-label={text('sculptPanels.recordingProgress')}
      />
    </>
  );
}
