import { mayLose } from '../kit/question';
import { offerShortcuts, type Shortcut } from '../kit/shortcuts';
import type { LabState } from '../kit/state';
import { text } from '../texts';
import { copyAddress, FILE_NOTE, type LabId, showAddress } from './address';
import type { Listed } from './example-panel';
import type { Captured, Handoff, Lab, LabPlace, OpenInLab } from './lab';
import type { AnyOpening, Source } from './opening';
import type { LabEvents, LabPage } from './page';
import type { RunControls } from './run-controls';
import { Sessions } from './sessions';
import type { LabStates } from './states';
import { Work } from './work';

/** The lab's worker, as the shell uses it. */
export interface Engine {
  close(): void;
}

type AnySource<Example> = Source<Example, unknown, unknown>;

/** A lab, as its shell uses it. */
export interface ShelledLab<Example extends Listed> {
  readonly id: LabId;
  readonly client: Engine;
  readonly ui: { readonly page: LabPage<Example>; readonly run?: RunControls; dispose(): void };
  readonly states: LabStates;
  readonly opening: AnyOpening<Example>;

  /** Returns the text for the status line in the present state. */
  describe(): string;

  /** Returns the hash of an address that restores what is open and the settings in force. */
  address(source: AnySource<Example>): string;

  /** Enables and disables controls according to the lab's state. */
  showControls(state: LabState): void;

  /** Returns the lab's own part of a session, without a change of the run; undefined if the lab cannot save its model. */
  sessionContent(): Promise<Record<string, unknown> | undefined>;

  /** Returns what a copied link does not contain, as sentences; false: none. */
  linkLacks?(): (string | false)[];

  /** Action of the Escape key, and a text that says it; without it, it dismisses the error message. */
  readonly escape?: { text: string; act: () => void };

  /** Called before the engine has loaded, to begin a download meanwhile, unless another lab passes something on. */
  starting?(): void;

  /** Releases what the lab has besides worker and views. */
  closed?(): void;
}

/** The common part of all labs: opening, states and failures, links and shortcuts. A lab calls {@link begin} when it is complete. */
export class LabShell<Example extends Listed> implements Lab {
  readonly work = new Work();
  onChange: () => void = () => undefined;
  onShowKept: () => void = () => undefined;
  readonly root: HTMLElement;
  readonly passOn: OpenInLab;
  /** Aborted when the lab is closed, which removes all event listeners. */
  readonly #closing = new AbortController();
  readonly #place: LabPlace;
  readonly #lab: ShelledLab<Example>;
  #sessions: Sessions<Example> | undefined;

  constructor(place: LabPlace, lab: ShelledLab<Example>) {
    this.root = place.root;
    this.passOn = place.passOn;
    this.#place = place;
    this.#lab = lab;
  }

  /** Aborted when the lab is closed. */
  get signal(): AbortSignal {
    return this.#closing.signal;
  }

