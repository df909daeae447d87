import { VesicleError } from 'vesicle';
import type { Failure } from './protocol';

/**
 * Error for a request that the app's own code rejects, such as a bad file or a request without a model; has the code of
 * a VesicleError.
 */
export class Refusal extends Error {
  readonly code: string;

  constructor(code: string, message: string) {
    super(message);
    this.code = code;
  }
}

/**
 * Converts an error to a message for the page; errors that are neither the library's nor a {@link Refusal} get the code
 * 'internal'.
 */
export function toFailure(error: unknown): Failure {
  const isKnown = error instanceof VesicleError || error instanceof Refusal;
  if (isKnown && error.code !== 'crash') return { code: error.code, message: forUsers(error.message) };
  return { code: 'internal', message: error instanceof Error ? error.message : String(error) };
}

/** Returns a message of the library without what only those who call it can do. */
function forUsers(message: string): string {
  return message.replace(/:? \(?free\(\) what is no longer needed\)?/, '');
}
