/** The initial surface of the Extract lab, as the user chooses it. */
import { text } from '../../texts';
import type { StartShape } from './protocol';

type Kind = StartShape['kind'];

export const SHAPES: { value: Kind; label: string; help: string }[] = [
  {
    value: 'contour',
    label: text('extractPanels.startContour'),
    help: text('extractPanels.startContourHelp'),
  },
  {
    value: 'enclosing',
    label: text('extractPanels.startEnclosing'),
    help: text('extractPanels.startEnclosingHelp'),
  },
  { value: 'bubbles', label: text('extractPanels.startBubbles'), help: text('extractPanels.startBubblesHelp') },
  { value: 'sphere', label: text('extractPanels.startSphere'), help: text('extractPanels.startSphereHelp') },
  {
    value: 'isosurface',
    label: text('extractPanels.startIsosurface'),
    help: text('extractPanels.startIsosurfaceHelp'),
  },
];

export interface StartChoice {
  kind: Kind;
  bubbles: number;
  levels: number;
  /** Mean edge length of the surface in world units; undefined lets the model choose. */
  edge: number | undefined;
  /**
   * Side, in world units, of the box around the crosshair in which a volume larger than memory is followed to its finer
   * levels; undefined for the whole volume.
   */
  box?: number | undefined;
}

/** The choice for a volume for which no other was made. */
export const USUAL_START: StartChoice = { kind: 'contour', bubbles: 5, levels: 1, edge: undefined };
