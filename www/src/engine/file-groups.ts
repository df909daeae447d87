import type { NamedBytes } from './protocol';

/** Files of volumes; those of the second kind are headers, whose voxels are in other files. */
const VOLUMES = /\.(nii(\.gz)?|nrrd|nhdr|mha|mhd|hdr)$/i;
const HEADERS = /\.(nhdr|mhd|hdr)$/i;

export const isVolumeFile = ({ name }: Pick<NamedBytes, 'name'>) => VOLUMES.test(name);

export const isHeader = ({ name }: Pick<NamedBytes, 'name'>) => HEADERS.test(name);

/**
 * Groups files by volume, in the order of their names: each header together with the data files of the same name, or a
 * single one with all files that are no volumes; each other volume alone. If no file is known to be a volume, each is a
 * group.
 */
export function groupFiles<File extends Pick<NamedBytes, 'name'>>(files: readonly File[]): File[][] {
  const byName = [...files].sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
  const volumes = byName.filter(isVolumeFile);
  const rest = byName.filter((file) => !volumes.includes(file));
  if (volumes.length === 0) return rest.map((file) => [file]);
  const stem = ({ name }: File) => name.replace(/\..*$/, '');
  const dataOf = (head: File) => {
    if (!isHeader(head)) return [];
    return volumes.length === 1 ? rest : rest.filter((file) => stem(file) === stem(head));
  };
  return volumes.map((head) => [head, ...dataOf(head)]);
}
