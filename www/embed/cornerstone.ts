import * as core from '@cornerstonejs/core';
import * as tools from '@cornerstonejs/tools';
import init, { LabelSurfaces, Volume } from 'vesicle';
import { cornerstoneAddOn } from 'vesicle/cornerstone';
import { heartLabels, LABELS } from './heart-labels';
import { loadScan, type Scan } from './nifti';
import { status } from './page';

const { ViewportType, OrientationAxis } = core.Enums;
const { SegmentationRepresentations, MouseBindings } = tools.Enums;
const [SLICE, SPACE, GROUP, HEART, LABEL_MAP] = ['slice', 'space', 'group', 'heart', 'labels'];

await status(async (say) => {
  await init();
  await core.init();
  const addOn = cornerstoneAddOn({ core, tools, LabelSurfaces, Volume });
  await tools.init({ addons: { polySeg: addOn } } as unknown as Parameters<typeof tools.init>[0]);

  const scan = await loadScan('../data/heart.nii.gz');
  const volume = local(HEART, scan, Float32Array.from(scan.voxels));
  local(LABEL_MAP, scan, heartLabels(scan));
  const engine = new core.RenderingEngine('engine');
  const view = document.querySelector('#view') as HTMLElement;
  const pane = () => view.appendChild(Object.assign(document.createElement('div'), { className: 'pane' }));
  const background: [number, number, number] = [0.08, 0.09, 0.1];
  engine.setViewports([
    {
      viewportId: SLICE,
      type: ViewportType.ORTHOGRAPHIC,
      element: pane(),
      defaultOptions: { background, orientation: OrientationAxis.ACQUISITION },
    },
    { viewportId: SPACE, type: ViewportType.VOLUME_3D, element: pane(), defaultOptions: { background } },
  ]);
  await core.setVolumesForViewports(engine, [{ volumeId: HEART }], [SLICE]);
  const slice = engine.getViewport(SLICE) as core.Types.IVolumeViewport;
  slice.setProperties({ voiRange: { lower: 0, upper: 200 } });
  brush();
  await addSegmentation();
  // This slice shows all segments.
  await core.utilities.jumpToSlice(slice.element, { imageIndex: 14 });
  engine.render();
  new ResizeObserver(() => engine.resize(true, true)).observe(view);
  Object.assign(window, { core, tools, addOn, engine, volume });

  const show = () => {
    const surfaces = addOn.surfaces(LABEL_MAP);
    const volumes = LABELS.map(
      ({ value, name }) => `${name} ${((surfaces?.mesh(value).info().volume ?? 0) / 1000).toFixed(0)} ml`,
    );
    say(volumes.join(', '));
  };
  core.eventTarget.addEventListener(tools.Enums.Events.SEGMENTATION_MODIFIED, show);
  show();
});

/** Puts voxels on the grid of the scan into Cornerstone's cache. */
function local(id: string, { size, spacing, directions, origin }: Scan, scalarData: Float32Array | Uint8Array) {
  const direction = directions.flat();
  const metadata = {
    ...{ BitsAllocated: 8, BitsStored: 8, HighBit: 7, SamplesPerPixel: 1, PixelRepresentation: 0 },
    ...{ PhotometricInterpretation: 'MONOCHROME2', Modality: 'MR', FrameOfReferenceUID: '1.2.3' },
    ...{ Columns: size[0] ?? 0, Rows: size[1] ?? 0, PixelSpacing: spacing.slice(0, 2) },
    ...{
      ImageOrientationPatient: direction.slice(0, 6),
      voiLut: [{ windowWidth: 200, windowCenter: 100 }],
      VOILUTFunction: 'LINEAR',
    },
  };
  const grid = { dimensions: size, spacing, origin, direction, metadata, scalarData };
  return core.volumeLoader.createLocalVolume(
    id,
    grid as unknown as Parameters<typeof core.volumeLoader.createLocalVolume>[1],
  );
}

/** The label map in the slice, and its surfaces, which the add-on makes, beside it. */
async function addSegmentation(): Promise<void> {
  const { segmentation } = tools;
  const [segmentationId, type] = [LABEL_MAP, SegmentationRepresentations.Labelmap];
  segmentation.addSegmentations([{ segmentationId, representation: { type, data: { volumeId: LABEL_MAP } } }]);
  const lut = [[0, 0, 0, 0], ...LABELS.map(({ color }) => [...color.map((part) => Math.round(255 * part)), 255])];
  const config = { colorLUTOrIndex: lut as never };
  await segmentation.addSegmentationRepresentations(SLICE, [{ segmentationId, type, config }]);
  await segmentation.addSegmentationRepresentations(SPACE, [
    { segmentationId, type: SegmentationRepresentations.Surface, config },
  ]);
}

/** A brush in the slice, whose segment is chosen above; dragging turns the surfaces. */
function brush(): void {
  tools.addTool(tools.BrushTool);
  tools.addTool(tools.TrackballRotateTool);
  tools.addTool(tools.StackScrollTool);
  const slice = tools.ToolGroupManager.createToolGroup(GROUP);
  slice?.addViewport(SLICE, 'engine');
  slice?.addToolInstance('paint', tools.BrushTool.toolName, { activeStrategy: 'FILL_INSIDE_CIRCLE' });
  slice?.addToolInstance('erase', tools.BrushTool.toolName, { activeStrategy: 'ERASE_INSIDE_CIRCLE' });
  slice?.addTool(tools.StackScrollTool.toolName);
  slice?.setToolActive(tools.StackScrollTool.toolName, { bindings: [{ mouseButton: MouseBindings.Wheel }] });
  const space = tools.ToolGroupManager.createToolGroup('space');
  space?.addViewport(SPACE, 'engine');
  space?.addTool(tools.TrackballRotateTool.toolName);
  space?.setToolActive(tools.TrackballRotateTool.toolName, { bindings: [{ mouseButton: MouseBindings.Primary }] });
  const segment = document.querySelector('#segment') as HTMLSelectElement;
  const erase = document.querySelector('#erase') as HTMLInputElement;
  const choose = () => {
    const [active, passive] = erase.checked ? ['erase', 'paint'] : ['paint', 'erase'];
    slice?.setToolPassive(passive ?? '');
    slice?.setToolActive(active ?? '', { bindings: [{ mouseButton: MouseBindings.Primary }] });
    if (tools.segmentation.state.getSegmentation(LABEL_MAP))
      tools.segmentation.segmentIndex.setActiveSegmentIndex(LABEL_MAP, Number(segment.value));
  };
  segment.onchange = choose;
  erase.onchange = choose;
  choose();
  tools.utilities.segmentation.setBrushSizeForToolGroup(GROUP, 8);
}
