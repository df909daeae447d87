import { areSmall } from '../engine/small-files';
import type { Finish } from '../finish';
import { anyForeign, noted } from '../importers';
import { readFiles } from '../importers/files';
import { isLesson } from '../importers/lessons';
import { ENDING, isNamedSession, isSession } from '../importers/sessions';
import type { Banner, Status } from '../kit/status';
import type { Warnings } from '../kit/warnings';
import { text } from '../texts';
import type { LabId } from './address';
import type { Captured, Handoff, OpenInLab } from './lab';
import type { AnyOpening, Source } from './opening';
import type { Saving } from './saving';
import type { Session } from './session/check';
import type { NewSession, SourceFile } from './session/file';
import type { LabStates } from './states';
import type { Work, WorkKind } from './work';

/** A lab, as its sessions need it. */
interface SessionLab<Example> {
  id: LabId;
  page: { banner: Banner; status: Status; saving: Saving; warnings: Warnings };
  /** The controls of its run, if it has one. */
  run?: { readonly finish: Finish | undefined };
  states: LabStates;
  work: Work;
  opening: AnyOpening<Example>;
  passOn: OpenInLab;
  /** Starts a worker that reads sessions. */
  sessionWorker: (name: string) => Worker;
  address: (source: OpenSource<Example>) => string;
  content: () => Promise<Record<string, unknown> | undefined>;
  /** Called when a session was saved. */
  onSaved: () => void;
  /** Whether other data may take the place of those that are open. */
  mayReplace: () => Promise<boolean>;
}

const format = () => import('./session/file');

/** Largest size in bytes of data that are captured with a lab; those of larger ones have to be opened again. */
const MOST_CAPTURED = 2 ** 29;

/** The data of a source as sessions describe them, and as files. */
interface Described {
  source: object;
  files: SourceFile[];
  data: File[];
}

type OpenSource<Example> = Source<Example, unknown, unknown>;

/** Saves a lab's sessions as files, and opens such files, in the right lab and with the right data. */
export class Sessions<Example extends { id: string }> {
  readonly #lab: SessionLab<Example>;
  /** The session that waits until the user opens its data. */
  #waiting: Session | undefined;
  /** The data of the source that was captured last. */
  #described: Described | undefined;
  /** Kinds of unsaved work in sessions that bring a lab back. */
  readonly #kinds = new WeakMap<Session, readonly WorkKind[]>();

  constructor(lab: SessionLab<Example>) {
    this.#lab = lab;
  }

