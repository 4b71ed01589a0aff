// What lies over the map, made of what is known: soldiers, units of other systems, things seen, and trails.

import { courseOf, duration, facingOf, speedOf } from "./display.ts";
import { moved } from "./geo.ts";
import { PALETTE, TEXTS, type Theme } from "./layers.ts";
import { CROWD, TRAIL_S, type Seen, type State, type TrailPoint } from "./state.ts";
import { foreignSymbol, observationSymbol, soldierSymbol, type Symbol } from "./symbols.ts";
import type { Foreign, Observation, Place } from "./types.ts";

const CROWD_ZOOM = 17.5;
const AHEAD_S = 5; // of the line that shows speed
const MOVING_M_S = 0.3;
const OTHERS_TRAIL_S = 60; // of who is not selected; more would be a tangle
const SHADES = 4;
const CLIMB_S = 20;
const SEEN_COLOUR = "#cc79a7";
const RADIUS_95 = 2.45;

export interface Line {
  text: string;
  colour: string;
  bold?: boolean;
}

export interface Mark {
  id: string;
  place: Place;
  symbol: Symbol;
  opacity: number;
  colour: string;
  label: Line[];
  labelOpacity: number;
  /** Its label is drawn even where it covers something. */
  must: boolean;
  /** The circle that holds it with 95 %, metres. */
  radius_m: number | null;
  /** Degrees clockwise from north, of the arrow at the symbol. */
  course: number | null;
  /** Where it will be in some seconds. */
  ahead: Place | null;
  /** The last reported place, when that is long ago. */
  since: Place | null;
}

export interface Trail {
  /** Lines, the older ones fainter (1 to 0); a trail that leaves the floor that is looked at is broken there. */
  pieces: { places: Place[]; freshness: number }[];
  /** Of who is selected: where another floor was reached by stairs or lift, and which. */
  climbs: { place: Place; text: string }[];
  selected: boolean;
}

/** Everything that has a symbol; who matters most comes first, and is drawn on top. */
export function marksOf(state: State, zoom: number, theme: Theme): Mark[] {
  const seen = state.seen().filter((each) => each.track.mode !== "unplaced");
  const crowded = seen.length > CROWD && zoom < CROWD_ZOOM;
  const soldiers = seen.map((each) => soldierMark(each, state, crowded, theme));
  const others = state.past === null ? [...state.foreign.values()].map((each) => foreignMark(each, state.now_s, theme)) : [];
  const things = newest(state.observationsShown()).map((each) => observationMark(each, theme));
  return [...soldiers.filter((each) => each.must), ...soldiers.filter((each) => !each.must), ...things, ...others];
}

export function trailsOf(state: State): Trail[] {
  if (!state.trailsOn) return [];
  const crowd = state.seen().length > CROWD;
  const wanted = state.seen().map((each) => each.track.soldier).filter((each) => !crowd || each === state.selected);
  return wanted.map((soldier) => trailOf(state.trail(soldier), state.floor, soldier === state.selected));
}

/** Until the last report: of somebody lost the way there is what helps to find them. */
function trailOf(points: TrailPoint[], floor: number | null, selected: boolean): Trail {
  const end_s = points.at(-1)?.time_s ?? 0;
  const lasts_s = selected ? TRAIL_S : OTHERS_TRAIL_S;
  const trail: Trail = { pieces: [], climbs: [], selected };
  let piece: Trail["pieces"][number] | undefined;
  let [from, climbed_s]: [number | null, number] = [null, -Infinity];
  for (const each of points.filter((point) => end_s - point.time_s < lasts_s)) {
    const shown = floor === null || each.floor === null || each.floor === floor;
    const freshness = 1 - Math.floor((SHADES * (end_s - each.time_s)) / lasts_s) / SHADES;
    if (!shown) piece = undefined;
    else if (piece?.freshness === freshness) piece.places.push(each.place);
    else trail.pieces.push((piece = { places: [...(piece ? [piece.places.at(-1)!] : []), each.place], freshness }));
    if (selected && from !== null && each.floor !== null && each.floor !== from && (shown || from === floor)) {
      if (each.time_s - climbed_s < CLIMB_S) trail.climbs.pop(); // to and fro on the stairs
      trail.climbs.push({ place: each.place, text: `${arrow(from, each.floor)} ${each.floor}` });
      climbed_s = each.time_s;
    }
    from = each.floor ?? from;
  }
  return trail;
}

