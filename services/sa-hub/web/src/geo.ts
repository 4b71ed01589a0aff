// Places on the ground (WGS84): moving by metres, distance and azimuth, UTM, and the lines of the MGRS grid.

import type { Place } from "./types.ts";

const A_M = 6_378_137;
const F = 1 / 298.257223563;
const E2 = F * (2 - F);
const N = F / (2 - F);
const K0 = 0.9996;
const RECTIFYING_M = (A_M / (1 + N)) * (1 + N ** 2 / 4 + N ** 4 / 64);
const RAD = Math.PI / 180;

function radii(latitude_deg: number): [normal: number, meridian: number] {
  const w2 = 1 - E2 * Math.sin(latitude_deg * RAD) ** 2;
  return [A_M / Math.sqrt(w2), (A_M * (1 - E2)) / w2 ** 1.5];
}

/** So many metres east and north of a place, good to centimetres up to some kilometres. */
export function moved([longitude, latitude]: Place, east_m: number, north_m: number): Place {
  let to = latitude;
  let [middle, normal] = [latitude, A_M];
  for (let pass = 0; pass < 2; pass++) {
    middle = (latitude + to) / 2; // the radii are those of the middle latitude, which the first pass tells
    const [across, along] = radii(middle);
    normal = across;
    to = latitude + north_m / along / RAD;
  }
  const cosine = Math.max(Math.cos(middle * RAD), 1e-6);
  return [longitude + east_m / (normal * cosine) / RAD, to];
}

/** Metres east and north from one place to another. */
export function offset(from: Place, to: Place): [east_m: number, north_m: number] {
  const middle = (from[1] + to[1]) / 2;
  const [normal, meridian] = radii(middle);
  return [(to[0] - from[0]) * RAD * normal * Math.cos(middle * RAD), (to[1] - from[1]) * RAD * meridian];
}

export function distance_m(from: Place, to: Place): number {
  return Math.hypot(...offset(from, to));
}

/** Degrees clockwise from true north. */
export function azimuth_deg(from: Place, to: Place): number {
  const [east, north] = offset(from, to);
  return (Math.atan2(east, north) / RAD + 360) % 360;
}

/** A closed ring of a circle around a place. */
export function circle(centre: Place, radius_m: number, points = 48): Place[] {
  return Array.from({ length: points + 1 }, (_, index) => {
    const angle = (2 * Math.PI * index) / points;
    return moved(centre, radius_m * Math.sin(angle), radius_m * Math.cos(angle));
  });
}

export function zoneOf(longitude_deg: number): number {
  return Math.min(60, Math.max(1, Math.floor((longitude_deg + 180) / 6) + 1));
}

/** Easting and northing in a UTM zone (northern false northing), by Krüger's series to the third order of n. */
export function toUtm([longitude, latitude]: Place, zone: number): [easting: number, northing: number] {
  const e = Math.sqrt(E2);
  const phi = latitude * RAD;
  const lambda = (longitude - (6 * zone - 183)) * RAD;
  const t = Math.sinh(Math.atanh(Math.sin(phi)) - e * Math.atanh(e * Math.sin(phi)));
  const xi = Math.atan2(t, Math.cos(lambda));
  const eta = Math.atanh(Math.sin(lambda) / Math.hypot(1, t));
  const alpha = [N / 2 - (2 * N ** 2) / 3 + (5 * N ** 3) / 16, (13 * N ** 2) / 48 - (3 * N ** 3) / 5, (61 * N ** 3) / 240];
  let east = eta;
  let north = xi;
  alpha.forEach((factor, index) => {
    const j = 2 * (index + 1);
    east += factor * Math.cos(j * xi) * Math.sinh(j * eta);
    north += factor * Math.sin(j * xi) * Math.cosh(j * eta);
  });
  return [500_000 + K0 * RECTIFYING_M * east, K0 * RECTIFYING_M * north];
}

/** The inverse of `toUtm`. */
export function fromUtm([easting, northing]: [number, number], zone: number): Place {
  const xi = northing / (K0 * RECTIFYING_M);
  const eta = (easting - 500_000) / (K0 * RECTIFYING_M);
  const beta = [N / 2 - (2 * N ** 2) / 3 + (37 * N ** 3) / 96, N ** 2 / 48 + N ** 3 / 15, (17 * N ** 3) / 480];
  let xi1 = xi;
  let eta1 = eta;
  beta.forEach((factor, index) => {
    const j = 2 * (index + 1);
    xi1 -= factor * Math.sin(j * xi) * Math.cosh(j * eta);
    eta1 -= factor * Math.cos(j * xi) * Math.sinh(j * eta);
  });
  const chi = Math.asin(Math.sin(xi1) / Math.cosh(eta1));
  const delta = [2 * N - (2 * N ** 2) / 3 - 2 * N ** 3, (7 * N ** 2) / 3 - (8 * N ** 3) / 5, (56 * N ** 3) / 15];
  const phi = delta.reduce((sum, factor, index) => sum + factor * Math.sin(2 * (index + 1) * chi), chi);
  return [6 * zone - 183 + Math.atan2(Math.sinh(eta1), Math.cos(xi1)) / RAD, phi / RAD];
}

export interface GridLine {
  points: Place[];
  label: string;
  major: boolean;
  vertical: boolean;
}

/** Metres between the grid's lines in a view: no more than two dozen across; 0 if that would be too coarse. */
export function gridSpacing(west: number, south: number, east: number, north: number): number {
  const [left, right] = extent(west, south, east, north);
  return [10, 100, 1000, 10_000, 100_000].find((each) => (right - left) / each <= 24) ?? 0;
}

/** The lines of the MGRS grid within bounds; every tenth is a major one. */
export function gridLines(west: number, south: number, east: number, north: number, spacing: number): GridLine[] {
  const zone = zoneOf((west + east) / 2);
  const [left, right, low, high] = extent(west, south, east, north);
  return [...family(left, right, spacing, (at) => along(low, high, (y) => fromUtm([at, y], zone)), true),
    ...family(low, high, spacing, (at) => along(left, right, (x) => fromUtm([x, at], zone)), false)];
}

/** Least and greatest easting and northing within bounds. */
function extent(west: number, south: number, east: number, north: number): [left: number, right: number, low: number, high: number] {
  const zone = zoneOf((west + east) / 2);
  const corners = [[west, south], [east, south], [west, north], [east, north]].map((each) => toUtm(each as Place, zone));
  const eastings = corners.map((each) => each[0]);
  const northings = corners.map((each) => each[1]);
  return [Math.min(...eastings), Math.max(...eastings), Math.min(...northings), Math.max(...northings)];
}

function family(from: number, to: number, spacing: number, points: (at: number) => Place[], vertical: boolean): GridLine[] {
  const lines: GridLine[] = [];
  for (let index = Math.ceil(from / spacing); index * spacing <= to; index++) {
    const at = index * spacing;
    const digits = spacing >= 1000 ? 2 : spacing === 100 ? 3 : 4;
    const label = String(Math.round((at % 100_000) / 10 ** (5 - digits))).padStart(digits, "0");
    lines.push({ points: points(at), label, major: index % 10 === 0, vertical });
  }
  return lines;
}

function along(from: number, to: number, at: (value: number) => Place): Place[] {
  return Array.from({ length: 5 }, (_, index) => at(from + ((to - from) * index) / 4));
}
