/**
 * Draws the texture of the Sculpt lab's globe: seas, lands and a grid of longitudes and latitudes. Used by the worker
 * only.
 */

const WIDTH = 1024;
const HEIGHT = 512;
/** Spacing of the longitudes and latitudes drawn on the globe's map, degrees. */
const GRID = 15;

/**
 * Lands of the globe's map, invented so that each region can be recognised: discs by longitude, latitude and radius, in
 * degrees.
 */
const LANDS: [number, number, number][] = [
  ...([
    [-100, 48, 24],
    [-88, 32, 14],
    [-120, 60, 20],
    [-75, 55, 12],
    [-98, 20, 8],
  ] as [number, number, number][]),
  ...([
    [-62, -8, 18],
    [-58, -25, 13],
    [-67, -42, 8],
  ] as [number, number, number][]),
  ...([
    [8, 22, 19],
    [22, 2, 15],
    [24, -18, 12],
    [-4, 12, 10],
  ] as [number, number, number][]),
  ...([
    [10, 52, 13],
    [40, 55, 20],
    [75, 58, 24],
    [110, 55, 22],
    [102, 32, 17],
    [78, 22, 11],
    [140, 62, 15],
  ] as [number, number, number][]),
  ...([
    [134, -25, 15],
    [146, -30, 9],
    [120, -24, 9],
    [-42, 72, 12],
  ] as [number, number, number][]),
];

/** Returns the map, the texture of the globe, as PNG: longitudes −180 to 180 from left to right, north up. */
export async function drawnMap(): Promise<Uint8Array> {
  const canvas = new OffscreenCanvas(WIDTH, HEIGHT);
  const context = canvas.getContext('2d');
  if (context) paint(context);
  const blob = await canvas.convertToBlob({ type: 'image/png' });
  return new Uint8Array(await blob.arrayBuffer());
}

function paint(context: OffscreenCanvasRenderingContext2D): void {
  const sea = context.createLinearGradient(0, 0, 0, HEIGHT);
  for (const [at, color] of [
    [0, '#9cc4dc'],
    [0.5, '#2f79b0'],
    [1, '#9cc4dc'],
  ] as const)
    sea.addColorStop(at, color);
  context.fillStyle = sea;
  context.fillRect(0, 0, WIDTH, HEIGHT);
  for (const land of LANDS) paintLand(context, land);
  context.fillStyle = '#f4f6f5';
  context.fillRect(0, 0, WIDTH, y(78));
  context.fillRect(0, y(-72), WIDTH, HEIGHT);
  paintGrid(context);
}

const x = (longitude: number) => ((longitude + 180) / 360) * WIDTH;
const y = (latitude: number) => ((90 - latitude) / 180) * HEIGHT;

/**
 * Fills a disc of land given by longitude, latitude and radius in degrees; on the map it is wider the nearer it is to a
 * pole.
 */
function paintLand(
  context: OffscreenCanvasRenderingContext2D,
  [longitude, latitude, radius]: [number, number, number],
): void {
  const wide = radius / Math.max(0.3, Math.cos((latitude * Math.PI) / 180));
  context.fillStyle = Math.abs(latitude) > 50 ? '#8fa77a' : Math.abs(latitude) < 26 ? '#c2a869' : '#7fa35c';
  for (const turn of [-360, 0, 360]) {
    context.beginPath();
    context.ellipse(x(longitude + turn), y(latitude), (wide / 360) * WIDTH, (radius / 180) * HEIGHT, 0, 0, 2 * Math.PI);
    context.fill();
  }
}

function paintGrid(context: OffscreenCanvasRenderingContext2D): void {
  context.strokeStyle = '#1c2a33';
  const line = (width: number, from: [number, number], to: [number, number]) => {
    context.lineWidth = width;
    context.beginPath();
    context.moveTo(...from);
    context.lineTo(...to);
    context.stroke();
  };
  // Thicker at the equator and at longitude 0, for orientation.
  for (let longitude = -180; longitude <= 180; longitude += GRID)
    line(longitude === 0 ? 4 : 1.6, [x(longitude), 0], [x(longitude), HEIGHT]);
  for (let latitude = -90 + GRID; latitude < 90; latitude += GRID)
    line(latitude === 0 ? 4 : 1.6, [0, y(latitude)], [WIDTH, y(latitude)]);
}
