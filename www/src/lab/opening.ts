import { toFailure } from '../engine/failure';
import type { Failure, NamedBytes, ParamSpec, Unit } from '../engine/protocol';
import type { Warning } from '../engine/warnings';
import type { Banner, Status } from '../kit/status';
import { text } from '../texts';
import type { Handoff } from './lab';
import { LinkError, readLink } from './link-query';
import type { Session } from './session/check';
import type { LabStates } from './states';

/** Milliseconds that a busy worker has to save its model before it is terminated. */
const SAVE_TIMEOUT_MS = 300;

/** Most settings of a link that are named where they cannot be read, and most characters of each. */
const MOST_NAMED = 4;
const MOST_SHOWN = 40;

/** Voxels beyond which what is open gives back its memory before other data are read. */
const HEAVY = 2 ** 22;

/**
 * Data that a lab opens (an example, the user's files, or data of another lab), with all that is needed to open it
 * again after a failure of the engine.
 */
export interface Source<Example, Linked, Data> {
  name: string;
  /** Reads or downloads the data; called when the source is opened. */
  load: () => Promise<Data>;
  example?: Example;
  /** Settings in the link that opened the data; they take precedence over those of the example. */
  linked?: Linked;
  /** Unit of lengths, if there is no example to define it. */
  unit?: Unit;
  /** The session to continue, whose state takes precedence over all settings. */
  session?: Session;
  /** Whether the settings in `linked` are those in force, so that there are none to go back to. */
  isChange?: boolean;
  /** Whether the data are nowhere but in the app, since another lab has made them. */
  isMade?: boolean;
  /** Whether the page keeps the data, so that they can be opened again at any time. */
  isKept?: boolean;
  /** Warnings about the data, which they do not have themselves. */
  warnings?: readonly Warning[];
}

/** The controls of a lab that opening data affects. */
interface OpeningParts<Example> {
  makeParams(specs: ParamSpec[]): void;
  banner: Banner;
  status: Status;
  data: { choose(example: Example | undefined): void };
}

/** How a lab follows changes of the page's address. */
interface Following {
  /** Whether what is open may be replaced. */
  mayFollow: () => Promise<boolean>;
  /** Called after each change that was followed; corrects an address that could not be. */
  onFollowed: () => void;
}

/** The lab's worker, as needed to restart it. */
interface Engine {
  restart(failure: Failure): void;
  request(kind: 'hello', body: undefined): Promise<{ specs: ParamSpec[] }>;
}

/** How a lab opens data, whatever its links, data and models are. */
export interface AnyOpening<Example> {
  readonly source: Source<Example, unknown, unknown> | undefined;
  onReplaced: () => void;
  filesOf(data: unknown): NamedBytes[];
  start(signal: AbortSignal, following: Following, passedOn?: () => Promise<void>): Promise<void>;
  close(): void;
  default(): Promise<void>;
  example(example: Example): Promise<void>;
  files(files: File[]): Promise<void>;
  session(session: Session, files: File[]): Promise<void>;
  passedOn(handoff: Handoff): Promise<void>;
  reopen(): Promise<void>;
  cancel(): Promise<void>;
}

/** Circumstances in which data are loaded. */
export interface Loading<Example, Linked, Data> {
  /** Whether the same source was open before, and the engine was restarted. */
  reopening: boolean;
  /** The source that is open as yet; undefined if there is none. */
  present: Source<Example, Linked, Data> | undefined;
}

/** Settings of links to any lab. */
interface LinkedData {
  example?: string;
  /** Name of the user's file. */
  file?: string;
  /** Unknown settings, and those with an invalid value. */
  unread?: string[];
}

/** The data of a lab: which there are, and how its worker builds a model of them. */
export interface LabData<Example, Linked, Data, Opened> {
  /** The example that opens by default. */
  readonly first: Example;

  /** Returns the example with this id, undefined if there is none. */
  find(id: string): Example | undefined;

  /** Parses the hash of an address; undefined if it contains no settings for this lab. */
  linkedBy(hash: string): Linked | undefined;

  /** Returns all that is needed to open an example, without downloading it yet. */
  fromExample(example: Example): Source<Example, Linked, Data>;

