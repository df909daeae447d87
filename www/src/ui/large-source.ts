import type { LargeSource } from '../protocol';
import { text } from '../texts';
import { h, uniqueId } from './dom';
import { bytes } from './format';

/**
 * Servers that images may be read from, besides the page's own; the page's content-security policy (`index.html`) has the
 * same. A star stands for one part of a name or several.
 */
export const SERVERS = [
  'https://uk1s3.embassy.ebi.ac.uk',
  'https://livingobjects.ebi.ac.uk',
  'https://s3.amazonaws.com',
  'https://*.s3.amazonaws.com',
  'https://storage.googleapis.com',
];

/** Returns whether the page may read from an address. */
export function mayReach({ origin, protocol, host }: URL, own = location.origin): boolean {
  const fits = (server: string) => {
    const [, domain] = server.split('*');
    return domain === undefined ? origin === server : protocol === 'https:' && host.endsWith(domain);
  };
  return origin === own || SERVERS.some(fits);
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
    const servers = SERVERS.map((server) => server.replace('https://', '')).join(', ');
    this.element = h(
      'details',
      { class: 'large' },
      h('summary', {}, text('extractPanels.largeTitle')),
      form,
      ...this.#folderButton(),
      h('p', { class: 'help', id: `${id}-help` }, text('extractPanels.largeHelp', { servers })),
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
    const url = new URL(this.#address.value, location.href);
    const isAllowed = mayReach(url);
    this.#error.textContent = isAllowed ? '' : text('extractPanels.largeRefused', { host: url.host });
    if (isAllowed) this.#address.removeAttribute('aria-invalid');
    else this.#address.setAttribute('aria-invalid', 'true');
    const name = url.pathname.split('/').filter(Boolean).at(-1) ?? url.host;
    if (isAllowed) this.#onOpen(name, { zarr: url.href });
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
