// What lies over the map, made of what is known: soldiers, units of other systems, things seen, and trails.

import { courseOf, duration, facingOf, speedOf } from "./display.ts";
import { moved } from "./geo.ts";
import { PALETTE, TEXTS, type Theme } from "./layers.ts";
import type { Seen, State } from "./state.ts";
import { foreignSymbol, observationSymbol, soldierSymbol, type Symbol } from "./symbols.ts";
import type { Foreign, Observation, Place } from "./types.ts";

export const CROWD = 100; // more are drawn without names, circles and trails from afar, or nothing could be read
const CROWD_ZOOM = 17.5;
const AHEAD_S = 5; // of the line that shows speed
const MOVING_M_S = 0.3;
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
  places: Place[];
  selected: boolean;
}

/** Everything that has a symbol; who matters most comes first, and is drawn on top. */
export function marksOf(state: State, zoom: number, theme: Theme): Mark[] {
  const seen = state.seen().filter((each) => each.track.mode !== "unplaced");
  const crowded = seen.length > CROWD && zoom < CROWD_ZOOM;
  const soldiers = seen.map((each) => soldierMark(each, state, crowded, theme));
  const others = state.past === null ? [...state.foreign.values()].map((each) => foreignMark(each, state.now_s, theme)) : [];
  const things = newest([...state.observations.values()]).map((each) => observationMark(each, theme));
  return [...soldiers.filter((each) => each.must), ...soldiers.filter((each) => !each.must), ...things, ...others];
}

export function trailsOf(state: State): Trail[] {
  if (!state.trailsOn || state.past !== null) return [];
  const crowd = state.trails.size > CROWD;
  const wanted = [...state.trails].filter(([soldier]) => !crowd || soldier === state.selected);
  return wanted.map(([soldier, trail]) => ({
    places: trail.filter((each) => state.floor === null || each.floor === null || each.floor === state.floor).map((each) => each.place),
    selected: soldier === state.selected,
  }));
}

function soldierMark({ track, shown, soldier }: Seen, state: State, crowded: boolean, theme: Theme): Mark {
  const selected = state.selected === track.soldier;
  const here = state.floor === null || track.floor === null || track.floor === state.floor;
  const [fresh, plain] = [shown.state === "fresh", !crowded || selected];
  const label: Line[] = [];
  if (plain || !fresh) label.push({ text: soldier.callsign + (state.floor === null && track.floor !== null ? `  ⌂${track.floor}` : ""), colour: TEXTS[theme].fresh });
  if (!fresh || selected) label.push({ text: shown.words, colour: TEXTS[theme][shown.state], bold: shown.state === "lost" });
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