  /** Returns all that is needed to open the user's files, without reading them yet. */
  fromFiles(files: File[]): Source<Example, Linked, Data>;

  /** Returns all that is needed to open what another lab passes on; without it, the first example opens in its place. */
  fromHandoff?(handoff: Handoff): Source<Example, Linked, Data>;

  /** Returns the files among the data, which sessions describe or include; without it, there are none. */
  filesOf?(data: Data): NamedBytes[];

  /** Has the worker build a model of the data. */
  load(source: Source<Example, Linked, Data>, data: Data, loading: Loading<Example, Linked, Data>): Promise<Opened>;

  /**
   * Displays what was opened, with the settings of its example or link, and runs it; with `reopening`, with the
   * previous settings.
   */
  adopt(opened: Opened, source: Source<Example, Linked, Data>, reopening: boolean): Promise<void>;

  /** Returns the source to open again after a failure of the engine; without it, the one that was opened. */
  sourceToRemember?(
    source: Source<Example, Linked, Data>,
    opened: Opened,
    data: Data,
    present: Source<Example, Linked, Data> | undefined,
  ): Source<Example, Linked, Data>;

  /** Returns the number of voxels of what was opened; without it, 0. */
  voxelsOf?(opened: Opened): number;

  /** Has the worker save the present model, so that undo or a restarted engine can restore it. */
  save?(): void;

  /** Returns a promise that settles when all pending saves of the model are complete. */
  saved?(): Promise<unknown>;

  /** Called when opening has failed, and what was open before stays. */
  kept?(present: Source<Example, Linked, Data> | undefined): void;

  /** Called when a request to open something is made, to end the one before if that takes long. */
  superseded?(): void;

  /** Called when the engine has loaded, with the parameters of the method. */
  onEngineReady?(specs: ParamSpec[]): void;

  /** Called when the engine was restarted, to send it the view's settings again. */
  restarted?(): Promise<unknown>;
}

/**
 * Opens examples, files and links: gets the data and has the worker build a model of it. The newest request wins; when
 * it fails, everything stays as before.
 */
export class Opening<Example, Linked extends LinkedData, Data, Opened> {
  readonly #engine: Engine;
  readonly #ui: OpeningParts<Example>;
  readonly #states: LabStates;
  readonly #lab: LabData<Example, Linked, Data, Opened>;
  #source: Source<Example, Linked, Data> | undefined;
  /**
   * Settings in a link that names a file of the user's, to be applied when the user opens a file; undefined if there is
   * no such link.
   */
  #awaiting: Linked | undefined;
  /** Counts requests, so that a slow download does not replace what was opened after it. */
  #requestCount = 0;
  /** Settles when the engine has loaded for the first time, or failed to. */
  #started: Promise<unknown> = Promise.resolve();
  /** Settles when the worker has answered the last request to load data. */
  #loads: Promise<unknown> = Promise.resolve();
  /** Settles when the last data opened are displayed, and the worker has answered the requests that this takes. */
  #adoption: Promise<unknown> = Promise.resolve();
  /**
   * Whether the worker's model is not the one displayed, or is missing; if opening fails then, the engine counts as
   * broken, and is restarted with what is displayed.
   */
  #modelMismatch = false;
  /** Whether what is open gives back its memory before other data are read, as it can be opened again if these cannot be. */
  #givesWay = false;

  /** Called when other data have taken the place of those that were open. */
  onReplaced: () => void = () => undefined;

  constructor(
    engine: Engine,
    ui: OpeningParts<Example>,
    states: LabStates,
    lab: LabData<Example, Linked, Data, Opened>,
  ) {
    this.#engine = engine;
    this.#ui = ui;
    this.#states = states;
    this.#lab = lab;
  }

  /** Returns the files among the data, which sessions describe or include. */
  filesOf(data: Data): NamedBytes[] {
    return this.#lab.filesOf?.(data) ?? [];
  }

  /** Opens what another lab passes on. */
  passedOn(handoff: Handoff): Promise<void> {
    const source = this.#lab.fromHandoff?.(handoff);
    return source ? this.open(source) : this.default();
  }

