// Trails while somebody looks back: the archive's, asked for in stretches, so that playing on needs no new question.

import { get } from "./link.ts";
import { CROWD, TRAIL_S, trailIn, type State, type TrailPoint } from "./state.ts";

type Trails = GeoJSON.FeatureCollection & { until_s: number };

const STRETCH_S = 120;
const PLAYED_S = 20; // of the host's time, for which a stretch should last while playing

export class Recall {
  private readonly state: State;
  private covered: { from: number; to: number; soldier: string | null } | null = null;
  private asking = false;

  constructor(state: State) {
    this.state = state;
  }

  /** See to it that the trails up to a moment are there; of a crowd only that of who is selected. */
  async cover(time_s: number): Promise<void> {
    const { state, covered } = this;
    const soldier = state.roster.size > CROWD ? state.selected : null;
    const there = covered !== null && covered.soldier === soldier && covered.from <= time_s - TRAIL_S && time_s <= covered.to;
    if (there || this.asking || (state.roster.size > CROWD && soldier === null)) return;
    const [from, to] = [time_s - TRAIL_S - STRETCH_S, time_s + Math.max(STRETCH_S, PLAYED_S * (state.past?.speed ?? 1))];
    this.asking = true;
    try {
      const [trails, until] = await trailsOf(from, to, time_s, soldier);
      state.trailsThen = trails;
      this.covered = { from, to: until, soldier };
    } catch {
      this.covered = null; // trails are a convenience: asked for again at the next moment
    } finally {
      this.asking = false;
    }
  }
}

/** Trails and until when they are whole: at least until `needed`; one answer has only so many reports, the earliest. */
async function trailsOf(from: number, to: number, needed: number, soldier: string | null): Promise<[Map<string, TrailPoint[]>, number]> {
  const trails = new Map<string, TrailPoint[]>();
  const whose = soldier === null ? "" : `&soldier=${encodeURIComponent(soldier)}`;
  let until = from;
  do {
    const found = await get<Trails>(`history/trails.geojson?begin_s=${until}&end_s=${to}${whose}`);
    for (const [name, points] of found.features.map(trailIn).filter((each) => each !== null)) trails.set(name, [...(trails.get(name) ?? []), ...points]);
    if (found.until_s <= until) break; // more at one moment than an answer has
    until = found.until_s;
  } while (until <= needed && until < to);
  return [trails, until];
}
