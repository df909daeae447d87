import { useId } from '../kit/ui/id';
import { elementOf } from '../kit/ui/mount';
import { text } from '../texts';
import type { Admission } from '.';
import { letIn } from './files';

/** Endings of files of volumes. */
export const VOLUME_FILES = '.nii,.gz,.nrrd,.nhdr,.mha,.mhd,.hdr,.img,.raw,.zraw,.dcm,.dicom,.ima,.tif,.tiff';

interface ChooserProps {
  onFiles: (files: File[]) => void;
  /** Endings of the files, by default those of volumes; a session may be chosen, too. */
  accept?: string | undefined;
  label?: string | undefined;
  admission?: Admission;
  isDisabled?: boolean;
}

/** A button that chooses one file, or several that belong together. */
export function FileChooser({
  onFiles,
  accept = VOLUME_FILES,
  label,
  admission = 'volume',
  isDisabled = false,
}: ChooserProps) {
  const id = useId();
  const choose = (input: HTMLInputElement) => {
    const files = [...(input.files ?? [])];
    // Makes choosing the same file again a change.
    input.value = '';
    if (files.length > 0) void letIn(files, admission).then((opened) => opened && onFiles(opened));
  };
  return (
    <span class="chooser">
      <input
        {...{
          type: 'file',
          id,
          multiple: true,
          accept: `${accept},.zip`,
          class: 'visually-hidden',
          disabled: isDisabled,
        }}
        onChange={({ currentTarget }) => choose(currentTarget)}
      />
      <label for={id} class="button">
        {label ?? text('controls.openFile')}
      </label>
    </span>
  );
}

/** Creates the element of a {@link FileChooser}. */
export const fileChooser = (
  onFiles: ChooserProps['onFiles'],
  accept?: string,
  label?: string,
  admission: Admission = 'volume',
): HTMLElement => elementOf(<FileChooser {...{ onFiles, accept, label, admission }} />);
