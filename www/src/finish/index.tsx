/** Editing and comparison of a surface after a run, the same in all labs. */

import { signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import type { Edit, ExportRequest, Measures, Unit, Vec3 } from '../engine/protocol';
import type { Warning } from '../engine/warnings';
import type { SurfaceMeasures } from '../kit/measures';
import { Folded } from '../kit/ui/parts';
import type { EditedView } from '../scene/edited-view';
import { text } from '../texts';
import { ComparePanel } from './compare-panel';
import { Comparing } from './comparing';
import { EditPanel } from './edit-panel';
import { Editing } from './editing';
import { Finishing, isCancelled } from './finishing';
import type { Edited } from './protocol';
import { MOST_OF_SMALL } from './size';

/** Parts of a lab that the tools use. */
export interface FinishHost {
  /** Returns the lab's surface as a PLY file. */
  mesh: () => Promise<Uint8Array>;
  view: EditedView;
  measures: SurfaceMeasures;
  /** Returns the warnings that concern the surface. */
  warnings: () => readonly Warning[];
  save: (extension: string, bytes: Uint8Array, type: string, suffix: string) => void;
}

/** Edits of the surface of a lab, and its comparison with a reference. */
export class Finish {
  /** Called after each edit or undo, with the measures of the edited surface; undefined if no edits are left. */
  onEdited: (measures: Measures | undefined) => void = () => undefined;
  readonly #host: FinishHost;
  readonly #finishing: Finishing;
  readonly #editing: Editing;
  readonly #comparing: Comparing;
  /** Whether the controls of edits are unfolded. */
  readonly #isUnfolded = signal(false);
  #values: Float32Array | undefined;

  constructor(host: FinishHost) {
    this.#host = host;
    this.#finishing = new Finishing(host.mesh, {
      onChange: (edited) => this.#adopt(edited),
      onLost: () => this.#comparing.forget(),
      onCancelled: () => this.#comparing.reopen(),
    });
    this.#editing = new Editing(this.#finishing, host.view);
    this.#comparing = new Comparing(this.#finishing, {
      onValues: (values) => {
        this.#values = values;
        this.#show();
      },
      onSave: host.save,
      warnings: host.warnings,
    });
  }

  /** The sections of the controls. */
  get sections(): ComponentChildren {
    const onToggle = (isOpen: boolean) => {
      this.#isUnfolded.value = isOpen;
      this.#editing.unfolded = isOpen;
    };
    return (
      <>
        <Folded title={text('finish.title')} isOpen={this.#isUnfolded} onToggle={onToggle}>
          <EditPanel editing={this.#editing} />
        </Folded>
        <Folded title={text('finish.compareTitle')}>
          <ComparePanel comparing={this.#comparing} />
        </Folded>
      </>
    );
  }

  /** Unit of length of the surface, or empty. */
  set unit(unit: Unit) {
    this.#editing.unit.value = unit;
    this.#comparing.unit.value = unit;
    this.#host.view.unit = unit;
  }

  /** Whether the lab has a surface that does not change by itself. */
  set enabled(enabled: boolean) {
    this.#editing.enabled = enabled;
    this.#comparing.isEnabled.value = enabled;
  }

  /** Returns the edited surface as a file; undefined if there are no edits. */
  exported(request: ExportRequest): Promise<Uint8Array> | undefined {
    return this.#finishing.exported(request);
  }

  /** The origin of the edited surface; undefined if there are no edits. */
  get origin(): Vec3 | undefined {
    const { edited } = this.#finishing;
    return edited?.log.length ? edited.surface.origin : undefined;
  }

  /** The edits that have been made, for a session. */
  get log(): Edit[] {
    return this.#finishing.edited?.log ?? [];
  }

  /** The edits that were undone and can be redone, for a session. */
  get undone(): Edit[] {
    return this.#finishing.edited?.undone ?? [];
  }

  /**
   * Makes edits of a session again, also those that were undone there, which can be redone then. Those of a small file may
   * not give a large surface.
   */
  async repeat(edits: Edit[], undone: Edit[], isSmall = false): Promise<void> {
    const all = [...edits, ...undone];
    if (all.length === 0) return;
    // Shown, with *Cancel*: edits may take long.
    this.#isUnfolded.value = true;
    let done = 0;
    const make = async () => {
      for (const edit of all) {
        await this.#finishing.change('edit', { edit, ...(isSmall && { most: MOST_OF_SMALL }) });
        done += 1;
      }
      for (const _ of undone) await this.#finishing.change('undo', undefined);
    };
    const made = make();
    const state = () => text('finish.repeated', { made: done, count: all.length });
    if (await this.#editing.attempt(() => made, { state })) return;
    await made.catch((error) => {
      if (!isCancelled(error)) throw error;
    });
  }

  /** Forgets the edits, as the lab's surface has changed. */
  reset(): void {
    this.#finishing.reset();
  }

  close(): void {
    this.#finishing.close();
  }

  #adopt(edited: Edited | undefined): void {
    this.#editing.take(edited);
    this.#comparing.clear();
    this.#show();
    if (!edited) return;
    const { log, undone, measures } = edited;
    if (log.length + undone.length > 0) this.onEdited(log.length > 0 ? measures : undefined);
    void this.#comparing.compare();
  }

  /** Shows the edited surface, or the lab's own as long as there are neither edits nor colours. */
  #show(): void {
    const { edited } = this.#finishing;
    const values = this.#values;
    const isShown = edited && (values || edited.log.length > 0);
    this.#host.view.show(isShown ? { ...edited.surface, ...(values && { values }) } : undefined);
    this.#host.measures.showEdited(isShown ? edited.measures : undefined);
  }
}
