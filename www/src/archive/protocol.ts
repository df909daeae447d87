/** Messages between the page and the worker that unpacks archives. */

export interface Request {
  archive: Uint8Array;
  mostBytes: number;
  refusal: string;
}

export type Reply = { files: Record<string, Uint8Array> } | { message: string; isTooLarge: boolean };
