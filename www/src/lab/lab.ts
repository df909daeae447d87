/** The interface between the page and its labs. */
import type { ParamValues } from '../engine/protocol';
import type { Warning } from '../engine/warnings';
import type { LabId } from './address';
import type { Session } from './session/check';
import type { Work, WorkKind } from './work';

/** A lab as it is, so that it can be brought back. */
export interface Captured {
  /** Name of the data. */
  name: string;
  /** Address of the data with the settings in force. */
  hash: string;
  session: File;
  /** The files that the session needs: the same list as long as the data stay open. */
  data: readonly File[];
  /** Whether the data are nowhere but in the app. */
  isMade: boolean;
  /** Kinds of work in it that is not saved. */
  kinds: readonly WorkKind[];
}

/**
 * Data that one lab passes to another: a volume for Extract, with suitable parameters, a mesh for Sculpt, or a session of
 * the other lab.
 */
export interface Handoff {
  /** The receiving lab's name in addresses. */
  lab: LabId;
  /** The session, if it is one; name, bytes and parameters are then empty. */
  session?: Session;
  /** The lab as it was, if it is to be brought back; name, bytes and parameters are then empty. */
  captured?: Captured;
  name: string;
  /** Content of a volume or mesh file. */
  bytes: Uint8Array;
  params: ParamValues;
  /** Warnings about it, which its file does not have. */
  warnings?: readonly Warning[];
}

/** A lab that is open, as the page controls it. */
export interface Lab {
  /** The work of the user that is not saved. */
  readonly work: Work;
  /** Whether the model runs, so that the lab is not the same for long. */
  readonly isRunning: boolean;
  /** Whether its address alone brings the lab back as it is. */
  readonly isPlain: boolean;
  /** Called when the lab may have become another than it was. */
  onChange: () => void;
  /** Called when the user asks what is kept of unsaved work. */
  onShowKept: () => void;
  /** Returns what brings the lab back as it is; undefined if its model cannot be saved at the moment. */
  capture(): Promise<Captured | undefined>;
  start(passedOn?: Handoff): Promise<void>;
  /** Releases the worker, GPU memory and event listeners. */
  close(): void;
}

/** Function by which a lab opens another lab with data that it passes on. */
export type OpenInLab = (passedOn: Handoff) => void;

/** A lab's place in the app: its element, that of its help, and the way to other labs. */
export interface LabPlace {
  root: HTMLElement;
  help: HTMLElement;
  /** Address of the lab's page in the documentation. */
  guide: string;
  passOn: OpenInLab;
  /** Starts a worker that reads sessions of all labs, with messages in the language `name`. */
  sessionWorker: (name: string) => Worker;
}

/** A lab as the page lists it, before its code is loaded. */
export interface LabKind {
  /** The lab's name in addresses, after the #. */
  id: LabId;
  name: string;
  tagline: string;
  /** Address of the lab's page in the documentation. */
  guide: string;
  /** Starts the lab's worker. */
  spawn: () => Worker;
  /** Loads the lab's code; returns the function that makes the lab. */
  load: () => Promise<(place: LabPlace) => Lab>;
}
