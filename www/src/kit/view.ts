/**
 * The options of a lab's view, declared once: their controls, and their parts of links and sessions, are made from this.
 * A declaration has keys of texts, so that a worker which checks sessions needs no texts.
 */
import type { VertexQuantity } from '../engine/protocol';
import type { TextKey } from '../texts';

interface Labelled {
  label: TextKey;
}

/** An option that is on or off. */
export interface Switch extends Labelled {
  /** The value at first. */
  initial: boolean;
}

/** An option with a list of values, in the order of its entries. */
export interface OneOf<Value extends string = string> extends Labelled {
  initial: Value;
  entries: Readonly<Record<Value, TextKey>>;
}

/** A number from 0 to 1. */
export interface Fraction extends Labelled {
  initial: number;
  step: number;
}

export type ViewOption = Switch | OneOf | Fraction;
/** The options of a view, by name, in the order of their controls. */
export type ViewDeclaration = Readonly<Record<string, ViewOption>>;

/** The values of declared options. */
export type OptionsOf<Declared extends ViewDeclaration> = {
  -readonly [Name in keyof Declared]: Declared[Name] extends OneOf<infer Value> ? Value : Declared[Name]['initial'];
};

export const onOff = (label: TextKey, initial: boolean): Switch => ({ label, initial });
export const oneOf = <const Value extends string>(
  label: TextKey,
  entries: Readonly<Record<Value, TextKey>>,
  initial: NoInfer<Value>,
): OneOf<Value> => ({ label, entries, initial });
export const fraction = (label: TextKey, initial: number, step: number): Fraction => ({ label, initial, step });

/** Returns the values that declared options have at first. */
export function initialOptions<Declared extends ViewDeclaration>(declared: Declared): OptionsOf<Declared> {
  const values = Object.entries(declared).map(([name, { initial }]) => [name, initial]);
  return Object.fromEntries(values) as OptionsOf<Declared>;
}

/** Colouring of the Extract lab's surface: plain, by connected component, or by a quantity at the vertices. */
export type ColorMode = 'plain' | 'component' | VertexQuantity;
/**
 * Placement of the slices in the 3D view: on the walls behind the surface, at their positions in the volume, or hidden.
 */
export type SlicePlacement = 'walls' | 'in place' | 'hidden';

// Options that several labs have.
export const SURFACE = onOff('controls.viewSurface', true);
export const EDGES = onOff('controls.viewWireframe', false);
export const SLICES = oneOf<SlicePlacement>(
  'controls.slices',
  {
    walls: 'controls.placementWalls',
    'in place': 'controls.placementInPlace',
    hidden: 'controls.placementHidden',
  },
  'walls',
);
