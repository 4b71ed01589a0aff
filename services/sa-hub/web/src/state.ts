// What the page knows: the live picture, and a past one while somebody looks back; everything is drawn from here.

import { shown, type Ages, type Shown } from "./display.ts";
import type { LineState } from "./link.ts";
import type { Alert, Foreign, Health, Link, Observation, Picture, Place, Post, Soldier, Status, Track, Warning } from "./types.ts";

const TRAIL_POINTS = 400;
const THEN_S = 30; // an alert of the past is shown so long, or somewhat longer where time runs fast
const THEN_PLAYED_S = 8;
export const TRAIL_S = 180;
export const CROWD = 100; // more are drawn without names, circles and trails from afar, or nothing could be read

export interface TrailPoint {
  time_s: number;
  place: Place;
  floor: number | null;
}

export interface Seen {
  soldier: Soldier;
  track: Track;
  shown: Shown;
  status: Status | undefined;
}

export type Tool = "select" | "observe" | "bearing" | "fix" | "measure";

export class State {
  tracks = new Map<string, Track>();
  foreign = new Map<string, Foreign>();
  statuses = new Map<string, Status>();
  alerts = new Map<string, Alert>();
  observations = new Map<string, Observation>();
  links = new Map<string, Link>();
  health = new Map<string, Health>();
  warnings = new Map<string, Warning>();
  trails = new Map<string, TrailPoint[]>();
  roster = new Map<string, Soldier>();
  line: LineState = "connecting";
  selected: string | null = null;
  following = false;
  floor: number | null = null;
  trailsOn = true;
  tool: Tool = "select";
  /** While looking back: the moment, and everybody's newest track then. */
  past: { time_s: number; tracks: Map<string, Track>; playing: boolean; speed: number } | null = null;
  trailsThen = new Map<string, TrailPoint[]>();
  /** What the archive has of these, for looking back. */
  archived: { alerts: Alert[]; observations: Observation[] } = { alerts: [], observations: [] };
  readonly post: Post;
  private inSight: Seen[] = [];
  private heard = { now_s: 0, host_s: 0 };

  constructor(post: Post, roster: Soldier[]) {
    this.post = post;
    for (const each of roster) this.roster.set(each.soldier, each);
    this.setClock(post.now_s);
  }

  get ages(): Ages {
    return this.post;
  }

  get mayOperate(): boolean {
    return this.post.role !== "view";
  }

  /** Event time of what is shown: now, or the moment that is looked back to. */
  get now_s(): number {
    return this.past === null ? this.live_s : this.past.time_s;
  }

  get live_s(): number {
    return this.heard.now_s + this.post.speed * (performance.now() / 1000 - this.heard.host_s);
  }

  take(news: Picture, whole: boolean): void {
    if (whole) for (const map of [this.tracks, this.alerts, this.observations, this.links, this.health]) map.clear();
    this.setClock(news.now_s);
    merge(this.foreign, news.foreign);
    merge(this.statuses, news.statuses);
    merge(this.alerts, news.alerts);
    merge(this.observations, news.observations);
    merge(this.links, news.links);
    merge(this.health, news.health);
    merge(this.warnings, news.warnings);
    merge(this.tracks, news.tracks);
    for (const track of Object.values(news.tracks)) this.lengthen(track);
  }

  /** Everybody that is known, by number, as of the last `look`. */
  seen(): Seen[] {
    return this.inSight;
  }

  /** Work out where everybody is now; once for all who draw. */
  look(): void {
    this.inSight = this.lookAround();
  }

  private lookAround(): Seen[] {
    const tracks = this.past?.tracks ?? this.tracks;
    const found: Seen[] = [];
    for (const track of tracks.values()) {
      const soldier = this.roster.get(track.soldier) ?? unknown(track.soldier);
      found.push({ soldier, track, shown: shown(track, this.now_s, this.ages), status: this.past === null ? this.statuses.get(track.soldier) : undefined });
    }
    return found.sort((one, other) => one.soldier.number - other.soldier.number);
  }

