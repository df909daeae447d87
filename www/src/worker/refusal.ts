import { VesicleError } from 'vesicle';
import type { Failure } from '../protocol';

/** Error for a request that is invalid in the current state and was rejected before the library was called. */
export class Refusal extends Error {
  readonly code: string;

  constructor(code: string, message: string) {
    super(message);
    this.code = code;
  }
}

/** Converts an error to a message for the page. Errors other than the library's and refusals are internal failures. */
export function toFailure(error: unknown): Failure {
  if (error instanceof VesicleError || error instanceof Refusal) return { code: error.code, message: error.message };
  return { code: 'internal', message: error instanceof Error ? error.message : String(error) };
}
