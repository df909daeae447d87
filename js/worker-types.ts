// Types of the library as seen from the page's side of a worker, derived from those of the library itself so that they
// cannot diverge.
import type * as vesicle from './index.js';

/** The exports of `vesicle`. */
export type Library = typeof vesicle;

type Callable = (...args: never) => unknown;

/** Names of the classes whose objects live in the worker. */
export type ClassName = {
  [K in keyof Library]: Library[K] extends Callable
    ? never
    : Library[K] extends { prototype: { free(): void } }
      ? K
      : never;
}[keyof Library];

/**
 * Names of the free functions that run in the worker. A worker cannot start synchronously, so there is no `initSync`.
 */
export type FunctionName = Exclude<
  { [K in keyof Library]: Library[K] extends Callable ? K : never }[keyof Library],
  'default' | 'initSync'
>;

/** Any object of the library, as it exists in the worker. */
export type LibraryObject = Library[ClassName]['prototype'];

/** A `Volume` of the library, in the worker. */
export interface Volume extends Remote<vesicle.Volume> {}
/** A `Mesh` of the library, in the worker. */
export interface Mesh extends Remote<vesicle.Mesh> {}
/** A `DeformableModel` of the library, in the worker. */
export interface DeformableModel extends Remote<vesicle.DeformableModel> {}
/** An `ImplicitSurface` of the library, in the worker. */
export interface ImplicitSurface extends Remote<vesicle.ImplicitSurface> {}
/** A `MultiresolutionModel` of the library, in the worker. */
export interface MultiresolutionModel extends Remote<vesicle.MultiresolutionModel> {}
/** A `SurfaceTracker` of the library, in the worker. */
export interface SurfaceTracker extends Remote<vesicle.SurfaceTracker> {}
/** Interface that all four models in the worker implement. */
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

type Opaque = ArrayBufferView | AbortSignal | Callable;

type SwapRemotes<T> = T extends LibraryObject
  ? Remotes[NameOf<T>]
  : T extends Opaque
    ? T
    : T extends object
      ? { [K in keyof T]: SwapRemotes<T[K]> }
      : T;

/**
 * The type T with remote objects in place of the library's. A type that contains none of them is T itself, so that it
 * keeps its name.
 */
export type WithRemotes<T> = [T, SwapRemotes<T>] extends [SwapRemotes<T>, T] ? T : SwapRemotes<T>;

type Arguments<A extends unknown[]> = { [K in keyof A]: WithRemotes<A[K]> };

// Method types are compared bivariantly, so that each remote model is a Stepper, as in the library.
type Method<A extends unknown[], R> = { method(...args: A): R }['method'];

type Member<T> = [T] extends [LibraryObject]
  ? WithRemotes<T>
  : [T] extends [(...args: infer A) => infer R]
    ? Method<Arguments<A>, Promise<WithRemotes<Awaited<R>>>>
    : Promise<WithRemotes<T>>;

/**
 * Proxy of an object in the worker: methods and properties return promises; live meshes are available synchronously.
 */
export type Remote<T> = {
  readonly [K in keyof T as K extends string ? Exclude<K, 'free'> : never]: Member<T[K]>;
} & {
  /**
   * Frees the memory in the worker; the object cannot be used afterwards. A model's mesh is freed only with its model.
   */
  free(): void;
  /** The same as `free()`, for `using`. */
  [Symbol.dispose](): void;
};

/** Proxy of a free function that runs in the worker. */
export type RemoteFunction<N extends FunctionName> = Member<Library[N]>;

/** Proxy of a class whose objects live in the worker. */
export type RemoteClass<N extends ClassName> = {
  readonly [K in keyof Library[N] as Exclude<K, 'prototype'>]: Member<Library[N][K]>;
} & Constructor<Library[N]>;

type Constructor<C> = C extends new (
  ...args: infer A
) => infer I
  ? {
      /**
       * Returns an object at once, before it is created in the worker; if that fails, every promise of the object
       * rejects.
       */
      new (...args: Arguments<A>): WithRemotes<I>;
      /** Resolves with an object once it is created in the worker; rejects if the creation fails. */
      create(...args: Arguments<A>): Promise<WithRemotes<I>>;
    }
  : // For classes without a public constructor; only for `instanceof`.
    C extends { prototype: infer I }
    ? abstract new (
        ...args: never
      ) => WithRemotes<I>
    : never;
