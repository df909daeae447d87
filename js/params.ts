import { choice } from './check.js';
import { call } from './runtime.js';

/** Description of one parameter of a method, from which a page can build a control. */
export interface ParamSpec {
  /** Name of the property in the method's parameters. */
  name: string;
  /** Short label of a control for the parameter. */
  label: string;
  /** Description of the parameter in one sentence, for students. */
  help: string;
  /** Symbol of the parameter in the paper of the method, such as 'αc' or 'πI'. */
  symbol?: string;
  type: 'number' | 'integer' | 'boolean' | 'choice';
  default: unknown;
  min?: number;
  max?: number;
  /** Suggested step of a slider for the parameter. */
  step?: number;
  /** How values of the parameter are spread over a slider. */
  scale?: 'linear' | 'log';
  unit?: string;
  /**
   * Accepted words for a parameter of type 'choice'; if `min` is set, numbers are accepted, too. Of one of type 'number',
   * words that are accepted instead of a number.
   */
  choices?: string[];
}

/**
 * Makes the function `paramSpecs` of an entry point from the functions of the WebAssembly module that return the
 * specifications, by method.
 */
export function paramSpecsOf<Method extends string>(
  specs: Record<Method, () => unknown>,
): (method: Method) => ParamSpec[] {
  return (method) => {
    choice('method', method, Object.keys(specs));
    return call(() => specs[method]() as ParamSpec[]);
  };
}
