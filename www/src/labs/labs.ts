/** What the page and its labs have to do with each other. */
import type { ParamValues } from '../protocol';

/** A volume that one lab passes on to the Extract lab, with the parameters that suit it. */
export interface PassedOn {
  name: string;
  bytes: Uint8Array;
  params: ParamValues;
}

export interface Lab {
  start(passedOn?: PassedOn): Promise<void>;
  /** Gives worker, GPU memory and listeners back. */
  close(): void;
}

/** Opens the Extract lab on a volume. */
export type PassOn = (volume: PassedOn) => void;

export interface LabKind {
  /** As the address has it after the hash. */
  id: string;
  name: string;
  tagline: string;
  open: (root: HTMLElement, help: HTMLElement, passOn: PassOn) => Lab;
}
