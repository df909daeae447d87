import { signal } from '@preact/signals';
import { text } from '../texts';
import { Button } from './ui/parts';

/**
 * Least milliseconds between the last message of the status line and a progress report: rarely enough for screen
 * readers, and for the rest of the page.
 */
const REPORT_EVERY = 10_000;

/** What the status line of a lab says: it is set when the state of the lab changes, and occasionally during a run. */
export class Status {
  readonly words = signal('');
  #saidAt = 0;

  say(words: string): void {
    this.#saidAt = performance.now();
    this.words.value = words;
  }

  /** Reports the progress of a run. May be called at any rate; `words` is evaluated only when a report is due. */
  report(words: () => string): void {
    if (performance.now() - this.#saidAt >= REPORT_EVERY) this.say(words());
  }
}

/** Status line of a lab, announced politely by screen readers. */
export function StatusLine({ status }: { status: Status }) {
  return (
    <p class="status" role="status" aria-live="polite">
      {status.words}
    </p>
  );
}

/** An error message in plain words, if there is one. */
export class Banner {
  readonly message = signal<{ title: string; message: string } | undefined>(undefined);

  get shown(): boolean {
    return this.message.peek() !== undefined;
  }

  show(title: string, message: string): void {
    this.message.value = { title, message };
  }

  hide(): void {
    this.message.value = undefined;
  }
}

/** Banner over the view with an error message. The previous result stays visible below it. */
export function ErrorBanner({ banner, onDismiss }: { banner: Banner; onDismiss: () => void }) {
  const { title = '', message = '' } = banner.message.value ?? {};
  return (
    <div class="banner" role="alert" hidden={!banner.message.value}>
      <p>
        <strong>{title}</strong> <span data-error="">{message}</span>
      </p>
      <Button class="quiet" onClick={onDismiss}>
        {text('controls.dismiss')}
      </Button>
    </div>
  );
}