  /** Opens files: a session, with its data if these are not in it, the data that one waits for, or other data. */
  async files(files: File[]): Promise<void> {
    const [file] = files;
    const { states, opening } = this.#lab;
    if (!(await this.#lab.mayReplace())) return;
    try {
      if (await isLesson(files)) throw new Error(text('lessons.elsewhere'));
      const session = await sessionAmong(files);
      // Another session takes the place of the one that waits for its data, even if it is damaged.
      if (session) this.#waiting = undefined;
      if (session)
        await this.#read(
          session,
          files.filter((one) => one !== session),
        );
      else if (this.#waiting) await this.#complete(this.#waiting, files);
      else await opening.files(files);
    } catch (error) {
      states.fail(text('labs.openFailed', { name: file?.name ?? '' }), error);
    }
  }

  /**
   * Opens a session that another lab passes on, or brings the lab back; returns undefined if something else is passed on.
   */
  passedOn({ session, captured }: Handoff): Promise<void> | undefined {
    const { states, opening } = this.#lab;
    const name = session?.source.name ?? captured?.name ?? '';
    const opened = session ? this.#open(session) : captured && this.#bringBack(captured);
    return opened?.catch(async (error) => {
      if (!opening.source) await opening.default();
      states.fail(text('sessions.openFailed', { name }), error);
    });
  }

  /** Forgets the session that waits for its data, if one does. */
  forget(): void {
    this.#waiting = undefined;
  }

  /** Saves the session as a file; `included`: with its data. Data that are opened meanwhile wait until it is saved. */
  async save(included: boolean): Promise<void> {
    const { opening, states } = this.#lab;
    const { source } = opening;
    if (source && states.canChange) await states.enqueue(() => this.#save(source, included));
  }

  async #save(source: OpenSource<Example>, included: boolean): Promise<void> {
    const { opening, page, states } = this.#lab;
    try {
      page.status.say(text('sessions.saving'));
      const [{ describe, writeSession }, content, data] = await Promise.all([format(), this.#content(), source.load()]);
      if (!content) throw new Error(text('sessions.notSaved'));
      const files = await describe(opening.filesOf(data), included || source.isMade === true);
      const bytes = await writeSession(this.#sessionOf(source, files, content));
      page.saving.bytes('vesicle.zip', bytes, 'application/zip');
      this.#lab.onSaved();
    } catch (error) {
      states.fail(text('sessions.saveFailed'), error);
    }
  }

  /** Returns the lab's part of a session, with the edits of its surface and its warnings. */
  async #content(): Promise<object | undefined> {
    const { page, run, content } = this.#lab;
    // A run that is paused and continued ends them.
    const { log: edits = [], undone = [] } = run?.finish ?? {};
    const [warnings, kept] = [page.warnings.all, { edits: [...edits], undone: [...undone] }];
    const body = await content();
    return body && { ...body, ...kept, ...(warnings.length > 0 && { warnings }) };
  }

  #sessionOf(source: OpenSource<Example>, files: SourceFile[], content: object): NewSession {
    const example: string | undefined = source.example?.id;
    const from = { name: source.name, files, ...(example !== undefined && { example }) };
    return { lab: this.#lab.id, hash: this.#lab.address(source), source: from, content };
  }

  /** Returns the lab as it is, after all changes that are under way; undefined if it cannot be saved. */
  async capture(): Promise<Captured | undefined> {
    const { opening, states, work } = this.#lab;
    const { source } = opening;
    if (!source || !states.canChange) return undefined;
    const [{ writeSession }, { files, data }] = await Promise.all([format(), this.#describe(source)]);
    // There is no way to open again what the app has made, if it is too large to be captured.
    if (source.isMade && data.length < files.length) return undefined;
    const { kinds } = work;
    const made = await states.inTurn(async () => {
      if (opening.source !== source || !states.canChange) return undefined;
      const content = await this.#content();
      return content && this.#sessionOf(source, files, content);
    });
    if (!made) return undefined;
    const session = new File([(await writeSession(made)) as BlobPart], `${source.name}${ENDING}`);
    return { name: source.name, hash: made.hash, session, data, isMade: source.isMade === true, kinds };
  }

  /** Returns the data of a source, which are read once as long as it is open. */
  async #describe(source: OpenSource<Example>): Promise<Described> {
    if (this.#described?.source === source) return this.#described;
    const named = this.#lab.opening.filesOf(await source.load());
    const files = await (await format()).describe(named, false);
    const size = files.reduce((sum, file) => sum + file.size, 0);
    const isNeeded = source.example === undefined && size <= MOST_CAPTURED;
    const data = isNeeded ? named.map(({ name, bytes }) => new File([bytes as BlobPart], name)) : [];
    this.#described = { source, files, data };
    return this.#described;
  }

  /** Brings the lab back as it was captured. */
  async #bringBack({ session: file, data, isMade, kinds }: Captured): Promise<void> {
    const session = { ...(await this.#readFile(file)), isSmall: false };
    this.#kinds.set(session, kinds);
    if (isMade) await this.#open(await withData(session, data));
    else if (data.length > 0) await this.#complete(session, [...data]);
    else await this.#open(session);
  }

  /** Opens a session; `beside`: the data that it waits for, if they are there already. */
  async #read(file: File, beside: File[]): Promise<void> {
    const session: Session = { ...(await this.#readFile(file)), isSmall: areSmall([file]) };
    if (beside.length > 0) {
      if (session.lab !== this.#lab.id || !waits(session)) throw new Error(text('sessions.alone'));
      this.#waiting = session;
      await this.#complete(session, beside);
    } else if (session.lab === this.#lab.id) await this.#open(session);
    else this.#lab.passOn({ lab: session.lab, session, name: '', bytes: new Uint8Array(), params: {} });
  }

  async #readFile(file: File): Promise<Session> {
    const { readApart } = await import('./session/apart');
    return readApart(new Uint8Array(await file.arrayBuffer()), this.#lab.sessionWorker);
  }

  /** Opens a session, or asks for its data if it has none. */
  async #open(session: Session): Promise<void> {
    const { opening, page } = this.#lab;
    const { files, name } = session.source;
    this.#waiting = undefined;
    if (files.every(({ content }) => content)) return this.#restore(session, files.map(fileOf));
    if (!waits(session)) return this.#restore(session, []);
    if (!opening.source) await opening.default();
    this.#waiting = session;
    page.banner.show(text('sessions.needsData'), text('sessions.needsDataHint', { name }));
  }

  /** Continues a session with its data, and edits its surface as before. */
  async #restore(session: Session, files: File[]): Promise<void> {
    const { opening, page, run, states } = this.#lab;
    if (await anyForeign(files)) throw new Error(text('sessions.foreign'));
    await opening.session(session, files);
    const { edits, undone, warnings } = session.content;
    if (opening.source?.session !== session) return;
    page.warnings.restore(warnings);
    const repeated = run?.finish?.repeat(edits, undone, session.isSmall);
    await repeated?.catch((error) => states.fail(text('sessions.editsFailed'), error));
    const kinds = this.#kinds.get(session);
    if (kinds) this.#lab.work.resume(kinds);
  }

  /** Opens the session that waits for its data, if these are among `files`. */
  async #complete(session: Session, files: File[]): Promise<void> {
    const { matching } = await format();
    const named = await readFiles(files);
    const found = await matching(session.source.files, named);
    this.#waiting = undefined;
    await this.#restore(
      session,
      found.map(({ name, bytes, notes }) => noted(new File([bytes as BlobPart], name), notes)),
    );
  }
}

/** Returns the session among files that are opened together, if there is one. */
async function sessionAmong(files: File[]): Promise<File | undefined> {
  const [file] = files;
  if (file && files.length === 1) return (await isSession(file)) ? file : undefined;
  // Of a folder of thousands of slices not each is read.
  const [session, ...more] = files.filter(isNamedSession);
  if (more.length > 0) throw new Error(text('sessions.alone'));
  return session;
}

/** Returns a session with the files of its data, which are as many as it describes. */
async function withData(session: Session, data: readonly File[]): Promise<Session> {
  const contents = await Promise.all(data.map(async (file) => new Uint8Array(await file.arrayBuffer())));
  const files = session.source.files.map((file, index) => ({ ...file, content: contents[index] }));
  return { ...session, source: { ...session.source, files } } as Session;
}

/** Returns whether a session has neither its data nor an example. */
const waits = ({ source: { files, example } }: Session) =>
  example === undefined && !files.every(({ content }) => content);

const fileOf = ({ name, content, notes }: SourceFile) => noted(new File([content as BlobPart], name), notes);
