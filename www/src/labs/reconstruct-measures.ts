import type { Fit } from '../reconstruct/protocol';
import { count, figure } from '../ui/format';
import type { History } from '../ui/history';
import type { MoreMeasure } from '../ui/measures';
import type { PlotKind } from '../ui/plots';

/** Measures of the points and the fit, shown besides those of the surface. */
export const FIT_ROWS: MoreMeasure[] = [
  {
    name: 'fitMean',
    label: 'Distance of points, mean',
    help: 'From all points, with those changed by hand, to the surface',
    text: figure,
  },
  { name: 'fitRms', label: 'Distance, rms', help: 'Root of the mean squared distance', text: figure },
  { name: 'fitMax', label: 'Distance, largest', help: 'Strays that were left out count, too', text: figure },
  {
    name: 'meanCurvature',
    label: 'Mean curvature',
    help: 'Mean of |H| over the vertices, one over a length',
    text: figure,
  },
  { name: 'surfaceConstraints', label: 'Constraints, surface', help: 'Points that take part: f is 0', text: count },
  { name: 'exteriorConstraints', label: 'Constraints, exterior', help: 'Points outside: f is −1', text: count },
  {
    name: 'spacing',
    label: 'Mean spacing',
    help: 'To the nearest other point that takes part; the box is 2 long',
    text: figure,
  },
  { name: 'cell', label: 'Cell', help: 'Edge of the cells that the surface is drawn with', text: figure },
  { name: 'duplicates', label: 'Duplicates', help: 'Points equal to others, left out', text: count },
  { name: 'strays', label: 'Stray pieces', help: 'Pieces of the surface that no point is near', text: count },
  { name: 'residual', label: 'Residual', help: 'Of the solve, relative to its right side', text: figure },
];

/** Returns the values of these measures by name. */
export function fitValues(fit: Fit): Record<string, unknown> {
  const { fitness, ...rest } = fit;
  if (!fitness) return { ...rest };
  const { mean, rms, max, meanCurvature } = fitness;
  return { ...rest, fitMean: mean, fitRms: rms, fitMax: max, meanCurvature };
}

/** Plot of the solver's residual over the iterations. */
export const RESIDUAL_PLOT: PlotKind = {
  title: 'Residual of the solve',
  log: true,
  curves: [
    { label: 'residual', color: '--curve', of: ({ residual }) => residual },
    { label: 'tolerance', color: '--muted', dash: [4, 4], of: ({ tolerance }) => tolerance },
  ],
  tell: tellResidual,
};

function tellResidual({ reports }: History): string {
  const last = reports.at(-1);
  const solving = reports.filter(({ phase, residual }) => phase === 'solve' && Number.isFinite(residual));
  if (!last || solving.length === 0) return 'The solve has not begun.';
  const relation = last.residual <= last.tolerance ? 'below' : 'above';
  return `After ${count(solving.length)} steps of the solve the residual is ${figure(last.residual)}, ${relation} the tolerance of ${figure(last.tolerance)}.`;
}
