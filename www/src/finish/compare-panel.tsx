import { useLayoutEffect, useRef } from 'preact/hooks';
import type { Unit } from '../engine/protocol';
import { FileChooser, VOLUME_FILES } from '../importers/chooser';
import { acceptDropsOn } from '../importers/files';
import { figure } from '../kit/format';
import { useId } from '../kit/ui/id';
import { Button, Help, Refusal } from '../kit/ui/parts';
import { text } from '../texts';
import { type Comparing, DIRECTIONS, MEASURES } from './comparing';
import type { Comparison } from './protocol';

/** Compares the surface with a reference, a mesh or a label map, from files. */
export function ComparePanel({ comparing }: { comparing: Comparing }) {
  const panel = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => {
    if (!panel.current) return;
    acceptDropsOn(panel.current, (data) => {
      const files = [...(data?.files ?? [])];
      if (files.length > 0 && comparing.isEnabled.peek()) void comparing.open(files);
    });
  }, [comparing]);
  const isDisabled = !comparing.isEnabled.value;
  return (
    <div class="reference" ref={panel}>
      <Help>{text('finish.referenceHelp')}</Help>
      <div class="row">
        <FileChooser
          onFiles={(files) => void comparing.open(files)}
          accept={`.ply,.stl,.obj,.glb,${VOLUME_FILES}`}
          label={text('finish.openReference')}
          isDisabled={isDisabled}
        />
      </div>
      <p class="help" role="status" data-reference="status">
        {comparing.status}
      </p>
      <Refusal>{comparing.error}</Refusal>
      {comparing.found.value && <Result comparing={comparing} found={comparing.found.value} />}
    </div>
  );
}

function Result({ comparing, found }: { comparing: Comparing; found: Comparison }) {
  const { dice } = found;
  return (
    <div>
      <LabelRow comparing={comparing} labels={found.labels} />
      <div data-reference="result" data-values={JSON.stringify({ ...found, values: undefined })}>
        <div class="scroll">
          <DistanceTable found={found} unit={comparing.unit.value} />
        </div>
        <Help>{dice === undefined ? text('finish.noDice') : text('finish.dice', { value: dice.toFixed(4) })}</Help>
      </div>
      <label>
        <input
          type="checkbox"
          checked={comparing.isColored.value}
          disabled={!comparing.isEnabled.value}
          onChange={({ currentTarget }) => {
            comparing.isColored.value = currentTarget.checked;
          }}
        />{' '}
        {text('finish.colors')}
      </label>
      <Button data-reference="csv" onClick={comparing.save}>
        {text('finish.csv')}
      </Button>
    </div>
  );
}

/** The choice of one label of the reference. */
function LabelRow({ comparing, labels }: { comparing: Comparing; labels: readonly number[] }) {
  const id = useId();
  const choose = (chosen: string) => {
    comparing.label.value = chosen === '' ? undefined : Number(chosen);
    void comparing.compare();
  };
  return (
    <div class="row" hidden={labels.length < 2}>
      <label for={id}>{text('finish.label')}</label>
      <select id={id} value={comparing.label.value ?? ''} onChange={({ currentTarget }) => choose(currentTarget.value)}>
        <option value="">{text('finish.allLabels')}</option>
        {labels.map((label) => (
          <option key={label} value={label}>
            {label}
          </option>
        ))}
      </select>
    </div>
  );
}

function DistanceTable({ found, unit }: { found: Comparison; unit: Unit }) {
  return (
    <table class="times distances">
      <thead>
        <tr>
          <th scope="col">{unit}</th>
          {DIRECTIONS.map(([name, label]) => (
            <th key={name} scope="col">
              {label}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {MEASURES.map(([measure, label]) => (
          <tr key={measure}>
            <th scope="row">{label}</th>
            {DIRECTIONS.map(([name]) => (
              <td key={name}>{figure(found[name][measure])}</td>
            ))}
          </tr>
        ))}
      </tbody>
    </table>
  );
}
