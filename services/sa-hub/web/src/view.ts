// Where places lie on the screen: Web Mercator, north up, since the map neither turns nor tilts.

import type { Place } from "./types.ts";

const TILE_PX = 512;
const EQUATOR_M = 2 * Math.PI * 6_378_137;

/** A place on the square world, 0 to 1 eastward and southward. */
export function mercator([longitude, latitude]: Place): [x: number, y: number] {
  const sine = Math.sin((latitude * Math.PI) / 180);
  return [0.5 + longitude / 360, 0.5 - Math.log((1 + sine) / (1 - sine)) / (4 * Math.PI)];
}

/** What is looked at: a centre, a zoom, and the size of the screen in CSS pixels. */
export class View {
  readonly width: number;
  readonly height: number;
  private readonly world: number;
  private readonly centre: [number, number];

  constructor(centre: Place, zoom: number, width: number, height: number) {
    this.width = width;
    this.height = height;
    this.world = TILE_PX * 2 ** zoom;
    this.centre = mercator(centre);
  }

  /** Pixels from the upper left corner; the nearer way round the world. */
  toScreen(place: Place): [x: number, y: number] {
    const [x, y] = mercator(place);
    const east = x - this.centre[0];
    return [this.width / 2 + (east - Math.round(east)) * this.world, this.height / 2 + (y - this.centre[1]) * this.world];
  }

  pixelsPerMetre(latitude_deg: number): number {
    return this.world / (EQUATOR_M * Math.cos((latitude_deg * Math.PI) / 180));
  }

  /** Whether a point is on the screen, or so near that something around it may be. */
  isNear([x, y]: [number, number], margin_px: number): boolean {
    return x > -margin_px && y > -margin_px && x < this.width + margin_px && y < this.height + margin_px;
  }
}
