import type { ParamValues, Unit } from '../../engine/protocol';
import type { Shape } from '../../engine/shapes';
import { text } from '../../texts';

/** An example volume of the Extract lab, with suitable settings and credits. */
export interface Example {
  id: string;
  name: string;
  /** Source of the voxels: a file served with the page, or a shape that the worker computes. */
  source: { file: string } | { shape: Shape };
  /** Unit of lengths in the volume's world space; empty if the file does not state one. */
  unit: Unit;
  levels: number;
  /**
   * Target edge length of the surface on the finest pyramid level, in world units; if undefined, the model derives it
   * from the voxel size.
   */
  edge?: number;
  params: ParamValues & { iso: number };
  credit: string;
}

const HEAD_CREDIT = text('extractPresets.headCredit');
const BONE = { iso: 95, isoForce: -1, rigidity: 0.1 };

/** The example volumes of the Extract lab. The first one opens by default. */
export const EXAMPLES: [Example, ...Example[]] = [
  {
    id: 'head-bone',
    name: text('extractPresets.headBoneName'),
    source: { file: 'visible-human-head.nii.gz' },
    unit: 'mm',
    levels: 1,
    // Bone thinner than the contact distance is eroded from its rims; shorter edges preserve more of it.
    edge: 2.2,
    params: { ...BONE, isoForce: -3, rigidity: 0.05 },
    credit: HEAD_CREDIT,
  },
  {
    id: 'head-skin',
    name: text('extractPresets.headSkinName'),
    source: { file: 'visible-human-head.nii.gz' },
    unit: 'mm',
    levels: 3,
    params: { ...BONE, iso: 35 },
    credit: HEAD_CREDIT,
  },
  {
    id: 'head-full',
    name: text('extractPresets.headFullName'),
    source: { file: 'visible-human-head-full.nii.gz' },
    unit: 'mm',
    levels: 2,
    params: BONE,
    credit: HEAD_CREDIT,
  },
  {
    id: 'tooth',
    name: text('extractPresets.toothName'),
    source: { file: 'tooth.nrrd' },
    unit: '',
    levels: 2,
    // Halfway between the intensities of the holder of the tooth and of dentine.
    params: { iso: 600, isoForce: -1, rigidity: 0.2 },
    credit: text('extractPresets.toothCredit'),
  },
  {
    id: 'ovule',
    name: text('extractPresets.ovuleName'),
    source: { file: 'ovule.nrrd' },
    unit: 'µm',
    levels: 1,
    params: { iso: 120, isoForce: -1, rigidity: 0.2 },
    credit: text('extractPresets.ovuleCredit'),
  },
  {
    id: 'linked-rings',
    name: text('extractPresets.linkedRingsName'),
    source: { shape: 'linked rings' },
    unit: '',
    levels: 1,
    params: { iso: 127.5, isoForce: -1, rigidity: 0.1, stiffness: 0.1 },
    credit: text('extractPresets.linkedRingsCredit'),
  },
  {
    id: 'sponge',
    name: text('extractPresets.spongeName'),
    source: { shape: 'sponge' },
    unit: '',
    levels: 3,
    params: { iso: 102, isoForce: -1, rigidity: 0.05, stiffness: 0.001 },
    credit: text('extractPresets.spongeCredit'),
  },
];
