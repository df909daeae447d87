import { choice } from './check.js';
import { call } from './runtime.js';
import { deformableParamSpecs, implicitParamSpecs, multiresParamSpecs, trackingParamSpecs } from './vesicle.js';

/** One parameter of a method, described so that a page can build a control for it. */
export interface ParamSpec {
  /** As in the method's parameters. */
  name: string;
  /** A few words for a label. */
  label: string;
  /** One sentence a student understands. */
  help: string;
  /** As in the paper: 'αc', 'πI', 'δ', 'τ'. */
  symbol?: string;
  type: 'number' | 'integer' | 'boolean' | 'choice';
  default: unknown;
  min?: number;
  max?: number;
  /** Of a slider. */
  step?: number;
  /** Of a slider. */
  scale?: 'linear' | 'log';
  unit?: string;
  /** For type 'choice'. */
  choices?: string[];
}

/**
 * The parameters of a method, in the order they are best shown.
 *
 * @throws {@link VesicleError} `invalid-argument`: no such method.
 */
export function paramSpecs(method: keyof typeof SPECS): ParamSpec[] {
  choice('method', method, Object.keys(SPECS));
  return call(() => SPECS[method]() as ParamSpec[]);
}

const SPECS = {
  deformable: deformableParamSpecs,
  implicit: implicitParamSpecs,
  tracking: trackingParamSpecs,
  multires: multiresParamSpecs,
};
