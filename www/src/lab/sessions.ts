import { areSmall } from '../engine/small-files';
import type { Finish } from '../finish';
import { anyForeign, noted } from '../importers';
import { readFiles } from '../importers/files';
import { isLesson } from '../importers/lessons';
import { isNamedSession, isSession } from '../importers/sessions';
import type { ErrorBanner, StatusLine } from '../kit/status';
import type { WarningList } from '../kit/warnings';
import { text } from '../texts';
import type { LAB_IDS } from './address';
import type { Handoff, OpenInLab } from './lab';
import type { Opening, Source } from './opening';
import type { Saving } from './saving';
import type { Session, SourceFile } from './session/file';
import type { LabStates } from './states';

/** A lab, as its sessions need it. */
interface SessionLab {
  id: (typeof LAB_IDS)[number];
  ui: {
    banner: ErrorBanner;
    status: StatusLine;
    saving: Saving;
    warnings: WarningList;
    finish?: Finish | undefined;
  };
  states: LabStates;
  // biome-ignore lint/suspicious/noExplicitAny: sessions do not look into links, data and models
  opening: Opening<any, any, any, any>;
  passOn: OpenInLab;
  // biome-ignore lint/suspicious/noExplicitAny: as above
  address: (source: Source<any, any, any>) => string;
  content: () => Promise<Record<string, unknown> | undefined>;
  /** Called when a session was saved. */
  onSaved: () => void;
  /** Whether other data may take the place of those that are open. */
  mayReplace: () => Promise<boolean>;
}

const format = () => import('./session/file');

/** Saves a lab's sessions as files, and opens such files, in the right lab and with the right data. */
export class Sessions {
  readonly #lab: SessionLab;
  /** The session that waits until the user opens its data. */
  #waiting: Session | undefined;

  constructor(lab: SessionLab) {
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

  /** Opens a session that another lab passes on; returns undefined if it passes on something else. */
  passedOn({ session }: Handoff): Promise<void> | undefined {
    const { states, opening } = this.#lab;
    return (
      session &&
      this.#open(session).catch(async (error) => {
        if (!opening.source) await opening.default();
        states.fail(text('labs.openFailed', { name: session.source.name }), error);
      })
    );
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

  async #save(source: NonNullable<SessionLab['opening']['source']>, included: boolean): Promise<void> {
    const { id: lab, opening, ui, states, address, content } = this.#lab;
    try {
      ui.status.say(text('sessions.saving'));
      // A run that is paused and continued ends them.
      const { log: edits = [], undone = [] } = ui.finish ?? {};
      const warnings = ui.warnings.all;
      const [{ describe, writeSession }, body, data] = await Promise.all([format(), content(), source.load()]);
      if (!body) throw new Error(text('sessions.notSaved'));
      const files = await describe(opening.filesOf(data), included || source.isMade === true);
      const example: string | undefined = source.example?.id;
      const from = { name: source.name, files, ...(example !== undefined && { example }) };
      const bytes = await writeSession({
        lab,
        hash: address(source),
        source: from,
        content: { ...body, edits, undone, ...(warnings.length > 0 && { warnings }) },
      });
      ui.saving.bytes('vesicle.zip', bytes, 'application/zip');
      this.#lab.onSaved();
    } catch (error) {
      states.fail(text('sessions.saveFailed'), error);
    }
  }

  /** Opens a session; `beside`: the data that it waits for, if they are there already. */
  async #read(file: File, beside: File[]): Promise<void> {
    const { readApart } = await import('./session/apart');
    const read = await readApart(new Uint8Array(await file.arrayBuffer()));
    const session: Session = { ...read, isSmall: areSmall([file]) };
    if (beside.length > 0) {
      if (session.lab !== this.#lab.id || !waits(session)) throw new Error(text('sessions.alone'));
      this.#waiting = session;
      await this.#complete(session, beside);
    } else if (session.lab === this.#lab.id) await this.#open(session);
    else this.#lab.passOn({ lab: session.lab, session, name: '', bytes: new Uint8Array(), params: {} });
  }

  /** Opens a session, or asks for its data if it has none. */
  async #open(session: Session): Promise<void> {
    const { opening, ui } = this.#lab;
    const { files, name } = session.source;
    this.#waiting = undefined;
    if (files.every(({ content }) => content)) return this.#restore(session, files.map(fileOf));
    if (!waits(session)) return this.#restore(session, []);
    if (!opening.source) await opening.default();
    this.#waiting = session;
    ui.banner.show(text('sessions.needsData'), text('sessions.needsDataHint', { name }));
  }

  /** Continues a session with its data, and edits its surface as before. */
  async #restore(session: Session, files: File[]): Promise<void> {
    const { opening, ui, states } = this.#lab;
    if (await anyForeign(files)) throw new Error(text('sessions.foreign'));
    await opening.session(session, files);
    const { edits, undone, warnings } = session.content;
    if (opening.source?.session !== session) return;
    ui.warnings.restore(warnings);
    const repeated = ui.finish?.repeat(edits, undone, session.isSmall);
    await repeated?.catch((error) => states.fail(text('sessions.editsFailed'), error));
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

/** Returns whether a session has neither its data nor an example. */
const waits = ({ source: { files, example } }: Session) =>
  example === undefined && !files.every(({ content }) => content);

const fileOf = ({ name, content, notes }: SourceFile) => noted(new File([content as BlobPart], name), notes);
