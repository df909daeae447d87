import type { ComponentChildren } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { text } from '../texts';
import { CurvePlot, type PlotParts } from './curve-plot';
import { download } from './download';
import { Button } from './ui/parts';

interface LinePlotProps extends PlotParts {
  /** Further class of the plot, for its height. */
  name?: string;
  hidden?: boolean;
  /** Elements below the plot. */
  children: ComponentChildren;
}

/** A figure with a plot of curves, which can be saved as SVG. */
export function LinePlot({ name = '', hidden = false, children, ...parts }: LinePlotProps) {
  const holder = useRef<HTMLDivElement>(null);
  const plot = useRef<CurvePlot>(null);
  const [title, columns, marks] = [parts.title, parts.columns, parts.marks];
  // Other parts of a plot stay.
  useLayoutEffect(() => {
    if (!holder.current) return;
    plot.current = new CurvePlot(holder.current, parts);
    return () => plot.current?.dispose();
  }, []);
  useLayoutEffect(() => plot.current?.show(parts), [title, columns, marks]);
  return (
    <figure hidden={hidden}>
      <div class="row plot-head">
        <h3>{title}</h3>
        <Button
          class="quiet"
          aria-label={text('pictures.svgOf', { plot: title })}
          onClick={() => plot.current && save(title, plot.current.toSvg())}
        >
          {text('pictures.svg')}
        </Button>
      </div>
      <div class={`plot ${name}`.trim()} aria-hidden="true" ref={holder} />
      {children}
    </figure>
  );
}

function save(title: string, svg: string): void {
  const name = title
    .toLowerCase()
    .replaceAll(/[^\p{L}\p{N}]+/gu, '-')
    .replaceAll(/^-|-$/g, '');
  download(`${name}.svg`, new TextEncoder().encode(svg), 'image/svg+xml');
}

/** The legend of a plot; the name of each key is the class of its mark. */
export function PlotLegend({ keys }: { keys: readonly { name: string; label: string }[] }) {
  return (
    <p class="legend">
      {keys.map(({ name, label }) => (
        <span key={name}>
          <span class={`mark ${name}`} aria-hidden="true" />
          {label}
        </span>
      ))}
    </p>
  );
}
