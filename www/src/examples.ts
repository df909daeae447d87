/** The volumes that come with the page, with a sensible iso value and whom to thank. */
export interface Example {
  id: string;
  name: string;
  file: string;
  iso: number;
  credit: string;
}

export const EXAMPLES: Example[] = [
  {
    id: 'visible-human-head',
    name: 'Head, CT (bone)',
    file: 'visible-human-head.nii.gz',
    iso: 95,
    credit:
      'Head CT: Visible Human Project, U.S. National Library of Medicine, public domain; volume from ipyvolume (MIT).',
  },
];

/** Where an example's file lies, relative to the page. */
export function exampleUrl(example: Example): string {
  return new URL(`data/${example.file}`, document.baseURI).href;
}
