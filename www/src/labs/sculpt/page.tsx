import type { ComponentChildren } from 'preact';
import { count, milliseconds } from '../../kit/format';
import { type Fact, OpenData } from '../../lab/example-panel';
import { plural, text } from '../../texts';
import { SCENES, type SculptExample } from './examples';
import { SCULPT_PRESETS } from './presets';

/** Returns the data that the lab opens: examples and, by `chooser`, files. */
export function sceneData(
  chooser: ComponentChildren,
  onExample: (example: SculptExample) => void,
): OpenData<SculptExample> {
  const contents = {
    groups: [
      { label: text('sculpt.groupScenes'), examples: SCENES },
      { label: text('labs.groupFigures'), examples: SCULPT_PRESETS },
    ],
    facts: [text('labs.factFile'), text('sculpt.factDetail'), text('sculpt.factBands'), text('sculpt.factDuration')],
    choosers: chooser,
    help: text('sculpt.dropHelp'),
  };
  return new OpenData<SculptExample>(contents, onExample);
}

/** Returns the facts about an open scene: meshes and ellipsoids. */
export function factsOf(scene: { name: string; detail: number | undefined; bands: number; buildMs: number }): Fact[] {
  const { name, detail, bands, buildMs } = scene;
  return [
    [text('labs.factFile'), name],
    [text('sculpt.factDetail'), detail === undefined ? text('labs.none') : plural('counts.triangle', detail)],
    [text('sculpt.factBands'), count(bands)],
    [text('sculpt.factDuration'), milliseconds(buildMs)],
  ];
}
