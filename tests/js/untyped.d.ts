/** Packages without declarations of their own. */
declare module 'draco3dgltf';
