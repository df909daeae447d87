import { VesicleError } from 'vesicle/channel';
import type { Failure } from './protocol';

/**
 * Error of a request that a lab's worker could not fulfil. `code` is that of a VesicleError, or 'internal' if the
 * engine (the worker's WebAssembly module) broke.
 */
export class RequestError extends Error {
  readonly code: string;

  constructor(failure: Failure) {
    super(failure.message);
    this.name = 'RequestError';
    this.code = failure.code;
  }
}

/**
 * Converts any thrown value to a `Failure`, the error code and message that the page displays; an error that is no
 * `RequestError` gets the code 'page'.
 */
export function toFailure(error: unknown): Failure {
  if (error instanceof RequestError) return { code: error.code, message: error.message };
  return { code: 'page', message: error instanceof Error ? error.message : String(error) };
}

/** Converts an error in a worker to a `Failure`; errors that are not the library's get the code 'internal'. */
export function workerFailure(error: unknown): Failure {
  if (error instanceof VesicleError && error.code !== 'crash')
    return { code: error.code, message: forUsers(error.message) };
  return { code: 'internal', message: error instanceof Error ? error.message : String(error) };
}

/** Returns a message of the library without what only those who call it can do. */
function forUsers(message: string): string {
  return message.replace(/:? \(?free\(\) what is no longer needed\)?/, '');
}