/** That somebody has just come to another floor, and from where; of who was lost doing so it is soon no news. */
export function climbOf(points: TrailPoint[], floor: number | null, now_s: number): string {
  const before = points.findLast((each) => each.floor !== null && each.floor !== floor);
  return before === undefined || floor === null || now_s - before.time_s > CLIMB_S ? "" : arrow(before.floor!, floor);
}

function arrow(from: number, to: number): string {
  return to > from ? "▲" : "▼";
}

function soldierMark({ track, shown, soldier }: Seen, state: State, crowded: boolean, theme: Theme): Mark {
  const selected = state.selected === track.soldier;
  const here = state.floor === null || track.floor === null || track.floor === state.floor;
  const [fresh, plain] = [shown.state === "fresh", !crowded || selected];
  const label: Line[] = [];
  const floor = state.floor === null && track.floor !== null ? `  ⌂${track.floor}` : "";
  if (plain || !fresh) label.push({ text: `${soldier.callsign}${floor}${climbOf(state.trail(track.soldier), track.floor, state.now_s)}`, colour: TEXTS[theme].fresh });
  if (!fresh || selected) label.push({ text: [shown.words, fresh && speedOf(track) >= MOVING_M_S ? `${speedOf(track).toFixed(1)} m/s` : ""].filter(Boolean).join(" · "), colour: TEXTS[theme][shown.state], bold: shown.state === "lost" });
  return {
    id: track.soldier,
    place: shown.place,
    symbol: soldierSymbol(soldier, shown.state, selected),
    opacity: (here ? 1 : 0.22) * fading(shown.state, shown.age_s, state.ages.lost_s),
    colour: PALETTE[shown.state],
    label,
    labelOpacity: here ? 1 : 0.3,
    must: selected || (here && !crowded && shown.state === "lost"),
    radius_m: plain ? shown.radius_95_m : null,
    course: shown.state === "lost" ? null : (courseOf(track) ?? facingOf(track)),
    ahead: plain && here && shown.state !== "lost" && speedOf(track) >= MOVING_M_S ? moved(shown.place, track.east_velocity_m_s * AHEAD_S, track.north_velocity_m_s * AHEAD_S) : null,
    since: !fresh && here ? [track.longitude_deg, track.latitude_deg] : null,
  };
}

function foreignMark(unit: Foreign, now_s: number, theme: Theme): Mark {
  const stale = unit.stale_s < now_s;
  const label = [{ text: unit.callsign ?? unit.uid, colour: TEXTS[theme].fresh }];
  if (stale) label.push({ text: `stale for ${duration(now_s - unit.stale_s)}`, colour: TEXTS[theme].stale });
  const moves = unit.course_rad !== null && (unit.speed_m_s ?? 0) >= MOVING_M_S;
  return {
    ...nothing,
    id: unit.uid,
    place: [unit.longitude_deg, unit.latitude_deg],
    symbol: foreignSymbol(unit.affiliation),
    opacity: stale ? 0.5 : 1,
    colour: PALETTE[stale ? "stale" : "fresh"],
    label,
    course: moves ? (unit.course_rad! * 180) / Math.PI : null,
  };
}

function observationMark(thing: Observation, theme: Theme): Mark {
  return {
    ...nothing,
    id: thing.id,
    place: [thing.longitude_deg, thing.latitude_deg],
    symbol: observationSymbol(thing.code),
    colour: SEEN_COLOUR,
    label: [thing.code?.replaceAll("_", " "), thing.text].filter(Boolean).map((text) => ({ text: text!, colour: TEXTS[theme].fresh })),
    radius_m: RADIUS_95 * thing.accuracy_m,
  };
}

/** Of friends that are told of again and again as they move only the newest word. */
function newest(things: Observation[]): Observation[] {
  const last = new Map<string, Observation>();
  for (const each of things) {
    const name = each.code === "friendly" ? `${each.soldier} ${each.text}` : each.id;
    if ((last.get(name)?.time_s ?? -Infinity) <= each.time_s) last.set(name, each);
  }
  return [...last.values()];
}

const nothing = { opacity: 1, label: [], labelOpacity: 1, must: false, radius_m: null, course: null, ahead: null, since: null };

/** Known long ago is fainter; somebody lost stays readable. */
function fading(state: string, age_s: number, lost_s: number): number {
  return state === "fresh" ? 1 : Math.max(0.7, 1 - (0.3 * age_s) / lost_s);
}