  /** Begins to follow the lab's state and to listen to the keyboard. */
  begin(shortcuts: Shortcut[]): void {
    const { id, ui, states, opening } = this.#lab;
    this.#sessions = new Sessions({
      ...{ id, states, opening, work: this.work, passOn: this.passOn, page: ui.page },
      sessionWorker: this.#place.sessionWorker,
      ...(ui.run && { run: ui.run }),
      address: (source) => this.#lab.address(source),
      content: () => this.#lab.sessionContent(),
      onSaved: () => this.work.settled(),
      mayReplace: () => this.mayReplace(),
    });
    opening.onReplaced = () => this.work.end();
    states.subscribe((state) => this.#showState(state));
    states.subscribeCancellable((isCancellable) => ui.page.offerCancel(isCancellable));
    // Until a change is in force, the state and the measures are those of the run before it.
    states.subscribeChanging((isChanging) => {
      this.root.toggleAttribute('data-changing', isChanging);
      if (!isChanging) this.onChange();
    });
    this.work.onChange = () => this.onChange();
    const onEscape = {
      key: 'Escape',
      shown: text('labs.keyEscape'),
      ...(this.#lab.escape ?? { text: text('labs.dismissKey'), act: () => this.dismiss() }),
    };
    offerShortcuts([...shortcuts, onEscape], this.#place.help, this.#place.guide, this.signal);
  }

  /** Opens what another lab passes on, or what the address asks for, or else the first example, and runs it. */
  async start(passedOn?: Handoff): Promise<void> {
    if (!passedOn) this.#lab.starting?.();
    const open = passedOn && (() => this.#sessions?.passedOn(passedOn) ?? this.#lab.opening.passedOn(passedOn));
    const onFollowed = () => {
      this.forgetSession();
      this.updateAddress();
    };
    await this.#lab.opening.start(this.signal, { mayFollow: () => this.mayReplace(), onFollowed }, open);
  }

  get isRunning(): boolean {
    return this.#lab.states.value === 'running';
  }

  get isPlain(): boolean {
    const { source } = this.#lab.opening;
    return !this.work.isAny && (!source || source.example !== undefined);
  }

  async capture(): Promise<Captured | undefined> {
    return this.#sessions?.capture();
  }

  close(): void {
    this.#closing.abort();
    this.#lab.opening.close();
    this.#lab.client.close();
    this.#lab.closed?.();
    this.#lab.ui.dispose();
    this.root.replaceChildren();
  }

  /** Returns the handlers of the user's actions that all labs have. */
  events(): Omit<LabEvents<Example>, 'onParam'> {
    return {
      onFiles: (files) => void this.#sessions?.files(files),
      onExample: (example) => void this.#openExample(example),
      onCancel: () => void this.#lab.opening.cancel(),
      onDismiss: () => this.dismiss(),
      onCopyLink: () => void this.#copyLink(),
      onSaveSession: (included) => void this.#sessions?.save(included),
      onShowKept: () => this.onShowKept(),
      onError: (title, error) => this.#lab.states.fail(title, error),
    };
  }

  /** Whether other data may take the place of those that are open; asks if work by hand would be lost. */
  async mayReplace(): Promise<boolean> {
    const losses = this.work.unsavedByHand;
    return losses.length === 0 || mayLose(text('work.replace'), losses, text('work.replaceGo'));
  }

  async #openExample(example: Example): Promise<void> {
    if (!(await this.mayReplace())) return this.#lab.ui.page.data.choose(this.#lab.opening.source?.example);
    this.forgetSession();
    await this.#lab.opening.example(example);
  }

  /** Writes what is open and the settings in force into the page's address, so that it can be shared. */
  updateAddress(): void {
    const { source } = this.#lab.opening;
    if (source && (this.#lab.states.value !== 'loading' || this.#lab.states.ready))
      showAddress(this.#lab.address(source));
  }

  /** Shows an error message if a request fails, without waiting for the reply. */
  ask(request: Promise<unknown>, title = text('labs.requestFailed')): void {
    request.catch((error) => this.#lab.states.fail(title, error));
  }

  /** Waits no longer for the data of a session, since the user does something else. */
  forgetSession(): void {
    this.#sessions?.forget();
  }

  /** Dismisses the error message. */
  dismiss(): void {
    this.forgetSession();
    if (this.#lab.states.dismiss()) this.#lab.ui.page.status.say(this.#lab.describe());
  }

  async #copyLink(): Promise<void> {
    this.updateAddress();
    await copyAddress(this.#lab.ui.page.status, [
      !this.#lab.opening.source?.example && FILE_NOTE,
      ...(this.#lab.linkLacks?.() ?? []),
    ]);
  }

  #showState(state: LabState): void {
    this.root.dataset.state = state;
    this.#lab.showControls(state);
    if (state === 'done' || state === 'paused') this.updateAddress();
    this.onChange();
  }
}
