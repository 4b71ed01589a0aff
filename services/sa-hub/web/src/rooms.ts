// Maps of rooms that soldiers' computers have drawn: what was walked and seen, on the floor that is looked at.

import type { GeoJSONSource } from "maplibre-gl";
import { showLayers } from "./layers.ts";
import { get } from "./link.ts";
import type { SquadMap } from "./map.ts";
import type { State } from "./state.ts";
import type { Picture } from "./types.ts";

export const ROOMS_SOURCE = "mapped";

export class Rooms {
  private readonly state: State;
  private readonly map: SquadMap;
  private features: GeoJSON.Feature[] = [];
  private drawn = "";

  constructor(state: State, map: SquadMap) {
    this.state = state;
    this.map = map;
  }

  /** The hub tells only that a map has grown; the map itself is fetched. */
  async take(news: Picture): Promise<void> {
    if (Object.keys(news.rooms ?? {}).length === 0) return;
    this.features = (await get<GeoJSON.FeatureCollection>("rooms.geojson")).features;
    this.drawn = "";
  }

  /** The floors that somebody has mapped. */
  floors(): number[] {
    return [...new Set(this.features.map((each) => each.properties?.floor as number))];
  }

  draw(): void {
    const floor = this.state.floor ?? this.state.busiestFloor() ?? 0;
    const key = this.features.length ? `${floor}/${this.features.length}` : "";
    const source = this.map.ready ? (this.map.map.getSource(ROOMS_SOURCE) as GeoJSONSource | undefined) : undefined;
    if (key === this.drawn || source === undefined) return;
    this.drawn = key;
    const features = this.features.filter((each) => each.properties?.floor === floor);
    showLayers(this.map.map, ROOMS_SOURCE, features.length > 0);
    source.setData({ type: "FeatureCollection", features });
  }
}
