import { toFailure } from '../channel';
import type { Unit } from '../examples';
import type { Failure, ParamSpec } from '../protocol';
import type { ErrorBanner, StatusLine } from '../ui/status';
import type { LabStates } from './lab-states';

/** Milliseconds that a worker has to give its model away before it is stopped. */
const KEEPING = 1000;

/** What a lab has open, or is to open: enough to open it again after a failure of the engine. */
export interface Source<Example, Linked, Data> {
  name: string;
  /** Gets it, from the disk or the network. */
  opened: () => Promise<Data>;
  example?: Example;
  /** What a link asks for beyond the example. */
  linked?: Linked;
  /** Of lengths, where no example says. */
  unit?: Unit;
}

/** The page, as far as it tells what is opened, and begins when the engine has. */
interface OpeningParts<Example> {
  makeParams(specs: ParamSpec[]): void;
  banner: ErrorBanner;
  status: StatusLine;
  data: { choose(example: Example | undefined): void };
}

/** The lab's worker, as far as it is started again. */
interface Engine {
  restart(failure: Failure): void;
  request(kind: 'hello', body: undefined): Promise<{ specs: ParamSpec[] }>;
}

/**
 * Opens examples, files and links: gets the data and has the worker make a model of it. What is asked for last counts;
 * when it fails, everything stays as it was. What differs from lab to lab is in a subclass.
 */
export abstract class Opening<Example, Linked extends { example?: string; file?: string }, Data, Opened> {
  readonly #engine: Engine;
  readonly #ui: OpeningParts<Example>;
  protected readonly states: LabStates;
  #source: Source<Example, Linked, Data> | undefined;
  /** A link that waits for its file. */
  #awaiting: Linked | undefined;
  /** Counts what was asked to be opened, so that a slow download does not replace what came after it. */
  #turn = 0;
  /** Settled when the worker has answered all that was to be loaded. */
  #loads: Promise<unknown> = Promise.resolve();
  /** The worker has another model than the page shows, or none. */
  #astray = false;

  constructor(engine: Engine, ui: OpeningParts<Example>, states: LabStates) {
    this.#engine = engine;
    this.#ui = ui;
    this.states = states;
  }

  /** What is opened where nothing else is asked for. */
  protected abstract readonly first: Example;

  /** The example of that name. */
  protected abstract find(id: string): Example | undefined;

  /** What an address asks for. */
  protected abstract linkedBy(hash: string): Linked | undefined;

  protected abstract fromExample(example: Example): Source<Example, Linked, Data>;

  protected abstract fromFiles(files: File[]): Source<Example, Linked, Data>;

  /** Has the worker make a model; `again`: of what is open, after the engine was started again. */
  protected abstract load(source: Source<Example, Linked, Data>, data: Data, again: boolean): Promise<Opened>;

  /** Shows what was opened, as its example or link wants it, and runs it; `again` as it was. */
  protected abstract adopt(opened: Opened, source: Source<Example, Linked, Data>, again: boolean): Promise<void>;

  /** What counts as open from now on. */
  protected asOpen(source: Source<Example, Linked, Data>, _opened: Opened, _data: Data): Source<Example, Linked, Data> {
    return source;
  }

  /** Has the worker give away what is needed to come back to the model as it is now. */
  protected keep(): void {}

  /** Settled when the worker has given away all that is needed to come back. */
  protected async kept(): Promise<unknown> {
    return undefined;
  }

  /** The engine is there, and has told of its parameters. */
  protected greeted(_specs: ParamSpec[]): void {}

  /** Another engine is there, which knows nothing yet. */
  protected async restarted(): Promise<unknown> {
    return undefined;
  }

