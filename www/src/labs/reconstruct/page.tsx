import type { ComponentChildren } from 'preact';
import { count } from '../../kit/format';
import { type Fact, OpenData } from '../../lab/example-panel';
import { text } from '../../texts';
import { CLOUDS, type CloudExample } from './examples';
import { CLOUD_PRESETS } from './presets';

/** Returns the data that the lab opens: examples and, by `chooser`, files. */
export function cloudData(
  chooser: ComponentChildren,
  onExample: (example: CloudExample) => void,
): OpenData<CloudExample> {
  const contents = {
    groups: [
      { label: text('reconstruct.points'), examples: CLOUDS },
      { label: text('labs.groupFigures'), examples: CLOUD_PRESETS },
    ],
    facts: [
      text('labs.factFile'),
      text('reconstruct.points'),
      text('reconstruct.factColours'),
      text('reconstruct.factCameras'),
    ],
    choosers: chooser,
    help: text('reconstruct.dropHelp'),
  };
  return new OpenData<CloudExample>(contents, onExample);
}

/** Returns the facts about open points. */
export function factsOf(cloud: {
  name: string;
  points: number;
  colors: boolean;
  normals: boolean;
  cameras: number;
}): Fact[] {
  const facts: Fact[] = [
    [text('labs.factFile'), cloud.name],
    [text('reconstruct.points'), count(cloud.points)],
    [text('reconstruct.factColours'), cloud.colors ? text('labs.yes') : text('labs.no')],
    [text('reconstruct.factCameras'), cloud.cameras > 0 ? count(cloud.cameras) : text('labs.none')],
  ];
  if (cloud.normals) facts.push([text('reconstruct.factNormals'), text('labs.yes')]);
  return facts;
}
