import { count, figure } from '../../kit/format';
import type { History } from '../../kit/history';
import type { ExtraMeasure } from '../../kit/measures';
import type { PlotKind } from '../../kit/plots';
import { text } from '../../texts';
import type { Fit } from './protocol';

/** Rows on the points and the fit in the Reconstruct lab's table of measures, listed after those on the surface. */
export const FIT_ROWS: ExtraMeasure[] = [
  {
    name: 'fitMean',
    label: text('reconstruct.fitMean'),
    help: text('reconstruct.fitMeanHelp'),
    text: figure,
  },
  { name: 'fitRms', label: text('reconstruct.fitRms'), help: text('reconstruct.fitRmsHelp'), text: figure },
  { name: 'fitMax', label: text('reconstruct.fitMax'), help: text('reconstruct.fitMaxHelp'), text: figure },
  {
    name: 'meanCurvature',
    label: text('reconstruct.meanCurvature'),
    help: text('reconstruct.meanCurvatureHelp'),
    text: figure,
  },
  {
    name: 'surfaceConstraints',
    label: text('reconstruct.surfaceConstraints'),
    help: text('reconstruct.surfaceConstraintsHelp'),
    text: count,
  },
  {
    name: 'exteriorConstraints',
    label: text('reconstruct.exteriorConstraints'),
    help: text('reconstruct.exteriorConstraintsHelp'),
    text: count,
  },
  {
    name: 'interiorConstraints',
    label: text('reconstruct.interiorConstraints'),
    help: text('reconstruct.interiorConstraintsHelp'),
    text: count,
  },
  {
    name: 'spacing',
    label: text('reconstruct.spacing'),
    help: text('reconstruct.spacingHelp'),
    text: figure,
  },
  { name: 'cell', label: text('reconstruct.cell'), help: text('reconstruct.cellHelp'), text: figure },
  { name: 'noise', label: text('reconstruct.noise'), help: text('reconstruct.noiseHelp'), text: figure },
  { name: 'delta', label: text('reconstruct.deltaInForce'), help: text('reconstruct.inForceHelp'), text: figure },
  {
    name: 'lambdaSurface',
    label: text('reconstruct.lambdaSurfaceInForce'),
    help: text('reconstruct.inForceHelp'),
    text: figure,
  },
  {
    name: 'lambdaExterior',
    label: text('reconstruct.lambdaExteriorInForce'),
    help: text('reconstruct.inForceHelp'),
    text: figure,
  },
  { name: 'outliers', label: text('reconstruct.outliers'), help: text('reconstruct.outliersHelp'), text: count },
  { name: 'duplicates', label: text('reconstruct.duplicates'), help: text('reconstruct.duplicatesHelp'), text: count },
  {
    name: 'spuriousComponents',
    label: text('reconstruct.spuriousComponents'),
    help: text('reconstruct.spuriousComponentsHelp'),
    text: count,
  },
  { name: 'residual', label: text('reconstruct.residual'), help: text('reconstruct.residualHelp'), text: figure },
];

/** Returns the values of the measures of points and fit, by the names of the rows in {@link FIT_ROWS}. */
export function fitValues(fit: Fit): Record<string, unknown> {
  const { fitness, choice, inForce, ...facts } = fit;
  const values = { ...facts, ...(choice && { noise: choice.noise }), ...inForce };
  if (!fitness) return values;
  const { mean, rms, max, meanCurvature } = fitness;
  return { ...values, fitMean: mean, fitRms: rms, fitMax: max, meanCurvature };
}

/** Plot of the solver's residual and its tolerance over the iterations, for the Reconstruct lab. */
export const RESIDUAL_PLOT: PlotKind = {
  title: text('reconstruct.residualPlot'),
  log: true,
  curves: [
    { label: text('reconstruct.residualCurve'), color: '--curve', of: ({ residual }) => residual },
    { label: text('labs.toleranceCurve'), color: '--muted', dash: [4, 4], of: ({ tolerance }) => tolerance },
  ],
  describe: describeResidual,
};

function describeResidual({ reports }: History): string {
  const last = reports.at(-1);
  const solving = reports.filter(({ phase, residual }) => phase === 'solve' && Number.isFinite(residual));
  if (!last || solving.length === 0) return text('reconstruct.solveNotStarted');
  const key = last.residual <= last.tolerance ? 'reconstruct.solveBelow' : 'reconstruct.solveAbove';
  return text(key, {
    iterations: count(solving.length),
    residual: figure(last.residual),
    tolerance: figure(last.tolerance),
  });
}
