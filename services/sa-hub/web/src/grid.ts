// The neutral grid of MGRS: lines for somewhat more than the view, so that moving the map about does not make them
// anew, and their figures at the view's edges.

import { gridLines, gridSpacing, type GridLine } from "./geo.ts";
import type { Place } from "./types.ts";

const MARGIN = 1; // of the view's own breadth, on each side
const POLAR_DEG = 83;
const WIDEST_DEG = 40;

export interface Bounds {
  west: number;
  south: number;
  east: number;
  north: number;
}

export class Grid {
  lines: GridLine[] = [];
  private drawn: Bounds | null = null;
  private spacing = 0;

  /** See to it that there are lines for a view. */
  cover(view: Bounds): void {
    const spacing = isDrawn(view) ? gridSpacing(view.west, view.south, view.east, view.north) : 0;
    if (spacing === this.spacing && (spacing === 0 || (this.drawn !== null && within(view, this.drawn)))) return;
    const [wide, high] = [MARGIN * (view.east - view.west), MARGIN * (view.north - view.south)];
    this.drawn = { west: view.west - wide, south: view.south - high, east: view.east + wide, north: view.north + high };
    this.spacing = spacing;
    this.lines = spacing === 0 ? [] : gridLines(this.drawn.west, this.drawn.south, this.drawn.east, this.drawn.north, spacing);
  }

  /** Each line's figure and where it meets a parallel near the view's lower edge, or a meridian near its right one. */
  figures(low: number, right: number): { text: string; place: Place }[] {
    return this.lines.flatMap((each) => {
      const place = each.vertical ? edge(each.points, 1, low) : edge(each.points, 0, right);
      return place === null ? [] : [{ text: each.label, place }];
    });
  }
}

function isDrawn({ west, south, east, north }: Bounds): boolean {
  return Math.abs(north) <= POLAR_DEG && Math.abs(south) <= POLAR_DEG && east - west <= WIDEST_DEG;
}

function within(inner: Bounds, outer: Bounds): boolean {
  return inner.west >= outer.west && inner.east <= outer.east && inner.south >= outer.south && inner.north <= outer.north;
}

/** Where a line meets a parallel (axis 1) or a meridian (axis 0). */
function edge(points: Place[], axis: 0 | 1, value: number): Place | null {
  for (let index = 1; index < points.length; index++) {
    const [from, to] = [points[index - 1]!, points[index]!];
    const share = (value - from[axis]) / (to[axis] - from[axis]);
    if (share >= 0 && share <= 1) return [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
  }
  return null;
}