  /**
   * Opens what another lab passes on, or what the address asks for, or else the first example, unless the user has
   * opened something while the engine was loading; then follows changes of the address until `signal` is aborted.
   */
  async start(
    signal: AbortSignal,
    { mayFollow, onFollowed }: Following,
    passedOn?: () => Promise<void>,
  ): Promise<void> {
    try {
      const greeting = this.#greet();
      this.#started = greeting.catch(() => undefined);
      await greeting;
    } catch (error) {
      this.#states.fail(text('labs.startFailed'), error);
      return;
    }
    if (signal.aborted) return;
    const follow = async ({ oldURL, newURL }: HashChangeEvent) => {
      // The address is that of the open data as long as they are.
      if (oldURL) history.replaceState(null, '', oldURL);
      if (!(await mayFollow()) || signal.aborted) return;
      if (newURL) history.replaceState(null, '', newURL);
      await this.#link();
      onFollowed();
    };
    window.addEventListener('hashchange', (event) => void follow(event), { signal });
    if (this.#requestCount === 0) await (passedOn ? passedOn() : this.#link(this.#lab.first));
  }

  /** Waits until the engine has loaded, and makes controls for its parameters. */
  async #greet(): Promise<void> {
    const { specs } = await this.#engine.request('hello', undefined);
    this.#ui.makeParams(specs);
    this.#lab.onEngineReady?.(specs);
  }

  /** The source of the data that is open; undefined if there is none. */
  get source(): Source<Example, Linked, Data> | undefined {
    return this.#source;
  }

  /** Discards all data that is still being opened, since the lab is closed. */
  close(): void {
    this.#requestCount += 1;
  }

