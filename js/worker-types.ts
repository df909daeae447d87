// The library's types as they are seen from the other side of a worker, made from those of the library itself, so that the
// two cannot drift apart.
import type * as vesicle from './index.js';

/** What `vesicle` exports. */
export type Library = typeof vesicle;

type Callable = (...args: never) => unknown;

/** The classes whose objects are in the worker. */
export type ClassName = {
  [K in keyof Library]: Library[K] extends Callable
    ? never
    : Library[K] extends { prototype: { free(): void } }
      ? K
      : never;
}[keyof Library];

/** The functions that are done in the worker. A worker cannot be started at once: there is no `initSync`. */
export type FunctionName = Exclude<
  { [K in keyof Library]: Library[K] extends Callable ? K : never }[keyof Library],
  'default' | 'initSync'
>;

/** An object of the library, as it is in the worker. */
export type Own = Library[ClassName]['prototype'];

/** A volume in the worker. */
export interface Volume extends Remote<vesicle.Volume> {}
/** A mesh in the worker. */
export interface Mesh extends Remote<vesicle.Mesh> {}
/** A deformable model in the worker. */
export interface DeformableModel extends Remote<vesicle.DeformableModel> {}
/** An implicit surface in the worker. */
export interface ImplicitSurface extends Remote<vesicle.ImplicitSurface> {}
/** A multiresolution model in the worker. */
export interface MultiresolutionModel extends Remote<vesicle.MultiresolutionModel> {}
/** A surface tracker in the worker. */
export interface SurfaceTracker extends Remote<vesicle.SurfaceTracker> {}
/** What every method can do, from the other side. */
export interface Stepper extends Remote<vesicle.Stepper> {}

interface Remotes {
  Volume: Volume;
  Mesh: Mesh;
  DeformableModel: DeformableModel;
  ImplicitSurface: ImplicitSurface;
  MultiresolutionModel: MultiresolutionModel;
  SurfaceTracker: SurfaceTracker;
}

type NameOf<T> = { [N in ClassName]: T extends Library[N]['prototype'] ? N : never }[ClassName];

type Whole = ArrayBufferView | AbortSignal | Callable;

type Swapped<T> = T extends Own
  ? Remotes[NameOf<T>]
  : T extends Whole
    ? T
    : T extends object
      ? { [K in keyof T]: Swapped<T[K]> }
      : T;

/** A type with remote objects in place of the library's. One that has none of them keeps its name. */
export type There<T> = [T, Swapped<T>] extends [Swapped<T>, T] ? T : Swapped<T>;

type Arguments<A extends unknown[]> = { [K in keyof A]: There<A[K]> };

// With the leniency of methods, so that each model is a Stepper here as it is there.
type Method<A extends unknown[], R> = { method(...args: A): R }['method'];

type Member<T> = [T] extends [Own]
  ? There<T>
  : [T] extends [(...args: infer A) => infer R]
    ? Method<Arguments<A>, Promise<There<Awaited<R>>>>
    : Promise<There<T>>;

/** An object on the other side: promises for what its methods and properties give; live meshes are there at once. */
export type Remote<T> = {
  readonly [K in keyof T as K extends string ? Exclude<K, 'free'> : never]: Member<T[K]>;
} & {
  /** Gives the memory in the worker back; the object cannot be used afterwards. A model's mesh goes with its model only. */
  free(): void;
  /** The same as `free()`, for `using`. */
  [Symbol.dispose](): void;
};

/** A function that is done in the worker. */
export type RemoteFunction<N extends FunctionName> = Member<Library[N]>;

/** A class whose objects are in the worker. */
export type RemoteClass<N extends ClassName> = {
  readonly [K in keyof Library[N] as Exclude<K, 'prototype'>]: Member<Library[N][K]>;
} & Maker<Library[N]>;

type Maker<C> = C extends new (
  ...args: infer A
) => infer I
  ? {
      /** An object at once; if it cannot be made, every promise asked of it rejects. */
      new (...args: Arguments<A>): There<I>;
      /** An object that is known to be made; else rejects. */
      create(...args: Arguments<A>): Promise<There<I>>;
    }
  : // Made by its functions, never by `new`; this is for `instanceof`.
    C extends { prototype: infer I }
    ? abstract new (
        ...args: never
      ) => There<I>
    : never;
