import { h, uniqueId } from '../../../kit/dom';
import { bytes } from '../../../kit/format';
import { text } from '../../../texts';
import type { LargeSource } from '../protocol';

/** Names of this computer that the policy of the worker permits; a policy cannot name an IPv6 address. */
const LOOPBACK = ['localhost', '127.0.0.1'];

/**
 * Returns why an image cannot be read from an address, or undefined if it can. The policy of the Extract lab's worker
 * (`scripts/policy`) permits the same servers.
 */
export function addressProblem(
  address: string,
  page: Pick<Location, 'href' | 'origin'> = location,
): string | undefined {
  const url = parsed(address, page.href);
  if (!url) return text('extractPanels.largeNoAddress');
  const { protocol, username, password, host, hostname } = url;
  if (!/^https?:$/.test(protocol)) return text('extractPanels.largeScheme', { scheme: protocol });
  if (username || password) return text('extractPanels.largeCredentials');
  const isSafe = protocol === 'https:' || url.origin === page.origin || LOOPBACK.includes(hostname);
  return isSafe ? undefined : text('extractPanels.largeUnencrypted', { host });
}

function parsed(address: string, base: string): URL | undefined {
  try {
    return new URL(address, base);
  } catch {
    return undefined;
  }
}

type Picker = { showDirectoryPicker?: () => Promise<FileSystemDirectoryHandle> };

/** Controls of the Extract lab that open an OME-Zarr image by address or folder, and show how much of it is read. */
export class LargeSourceControls {
  readonly element: HTMLElement;
  readonly #address = h('input', { type: 'url', placeholder: 'https://…/image.ome.zarr', required: true });
  readonly #error = h('p', { class: 'field-error', role: 'alert' });
  readonly #bar = h('progress', { max: 1, value: 0, 'aria-label': text('extractPanels.largeRead') });
  readonly #amount = h('span', { class: 'amount' });
  readonly #progress = h('div', { class: 'large-progress', hidden: true }, this.#bar, this.#amount);
  readonly #onOpen: (name: string, source: LargeSource) => void;
  #total = 0;

  constructor(onOpen: (name: string, source: LargeSource) => void) {
    this.#onOpen = onOpen;
    const id = uniqueId('address');
    this.#address.id = id;
    this.#error.id = `${id}-error`;
    this.#address.setAttribute('aria-describedby', `${id}-help ${id}-error`);
    const form = h(
      'form',
      { class: 'large-address' },
      h('label', { for: id }, text('extractPanels.largeAddress')),
      this.#address,
      this.#error,
      h('button', { class: 'wide' }, text('extractPanels.largeOpen')),
    );
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.#openAddress();
    });
    this.element = h(
      'details',
      { class: 'large' },
      h('summary', {}, text('extractPanels.largeTitle')),
      form,
      ...this.#folderButton(),
      h('p', { class: 'help', id: `${id}-help` }, text('extractPanels.largeHelp')),
      this.#progress,
    );
  }

  /** Shows how much of an image is read; hides it if the open volume is none, with `total` undefined. */
  showTotal(total: number | undefined): void {
    this.#total = total ?? 0;
    this.#progress.hidden = total === undefined;
    this.#amount.textContent = '';
    this.#bar.value = 0;
  }

  /** Shows the bytes and chunks that have been read, and the number of parts that the model waits for. */
  showProgress(data: { bytes: number; chunks: number; waiting: number }): void {
    this.#bar.value = this.#total > 0 ? data.bytes / this.#total : 0;
    const values = { bytes: bytes(data.bytes), total: bytes(this.#total), chunks: data.chunks, waiting: data.waiting };
    this.#amount.textContent = text(
      data.waiting > 0 ? 'extractPanels.largeWaiting' : 'extractPanels.largeAmount',
      values,
    );
  }

  #openAddress(): void {
    const problem = addressProblem(this.#address.value);
    this.#error.textContent = problem ?? '';
    this.#address.ariaInvalid = problem ? 'true' : null;
    if (problem) return;
    const { href, host, pathname } = new URL(this.#address.value, location.href);
    this.#onOpen(pathname.split('/').filter(Boolean).at(-1) ?? host, { zarr: href });
  }

  /** Returns the button that picks a folder, in browsers that can. */
  #folderButton(): HTMLElement[] {
    const { showDirectoryPicker } = window as Picker;
    if (!showDirectoryPicker) return [];
    const pick = () =>
      showDirectoryPicker.call(window).then(
        (folder) => this.#onOpen(folder.name, { zarr: folder }),
        (error: DOMException) => {
          // Otherwise the user has chosen none.
          if (error.name !== 'AbortError') this.#error.textContent = error.message;
        },
      );
    return [h('button', { type: 'button', class: 'wide', onclick: pick }, text('extractPanels.largeFolder'))];
  }
}
