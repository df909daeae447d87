import { VesicleError } from 'vesicle';
import type { Failure } from '../protocol';

/** A request that makes no sense now; the library was not even asked. */
export class Refusal extends Error {
  readonly code: string;

  constructor(code: string, message: string) {
    super(message);
    this.code = code;
  }
}

/** What was wrong, for the page. Any other error means that the engine itself broke. */
export function toFailure(error: unknown): Failure {
  if (error instanceof VesicleError || error instanceof Refusal) return { code: error.code, message: error.message };
  return { code: 'internal', message: error instanceof Error ? error.message : String(error) };
}
