// Where a soldier is believed to be, how sure that is, and in words how old: the hub's rules (bootprint.display and
// bootprint.prediction) again, since a browser shows the time between two tellings too. A test holds both alike.

import { moved } from "./geo.ts";
import type { Place, Track, TrackState } from "./types.ts";

const DAMPING_S = 60;
const RADIUS_95 = Math.sqrt(-2 * Math.log(0.05));
const PACE_M_S = 0.6;
const STEADY_S = 200;
const SOONEST_S = 1;
const JUST_NOW_S = 2;
const STATES: TrackState[] = ["fresh", "stale", "lost"];

export interface Ages {
  stale_s: number;
  lost_s: number;
}

export interface Shown {
  place: Place;
  sigma_m: number;
  radius_95_m: number;
  age_s: number;
  state: TrackState;
  words: string;
}

export function shown(track: Track, now_s: number, ages: Ages): Shown {
  const age_s = now_s - track.time_s;
  const reach_s = age_s <= 0 ? age_s : -DAMPING_S * Math.expm1(-age_s / DAMPING_S);
  const place = moved(
    [track.longitude_deg, track.latitude_deg],
    track.east_velocity_m_s * reach_s,
    track.north_velocity_m_s * reach_s,
  );
  const sigma = sigma_m(track, age_s);
  const state = worse(track.state, age_s >= ages.lost_s ? "lost" : age_s >= ages.stale_s ? "stale" : "fresh");
  return { place, sigma_m: sigma, radius_95_m: RADIUS_95 * sigma, age_s, state, words: ageWords(state, age_s) };
}

function sigma_m(track: Track, age_s: number): number {
  const elapsed = Math.max(0, age_s);
  const free_m = (PACE_M_S * elapsed) / Math.sqrt(1 + elapsed / STEADY_S);
  const { held_m, held_s } = track;
  if (held_m === null || held_s === null || free_m <= held_m) return Math.hypot(track.accuracy_m, free_m);
  const faded = Math.min(1, Math.max(0, age_s - held_s) / Math.max(held_s, SOONEST_S));
  return Math.hypot(track.accuracy_m, held_m + faded * (free_m - held_m));
}

function worse(one: TrackState, other: TrackState): TrackState {
  return STATES.indexOf(one) > STATES.indexOf(other) ? one : other;
}

export function ageWords(state: TrackState, age_s: number): string {
  if (state === "lost") return `lost for ${duration(age_s)}`;
  if (state === "stale") return `silent for ${duration(age_s)}`;
  return age_s < JUST_NOW_S ? "now" : `${duration(age_s)} ago`;
}

export function duration(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  const minutes = Math.floor(whole / 60);
  if (minutes === 0) return `${whole} s`;
  const two = (value: number) => String(value).padStart(2, "0");
  const hours = Math.floor(minutes / 60);
  return hours ? `${hours}:${two(minutes % 60)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

/** The time of day, UTC. */
export function clock(time_s: number): string {
  return `${new Date(1000 * time_s).toISOString().slice(11, 19)}Z`;
}

/** How far a picture can be relied on, for people: by what measures the soldier and the circle that holds them. */
export function reliability(mode: string, radius_95_m: number): "good" | "fair" | "poor" | "none" {
  if (mode === "unplaced" || mode === "lost") return "none";
  const blind = mode === "coasting";
  if (radius_95_m <= 10 && !blind) return "good";
  return radius_95_m <= 40 ? "fair" : "poor";
}

export function speedOf(track: Track): number {
  return Math.hypot(track.east_velocity_m_s, track.north_velocity_m_s);
}

/** Degrees clockwise from true north in which a soldier goes; null while standing. */
export function courseOf(track: Track): number | null {
  if (speedOf(track) < 0.3) return null;
  return (deg(Math.atan2(track.east_velocity_m_s, track.north_velocity_m_s)) + 360) % 360;
}

/** Degrees clockwise from true north in which the body faces; null where that is not known, or while walking. */
export function facingOf(track: Track): number | null {
  return track.facing_rad === null || speedOf(track) >= 0.3 ? null : (deg(track.facing_rad) + 360) % 360;
}

function deg(angle_rad: number): number {
  return (angle_rad * 180) / Math.PI;
}
