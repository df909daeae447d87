import type { NamedBytes } from '../protocol';

/**
 * Groups files by volume, in the order of their names: each header, or file that needs none, together with the data
 * files of the same name. A single header takes all data files.
 */
export function groupFiles(files: NamedBytes[]): NamedBytes[][] {
  const byName = [...files].sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true }));
  const isData = ({ name }: NamedBytes) => /\.(z?raw|img)(\.gz)?$/i.test(name);
  const stem = ({ name }: NamedBytes) => name.replace(/\..*$/, '');
  const heads = byName.filter((file) => !isData(file));
  // A single header takes all data files; of several, each takes those of its name.
  const belongs = (head: NamedBytes) => (file: NamedBytes) =>
    isData(file) && (heads.length === 1 || stem(file) === stem(head));
  return heads.map((head) => [head, ...byName.filter(belongs(head))]);
}
