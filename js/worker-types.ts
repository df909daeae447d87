// Types of the library as seen from the page's side of a worker, derived from those of the library itself so that they
// cannot diverge.
import type * as vesicle from './index.js';

/** The exports of `vesicle`, from which the types of `vesicle/worker` are derived. */
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

/** Any volume, mesh or model of the library, as it exists in the worker. */
export type LibraryObject = Library[ClassName]['prototype'];

/** Proxy of a `Volume` in the worker; its methods and properties return promises. */
export interface Volume extends Remote<vesicle.Volume> {}
/** Proxy of a `Mesh` in the worker; its methods and properties return promises. */
export interface Mesh extends Remote<vesicle.Mesh> {}
/** Proxy of a `DeformableModel` in the worker; its methods and properties, except live meshes, return promises. */
export interface DeformableModel extends Remote<vesicle.DeformableModel> {}
/** Proxy of an `ImplicitSurface` in the worker; its methods and properties, except live meshes, return promises. */
export interface ImplicitSurface extends Remote<vesicle.ImplicitSurface> {}
/** Proxy of a `MultiresolutionModel` in the worker; its methods and properties, except live meshes, return promises. */
export interface MultiresolutionModel extends Remote<vesicle.MultiresolutionModel> {}
/** Proxy of a `SurfaceTracker` in the worker; its methods and properties, except live meshes, return promises. */
export interface SurfaceTracker extends Remote<vesicle.SurfaceTracker> {}
/** Proxy of `LabelSurfaces` in the worker; its methods and properties return promises. */
export interface LabelSurfaces extends Remote<vesicle.LabelSurfaces> {}
/** Interface of the proxies of all four models in the worker. */
export interface Stepper extends Remote<vesicle.Stepper> {}

interface Remotes {
  Volume: Volume;
  Mesh: Mesh;
  DeformableModel: DeformableModel;
  ImplicitSurface: ImplicitSurface;
  MultiresolutionModel: MultiresolutionModel;
  SurfaceTracker: SurfaceTracker;
  LabelSurfaces: LabelSurfaces;
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
 * The type T with the proxies of `vesicle/worker` in place of the library's volumes, meshes and models. A type that
 * contains none of these is T itself, so that it keeps its name.
 */
export type WithRemotes<T> = [T, SwapRemotes<T>] extends [SwapRemotes<T>, T] ? T : SwapRemotes<T>;

type Arguments<A extends unknown[]> = { [K in keyof A]: WithRemotes<A[K]> };

// Method types are compared bivariantly, so that each remote model is a Stepper, as in the library.
type Method<A extends unknown[], R> = { method(...args: A): R }['method'];

type Members<T> = { [K in keyof T]: Member<T[K]> };

/** The operations of `Mesh.inSlices` of a proxy. */
export type MeshInSlices = Members<vesicle.MeshInSlices>;
/** Those of `Volume.inSlices`. */
export type VolumeInSlices = Members<vesicle.VolumeInSlices>;
/** Those of `ImplicitSurface.inSlices`. */
export type ImplicitInSlices = Members<vesicle.ImplicitInSlices>;

type Member<T> = [T] extends [LibraryObject]
  ? WithRemotes<T>
  : [T] extends [(...args: infer A) => vesicle.MeshInSlices]
    ? Method<A, MeshInSlices>
    : [T] extends [(...args: infer A) => vesicle.VolumeInSlices]
      ? Method<A, VolumeInSlices>
      : [T] extends [(...args: infer A) => vesicle.ImplicitInSlices]
        ? Method<A, ImplicitInSlices>
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

/** Asynchronous form of a free function of the library, which runs in the worker. */
export type RemoteFunction<N extends FunctionName> = Member<Library[N]>;

/** Proxy of a class of the library whose objects live in the worker. */
export type RemoteClass<N extends ClassName> = {
  readonly [K in keyof Library[N] as Exclude<K, 'prototype'>]: Member<Library[N][K]>;
} & Constructor<Library[N]>;

type Constructor<C> = C extends new (
  ...args: infer A
) => infer I
  ? {
      /**
       * Returns a proxy at once, before its object is created in the worker; if the creation fails, every promise of
       * the proxy rejects.
       */
      new (...args: Arguments<A>): WithRemotes<I>;
      /** Resolves with a proxy once its object is created in the worker; rejects if the creation fails. */
      create(...args: Arguments<A>): Promise<WithRemotes<I>>;
    }
  : // For classes without a public constructor; only for `instanceof`.
    C extends { prototype: infer I }
    ? abstract new (
        ...args: never
      ) => WithRemotes<I>
    : never;
