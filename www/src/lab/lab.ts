/** The interface between the page and its labs. */
import type { ParamValues } from '../engine/protocol';
import type { Warning } from '../engine/warnings';
import type { LAB_IDS } from './address';
import type { Session } from './session/file';
import type { Work } from './work';

/**
 * Data that one lab passes to another: a volume for Extract, with suitable parameters, a mesh for Sculpt, or a session of
 * the other lab.
 */
export interface Handoff {
  /** The receiving lab's name in addresses. */
  lab: (typeof LAB_IDS)[number];
  /** The session, if it is one; name, bytes and parameters are then empty. */
  session?: Session;
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
  start(passedOn?: Handoff): Promise<void>;
  /** Releases the worker, GPU memory and event listeners. */
  close(): void;
}

/** Function by which a lab opens another lab with data that it passes on. */
export type OpenInLab = (passedOn: Handoff) => void;

/** A lab as the page lists it, before its code is loaded. */
export interface LabKind {
  /** The lab's name in addresses, after the #. */
  id: string;
  name: string;
  tagline: string;
  /** Address of the lab's page in the documentation. */
  guide: string;
  /** Starts the lab's worker. */
  spawn: () => Worker;
  /** Loads the lab's code; returns the lab's class. */
  load: () => Promise<new (root: HTMLElement, help: HTMLElement, passOn: OpenInLab) => Lab>;
}