  /** The floors that somebody is on. */
  floorsInUse(): number[] {
    const found = new Set<number>();
    for (const track of this.tracks.values()) if (track.floor !== null) found.add(track.floor);
    return [...found].sort((one, other) => other - one);
  }

  /** The floor that most are on, whose plan is shown with all floors. */
  busiestFloor(): number | null {
    const counts = new Map<number, number>();
    for (const track of (this.past?.tracks ?? this.tracks).values()) if (track.floor !== null) counts.set(track.floor, (counts.get(track.floor) ?? 0) + 1);
    return [...counts].sort((one, other) => other[1] - one[1] || one[0] - other[0])[0]?.[0] ?? null;
  }

  unseenAlerts(): Alert[] {
    return [...this.alerts.values()].filter((each) => each.acknowledged_by === null).sort((a, b) => b.time_s - a.time_s);
  }

  /** Alerts until the moment that is shown. */
  alertsShown(): Alert[] {
    return this.past === null ? [...this.alerts.values()] : before(this.archived.alerts, this.past.time_s);
  }

  /** Things seen until the moment that is shown. */
  observationsShown(): Observation[] {
    return this.past === null ? [...this.observations.values()] : before(this.archived.observations, this.past.time_s);
  }

  /** While looking back: what had just been alerted at that moment, the newest last. */
  alertsThen(): Alert[] {
    const { past } = this;
    if (past === null) return [];
    const since_s = past.time_s - Math.max(THEN_S, THEN_PLAYED_S * past.speed);
    return this.alertsShown().filter((each) => each.time_s > since_s).sort((one, other) => one.time_s - other.time_s).slice(-4);
  }

  /** Where somebody has gone of late, as of the moment that is shown. */
  trail(soldier: string): TrailPoint[] {
    const { past } = this;
    if (past === null) return this.trails.get(soldier) ?? [];
    return before(this.trailsThen.get(soldier) ?? [], past.time_s).filter((each) => each.time_s > past.time_s - TRAIL_S);
  }

  callsign(soldier: string): string {
    return this.roster.get(soldier)?.callsign ?? soldier;
  }

  /** A trail from the archive, to go before what has been heard since. */
  recall(feature: GeoJSON.Feature): void {
    const found = trailIn(feature);
    if (found === null) return;
    const [soldier, points] = found;
    const heard = this.trails.get(soldier) ?? [];
    const earlier = points.filter((each) => heard.length === 0 || each.time_s < heard[0]!.time_s);
    this.trails.set(soldier, [...earlier, ...heard].slice(-TRAIL_POINTS));
  }

  private lengthen(track: Track): void {
    const trail = this.trails.get(track.soldier) ?? [];
    const last = trail.at(-1);
    if (track.mode === "unplaced" || (last && track.time_s <= last.time_s)) return;
    trail.push({ time_s: track.time_s, place: [track.longitude_deg, track.latitude_deg], floor: track.floor });
    while (trail.length > TRAIL_POINTS || trail[0]!.time_s < track.time_s - TRAIL_S) trail.shift();
    this.trails.set(track.soldier, trail);
  }

  private setClock(now_s: number): void {
    this.heard = { now_s, host_s: performance.now() / 1000 };
  }
}

/** A soldier's trail as the archive tells it. */
export function trailIn(feature: GeoJSON.Feature): [soldier: string, points: TrailPoint[]] | null {
  if (feature.geometry.type !== "LineString") return null;
  const { soldier, times_s, floors } = feature.properties as { soldier: string; times_s: number[]; floors: (number | null)[] };
  return [soldier, feature.geometry.coordinates.map((place, index) => ({ time_s: times_s[index]!, place: place as Place, floor: floors[index] ?? null }))];
}

function before<T extends { time_s: number }>(all: T[], time_s: number): T[] {
  return all.filter((each) => each.time_s <= time_s);
}

function merge<T>(into: Map<string, T>, news: Record<string, T>): void {
  for (const [key, value] of Object.entries(news)) into.set(key, value);
}

function unknown(soldier: string): Soldier {
  return { soldier, number: 9999, unit: "", callsign: soldier, role: "" };
}
