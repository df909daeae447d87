import { signal, useSignal } from '@preact/signals';
import { useRef } from 'preact/hooks';
import { bytes } from '../../../kit/format';
import { useId } from '../../../kit/ui/id';
import { Button } from '../../../kit/ui/parts';
import { text } from '../../../texts';
import { addressProblem } from '../large-address';
import type { LargeSource } from '../protocol';

type Picker = { showDirectoryPicker?: () => Promise<FileSystemDirectoryHandle> };

interface Reading {
  bytes: number;
  chunks: number;
  /** Number of parts that the model waits for. */
  waiting: number;
}

/** How much of an image larger than memory has been read. */
export class LargeReading {
  /** Bytes of the image; undefined if the open volume is no such image. */
  readonly total = signal<number | undefined>(undefined);
  readonly read = signal<Reading | undefined>(undefined);

  /** Shows how much of an image is read; hides it if the open volume is none, with `total` undefined. */
  showTotal(total: number | undefined): void {
    this.total.value = total;
    this.read.value = undefined;
  }

  showProgress(read: Reading): void {
    this.read.value = read;
  }
}

interface LargeProps {
  reading: LargeReading;
  onOpen: (name: string, source: LargeSource) => void;
}

/** Controls of the Extract lab that open an OME-Zarr image by address or folder, and show how much of it is read. */
export function LargeSourceControls({ reading, onOpen }: LargeProps) {
  const id = useId();
  const address = useRef<HTMLInputElement>(null);
  const error = useSignal('');
  const isWrong = useSignal(false);
  const openAddress = (event: Event) => {
    event.preventDefault();
    const given = address.current?.value ?? '';
    const problem = addressProblem(given);
    error.value = problem ?? '';
    isWrong.value = problem !== undefined;
    if (problem) return;
    const { href, host, pathname } = new URL(given, location.href);
    onOpen(pathname.split('/').filter(Boolean).at(-1) ?? host, { zarr: href });
  };
  return (
    <details class="large">
      <summary>{text('extractPanels.largeTitle')}</summary>
      <form class="large-address" onSubmit={openAddress}>
        <label for={id}>{text('extractPanels.largeAddress')}</label>
        <input
          {...{ id, ref: address, type: 'url', placeholder: 'https://…/image.ome.zarr', required: true }}
          {...{ 'aria-describedby': `${id}-help ${id}-error`, 'aria-invalid': isWrong.value ? 'true' : undefined }}
        />
        <p class="field-error" role="alert" id={`${id}-error`}>
          {error}
        </p>
        <button type="submit" class="wide">
          {text('extractPanels.largeOpen')}
        </button>
      </form>
      <FolderButton
        onOpen={onOpen}
        onError={(message) => {
          error.value = message;
        }}
      />
      <p class="help" id={`${id}-help`}>
        {text('extractPanels.largeHelp')}
      </p>
      <Progress reading={reading} />
    </details>
  );
}

/** The button that picks a folder, in browsers that can. */
function FolderButton({ onOpen, onError }: Pick<LargeProps, 'onOpen'> & { onError: (message: string) => void }) {
  const { showDirectoryPicker } = window as Picker;
  if (!showDirectoryPicker) return null;
  const pick = () =>
    showDirectoryPicker.call(window).then(
      (folder) => onOpen(folder.name, { zarr: folder }),
      (error: DOMException) => {
        // Otherwise the user has chosen none.
        if (error.name !== 'AbortError') onError(error.message);
      },
    );
  return (
    <Button class="wide" onClick={pick}>
      {text('extractPanels.largeFolder')}
    </Button>
  );
}

function Progress({ reading }: { reading: LargeReading }) {
  const total = reading.total.value ?? 0;
  const read = reading.read.value;
  return (
    <div class="large-progress" hidden={reading.total.value === undefined}>
      <progress
        max={1}
        value={read && total > 0 ? read.bytes / total : 0}
        aria-label={text('extractPanels.largeRead')}
      />
      <span class="amount">{read && amountOf(read, total)}</span>
    </div>
  );
}

function amountOf({ bytes: read, chunks, waiting }: Reading, total: number): string {
  const key = waiting > 0 ? 'extractPanels.largeWaiting' : 'extractPanels.largeAmount';
  return text(key, { bytes: bytes(read), total: bytes(total), chunks, waiting });
}
