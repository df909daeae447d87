/** What the page and its labs have to do with each other. */
import type { ParamValues } from '../protocol';

/** What one lab passes on to another: a volume to Extract, with the parameters that suit it, or a mesh to Sculpt. */
export interface PassedOn {
  /** Its address, without the hash. */
  lab: 'extract' | 'sculpt';
  name: string;
  /** A file. */
  bytes: Uint8Array;
  params: ParamValues;
}

export interface Lab {
  start(passedOn?: PassedOn): Promise<void>;
  /** Gives worker, GPU memory and listeners back. */
  close(): void;
}

/** Opens another lab on it. */
export type PassOn = (passedOn: PassedOn) => void;

export interface LabKind {
  /** As the address has it after the hash. */
  id: string;
  name: string;
  tagline: string;
  /** Where the documentation says how it works. */
  guide: string;
  /** Starts its worker. */
  spawn: () => Worker;
  /** Fetches its code. */
  load: () => Promise<new (root: HTMLElement, help: HTMLElement, passOn: PassOn) => Lab>;
}
