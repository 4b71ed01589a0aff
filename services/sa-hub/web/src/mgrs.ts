// Places as MGRS says them.

import { forward } from "mgrs";
import type { Place } from "./types.ts";

/** MGRS with spaces, e.g. "33V XF 7427 8231"; digits a coordinate 1 to 5. */
export function mgrs(place: Place, digits = 5): string {
  if (Math.abs(place[1]) > 80) return "outside of MGRS";
  const text = forward(place, digits);
  const head = text.length - 2 * digits;
  return `${text.slice(0, head - 2)} ${text.slice(head - 2, head)} ${text.slice(head, head + digits)} ${text.slice(head + digits)}`;
}