  /**
   * Opens what another lab passes on, or what the address says, or else the first example; then follows the address, until
   * aborted. Also where that could not be followed it is to be that of what is open: `onFollowed` sees to it.
   */
  async start(signal: AbortSignal, onFollowed: () => void, passedOn?: () => Promise<void>): Promise<void> {
    try {
      await this.#greet();
    } catch (error) {
      this.states.fail('Vesicle could not start.', error);
      return;
    }
    if (signal.aborted) return;
    window.addEventListener('hashchange', () => void this.#link().then(onFollowed), { signal });
    await (passedOn ? passedOn() : this.#link(this.first));
  }

  /** Waits until the engine is there. */
  async #greet(): Promise<void> {
    const { specs } = await this.#engine.request('hello', undefined);
    this.#ui.makeParams(specs);
    this.greeted(specs);
  }

  /** What is open. */
  get source(): Source<Example, Linked, Data> | undefined {
    return this.#source;
  }

  /** What is still being opened is not taken any more. */
  close(): void {
    this.#turn += 1;
  }

  example(example: Example, linked?: Linked): Promise<void> {
    return this.open({ ...this.fromExample(example), ...(linked && { linked }) });
  }

  files(files: File[]): Promise<void> {
    const linked = this.#awaiting;
    return this.open({ ...this.fromFiles(files), ...(linked && { linked }) });
  }

  byId(id: string): void {
    const example = this.find(id);
    if (example) void this.example(example);
  }

  /** What is open once more, after a failure of the engine. */
  async again(): Promise<void> {
    if (this.#source) await this.open(this.#source, true);
  }

  /** Stops what is being opened or prepared: the worker is in the midst of it, so it is started anew. */
  async cancel(): Promise<void> {
    const turn = this.#turn;
    await Promise.race([this.kept(), later(KEEPING)]);
    if (turn !== this.#turn || this.states.value !== 'loading') return;
    this.states.engineBroken = true;
    const opening = this.#source ? this.again() : this.example(this.first);
    const own = this.#turn;
    await opening;
    if (own === this.#turn && !this.#ui.banner.shown) this.#ui.status.say('Cancelled.');
  }

  /** Opens what the page's address asks for; says why where that cannot be. `otherwise` is opened then. */
  async #link(otherwise?: Example): Promise<void> {
    const linked = this.linkedBy(location.hash);
    const example = linked && this.#exampleOf(linked);
    if (linked && example) return this.example(example, linked);
    if (otherwise) await this.example(otherwise);
    if (!linked) return;
    this.#awaiting = linked.file ? linked : undefined;
    if (linked.file)
      this.#ui.banner.show('This link needs a file.', `Open ${linked.file} from your disk: its settings will follow.`);
    else this.#ui.banner.show('This link cannot be followed.', `There is no example “${linked.example ?? ''}”.`);
  }

  #exampleOf({ example, file }: Linked): Example | undefined {
    if (example !== undefined) return this.find(example);
    return file ? undefined : this.first;
  }

  protected async open(source: Source<Example, Linked, Data>, again = false): Promise<void> {
    const turn = ++this.#turn;
    if (this.states.canChange) this.keep();
    const calm = this.states.open(again ? 'Starting the engine again.' : `Opening ${source.name}.`);
    try {
      await this.#needEngine();
      await calm;
      const data = await source.opened();
      // One after the other: what the worker has is what was asked for last.
      await this.#loads;
      if (turn !== this.#turn) return;
      await this.#needEngine();
      const opened = await this.#load(source, data, again);
      if (turn !== this.#turn) return;
      this.states.opened(true);
      this.#source = this.asOpen(source, opened, data);
      this.#astray = false;
      if (!again) this.#awaiting = undefined;
      await this.adopt(opened, source, again);
    } catch (error) {
      if (turn === this.#turn) await this.#failed(source, error, again);
    }
  }

  #load(source: Source<Example, Linked, Data>, data: Data, again: boolean): Promise<Opened> {
    const loading = this.load(source, data, again);
    this.#loads = loading.then(
      () => {
        this.#astray = true;
      },
      () => undefined,
    );
    return loading;
  }

  async #failed(source: Source<Example, Linked, Data>, error: unknown, again: boolean): Promise<void> {
    this.states.opened(false);
    const { code, message } = toFailure(error);
    if (code !== 'internal' && !this.states.engineBroken && !again && source.linked)
      return this.#openWithoutLink(source, message);
    this.#ui.data.choose(this.#source?.example);
    if (this.#astray) this.states.engineBroken = true;
    this.states.fail(`${source.name} could not be opened.`, error);
  }

  /** What a link leads to without what it says of settings: something in them is refused. */
  async #openWithoutLink({ linked: _, ...source }: Source<Example, Linked, Data>, why: string): Promise<void> {
    await this.open(source);
    if (this.states.value === 'error' || this.#source !== source) return;
    this.#ui.banner.show('The link’s settings are left out.', `One of them cannot be: ${why}.`);
  }

  /** Starts the engine again where it broke. */
  async #needEngine(): Promise<void> {
    if (!this.states.engineBroken) return;
    this.#engine.restart({ code: 'internal', message: 'the engine was started again' });
    this.#astray = true;
    await this.#greet();
    await this.restarted();
    this.states.engineBroken = false;
  }
}

const later = (milliseconds: number) => new Promise((resolve) => setTimeout(resolve, milliseconds));
