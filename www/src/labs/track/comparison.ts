import { text } from '../../texts';
import type { TrackClient } from './client';
import { comparedRun, type TrackingRun } from './panels/compare';
import type { Alternative, Enrichment, Setup, SurfaceError } from './protocol';
import type { TrackResults } from './results';
import type { TrackSettings } from './settings';

/** Displayed names, in the comparison of two runs, of the methods that insert slices into the image. */
const NAMES: Record<Enrichment, string> = {
  none: text('track.withoutEnrichment'),
  linear: text('track.linear'),
  flow: text('track.opticalFlow'),
};

/**
 * Tracks the present image again with one setting, `other`, changed; returns the present and the new run for
 * comparison, or undefined if cancelled.
 */
export async function compareWith(
  client: TrackClient,
  { setup, params }: TrackSettings,
  { results, duration }: { results: TrackResults; duration: number | undefined },
  other: Alternative,
): Promise<[TrackingRun, TrackingRun] | undefined> {
  const predicted = params.prediction === true;
  const [here, there] =
    other === 'prediction'
      ? [
          predicted ? text('track.withPrediction') : text('track.withoutPrediction'),
          predicted ? text('track.withoutPrediction') : text('track.withPrediction'),
        ]
      : [NAMES[setup.preparation.enrichment], NAMES[other]];
  const changed = otherwise(setup, other, predicted);
  const facts = results.frames.map((frame) => frame.facts);
  const errors = results.frames.flatMap(({ error }) => error ?? []);
  const present: TrackingRun = { name: here, facts, closing: results.closing, error: meanOf(errors), duration };
  const run = await client.request('compare', { setup: changed });
  return run && [present, comparedRun(there, run)];
}

function otherwise(setup: Setup, other: Alternative, predicted: boolean): Setup {
  if (other === 'prediction') return { ...setup, params: { ...setup.params, prediction: !predicted } };
  return { ...setup, preparation: { ...setup.preparation, enrichment: other } };
}

function meanOf(errors: SurfaceError[]): SurfaceError | undefined {
  if (errors.length === 0) return undefined;
  const mean = (of: keyof SurfaceError) => errors.reduce((sum, error) => sum + error[of], 0) / errors.length;
  return { mean: mean('mean'), p95: mean('p95') };
}
