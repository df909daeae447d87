/** Decoders of images, which have no declarations of their own; `vesicle/dicom` checks what it uses of them. */
declare module '@cornerstonejs/codec-libjpeg-turbo-8bit/decodewasmjs';
declare module '@cornerstonejs/codec-charls/decodewasmjs';
declare module '@cornerstonejs/codec-openjpeg/decodewasmjs';
declare module '@cornerstonejs/codec-openjph/wasmjs';

/** Decoder of meshes; `vesicle/gltf` checks what it uses of it. */
declare module 'draco3dgltf/draco_decoder_gltf_nodejs.js';