  /** Opens an example. */
  example(example: Example): Promise<void> {
    return this.open(this.#lab.fromExample(example));
  }

  /**
   * Opens the user's files; if a link names a file that the user has yet to open, its settings are applied to that file, and
   * to no other.
   */
  async files(files: File[]): Promise<void> {
    const source = this.#lab.fromFiles(files);
    const waiting = this.#awaiting;
    const linked = waiting?.file === source.name ? waiting : undefined;
    await this.#openLinked({ ...source, ...(linked && { linked }) });
    if (!waiting || linked || this.#source?.name !== source.name || this.#ui.banner.shown) return;
    this.#ui.banner.show(
      text('labs.linkOtherFile', { name: source.name }),
      text('labs.linkNeedsFileHint', { file: waiting.file ?? '' }),
    );
  }

  /** Opens the data of a session, its example or else `files`, and continues it. */
  session(session: Session, files: File[]): Promise<void> {
    const { name, example: id } = session.source;
    const example = id === undefined ? undefined : this.#lab.find(id);
    const own = files.length > 0 ? [this.#lab.fromFiles(files)] : [];
    const origins = example ? [this.#lab.fromExample(example), ...own] : own;
    const load = () => this.#matching(session.source, origins);
    // Data that came with the session may be nowhere else.
    const isMade = !example && session.source.files.every(({ content }) => content);
    return this.open({ ...origins[0], ...(example ? { example } : { isMade }), name, load, session });
  }

  /** Returns the data of the first of several sources that are those of a session. */
  async #matching(wanted: Session['source'], [origin, ...others]: Source<Example, Linked, Data>[]): Promise<Data> {
    if (!origin) throw new Error(text('labs.linkNoExample', { example: wanted.example ?? '' }));
    try {
      const data = await origin.load();
      await (await import('./session/file')).matching(wanted.files, this.filesOf(data));
      return data;
    } catch (error) {
      if (others.length === 0) throw error;
      return this.#matching(wanted, others);
    }
  }

  /** Opens the first example. */
  default(): Promise<void> {
    return this.example(this.#lab.first);
  }

  /** Opens the present source again, after a failure of the engine. */
  async reopen(): Promise<void> {
    if (this.#source) await this.open(this.#source, true);
  }

  /**
   * Cancels the opening or preparation that the worker is busy with: restarts the engine, and opens the previous
   * source, or else the first example, again.
   */
  async cancel(): Promise<void> {
    const request = this.#requestCount;
    this.#states.cancel(text('labs.cancelling'));
    await this.#savedInTime();
    if (request !== this.#requestCount || this.#states.value !== 'loading') return;
    this.#states.engineBroken = true;
    const source = this.#source;
    const again = () => text('labs.cancelledReopening', { name: source?.name ?? '' });
    const opening = source ? this.open(source, true, again()) : this.example(this.#lab.first);
    const own = this.#requestCount;
    await opening;
    if (own === this.#requestCount && !this.#ui.banner.shown) this.#ui.status.say(text('labs.cancelled'));
  }

  /**
   * Opens the example that the page's address names, with the settings in the address. If that is not possible, opens
   * `otherwise`, if given; if the address names an unknown example or the user's file, a banner says so.
   */
  async #link(otherwise?: Example): Promise<void> {
    const linked = readLink(() => this.#lab.linkedBy(location.hash));
    if (linked instanceof LinkError) {
      if (otherwise) await this.example(otherwise);
      return this.#ui.banner.show(text('labs.linkInvalid'), linked.message);
    }
    const example = linked && this.#exampleOf(linked);
    if (linked && example) return this.#openLinked({ ...this.#lab.fromExample(example), linked });
    if (otherwise) await this.example(otherwise);
    if (!linked) return;
    this.#awaiting = linked.file ? linked : undefined;
    if (linked.file)
      this.#ui.banner.show(text('labs.linkNeedsFile'), text('labs.linkNeedsFileHint', { file: linked.file }));
    else this.#ui.banner.show(text('labs.linkInvalid'), text('labs.linkNoExample', { example: linked.example ?? '' }));
  }

  /** Opens a source, and says what cannot be read of the link whose other settings are in force then. */
  async #openLinked(source: Source<Example, Linked, Data>): Promise<void> {
    const unread = source.linked?.unread ?? [];
    const opening = this.open(source);
    const own = this.#requestCount;
    await opening;
    if (unread.length === 0 || own !== this.#requestCount || this.#states.value === 'error') return;
    const settings = unread.slice(0, MOST_NAMED).map(shortened).join(', ');
    const more = unread.length - MOST_NAMED;
    this.#ui.banner.show(
      text('labs.linkUnread'),
      more > 0 ? text('labs.linkUnreadMore', { settings, more }) : text('labs.linkUnreadHint', { settings }),
    );
  }

  #exampleOf({ example, file }: Linked): Example | undefined {
    if (example !== undefined) return this.#lab.find(example);
    return file ? undefined : this.#lab.first;
  }

  /**
   * Opens a source: gets its data, has the worker build a model of it, and displays it. Stops if a newer request to
   * open something has been made. The status line says `says` meanwhile.
   */
  async open(
    source: Source<Example, Linked, Data>,
    reopening = false,
    says = reopening ? text('labs.restartingEngine') : text('labs.opening', { name: source.name }),
  ): Promise<void> {
    const request = ++this.#requestCount;
    this.#lab.superseded?.();
    if (this.#states.canChange) this.#lab.save?.();
    const isFirst = source.example === this.#lab.first && source.linked === undefined && source.session === undefined;
    const changesDone = this.#states.open(says, !isFirst, reopening);
    try {
      await this.#started;
      await this.#needEngine();
      await changesDone;
      const data = await source.load();
      // In turn, so that the worker ends up with the newest request, and never runs its model for an earlier one.
      await this.#loads;
      await this.#adoption;
      if (!reopening && !source.isChange) await this.#makeRoom();
      if (request !== this.#requestCount) return;
      await this.#needEngine();
      const opened = await this.#load(source, data, reopening);
      if (request !== this.#requestCount) return;
      this.#states.finishOpening(true);
      const before = this.#source;
      this.#source = this.#lab.sourceToRemember?.(source, opened, data, before) ?? source;
      this.#modelMismatch = false;
      const isKept = source.isKept || source.isMade || false;
      this.#givesWay = isKept && (this.#lab.voxelsOf?.(opened) ?? 0) > HEAVY;
      if (!reopening) this.onReplaced();
      if (source.linked && source.linked === this.#awaiting) this.#awaiting = undefined;
      const adoption = this.#lab.adopt(opened, source, reopening);
      this.#adoption = adoption.catch(() => undefined);
      await adoption.catch((error) => {
        if (!source.session) throw error;
        return request === this.#requestCount ? this.#openInstead(before, source, error) : undefined;
      });
    } catch (error) {
      if (request === this.#requestCount) await this.#failed(source, error, reopening);
    }
  }

  #load(source: Source<Example, Linked, Data>, data: Data, reopening: boolean): Promise<Opened> {
    const loading = this.#lab.load(source, data, { reopening, present: this.#source });
    this.#loads = loading.then(
      () => {
        this.#modelMismatch = true;
      },
      () => undefined,
    );
    return loading;
  }

  async #failed(source: Source<Example, Linked, Data>, error: unknown, reopening: boolean): Promise<void> {
    this.#states.finishOpening(false);
    const { code, message } = toFailure(error);
    if (code !== 'internal' && !this.#states.engineBroken && !reopening && source.linked && !source.isChange)
      return this.#openWithoutLink(source, message);
    this.#ui.data.choose(this.#source?.example);
    this.#lab.kept?.(this.#source);
    const title = titleOf(source);
    if (this.#modelMismatch) {
      this.#states.engineBroken = true;
      if (code !== 'internal' && this.#source && !reopening) return this.#openPrevious(title, message);
    }
    this.#states.fail(title, error);
  }

  /** Opens what is displayed again, after the worker has replaced it by what then could not be opened, and says why. */
  async #openPrevious(title: string, why: string): Promise<void> {
    const opening = this.reopen();
    const own = this.#requestCount;
    await opening;
    if (own === this.#requestCount && this.#states.value !== 'error') this.#ui.banner.show(title, why);
  }

  /**
   * Opens what was open before a session, or the first example, after the session could be shown in part only, and says
   * why.
   */
  async #openInstead(
    before: Source<Example, Linked, Data> | undefined,
    failed: Source<Example, Linked, Data>,
    error: unknown,
  ): Promise<void> {
    const { code, message } = toFailure(error);
    if (code === 'internal') this.#states.engineBroken = true;
    // After a failure of the engine, the session itself was open.
    this.#source = before?.session === failed.session ? undefined : before;
    const opening = this.open(this.#source ?? this.#lab.fromExample(this.#lab.first));
    const own = this.#requestCount;
    await opening;
    if (own === this.#requestCount && this.#states.value !== 'error') this.#ui.banner.show(titleOf(failed), message);
  }

  /** Opens a link's example or file without the link's settings, after one of them was rejected, and says why. */
  async #openWithoutLink({ linked: _, ...source }: Source<Example, Linked, Data>, why: string): Promise<void> {
    await this.open(source);
    if (this.#states.value === 'error' || this.#source !== source) return;
    this.#ui.banner.show(text('labs.linkSettingsIgnored'), text('labs.linkSettingRejected', { reason: why }));
  }

  /**
   * Has the engine restarted if what is open takes much memory, which a worker keeps as long as it lives, although the
   * data are small; should opening fail, they are opened again.
   */
  async #makeRoom(): Promise<void> {
    if (!this.#givesWay) return;
    await this.#savedInTime();
    this.#states.engineBroken = true;
  }

  /** Settles when all pending saves of the model are complete, or take too long. */
  #savedInTime(): Promise<unknown> {
    return Promise.race([this.#lab.saved?.(), later(SAVE_TIMEOUT_MS)]);
  }

  /** Restarts the engine if it is broken. */
  async #needEngine(): Promise<void> {
    if (!this.#states.engineBroken) return;
    this.#engine.restart({ code: 'internal', message: text('labs.engineRestarted') });
    this.#modelMismatch = true;
    await this.#greet();
    await this.#lab.restarted?.();
    this.#states.engineBroken = false;
  }
}

/** Returns what the banner says when a source cannot be opened. */
const titleOf = ({ name, session }: Pick<Source<never, never, never>, 'name' | 'session'>): string =>
  text(session ? 'sessions.openFailed' : 'labs.openFailed', { name });

const shortened = (setting: string) => (setting.length > MOST_SHOWN ? `${setting.slice(0, MOST_SHOWN)}…` : setting);

const later = (milliseconds: number) => new Promise((resolve) => setTimeout(resolve, milliseconds));
