// The map: grid or basemap, buildings, trails, doubt, soldiers, things seen. Everything lies in GeoJSON sources.

import { Map as MapLibre, addProtocol, setWorkerUrl, type GeoJSONSource, type StyleSpecification } from "maplibre-gl";
import workerUrl from "maplibre-gl/dist/maplibre-gl-worker.mjs?worker&url";
import "maplibre-gl/dist/maplibre-gl.css";
import { Protocol, PMTiles } from "pmtiles";
import { courseOf, duration, speedOf } from "./display.ts";
import { gridLines, moved } from "./geo.ts";
import { BASEMAP, layers, PALETTE, type Theme } from "./layers.ts";
import type { State } from "./state.ts";
import { addArrow, foreignIcon, observationIcon, soldierIcon } from "./symbols.ts";
import type { Place } from "./types.ts";

type Feature = GeoJSON.Feature;
const CROWD = 100; // more are drawn without names, circles and trails from afar, or nothing could be read
const CROWD_ZOOM = 17.5;
const AHEAD_S = 5; // of the line that shows speed
const SOURCES = ["grid", "grid-labels", "plan", "trails", "doubt", "vectors", "since", "foreign", "soldiers", "observations", "draft"];

export class SquadMap {
  readonly map: MapLibre;
  plan: Feature[] = [];
  private readonly state: State;
  ready = false;
  private planFloor: number | null = null;
  private followed: Place | null = null;

  constructor(container: string, state: State, theme: Theme) {
    setWorkerUrl(workerUrl);
    this.state = state;
    this.map = new MapLibre({
      container,
      style: style(theme),
      center: [state.post.origin_deg[1], state.post.origin_deg[0]],
      zoom: 17,
      minZoom: 2,
      maxZoom: 23,
      attributionControl: false,
      fadeDuration: 0,
      pitchWithRotate: false,
      dragRotate: false,
    });
    this.map.touchZoomRotate.disableRotation();
    this.map.on("load", () => {
      this.ready = true;
      this.drawGrid();
      this.draw();
    });
    this.map.on("styledata", () => this.addArrows());
    this.map.on("move", () => this.drawGrid());
  }

  async addBasemap(): Promise<void> {
    const protocol = new Protocol();
    addProtocol("pmtiles", protocol.tile);
    const address = new URL("basemap", document.baseURI).href;
    const header = await new PMTiles(address).getHeader();
    await new Promise<void>((resolve) => (this.ready ? resolve() : void this.map.once("load", () => resolve())));
    const raster = header.tileType > 1;
    this.map.addSource("basemap", { type: raster ? "raster" : "vector", url: `pmtiles://${address}`, ...(raster ? { tileSize: 256 } : {}) });
    for (const layer of BASEMAP(raster)) this.map.addLayer(layer, "grid");
  }

  setTheme(theme: Theme): void {
    for (const layer of layers(theme)) {
      if (layer.id === "names") this.map.setLayoutProperty("names", "text-field", layer.layout!["text-field" as keyof typeof layer.layout]);
      for (const [name, value] of Object.entries(layer.paint ?? {})) this.map.setPaintProperty(layer.id, name as Parameters<MapLibre["setPaintProperty"]>[1], value);
    }
  }

  /** Draw what has changed since the last time: soldiers always, the plan when another floor is looked at. */
  draw(): void {
    if (!this.ready) return;
    const seen = this.state.seen().filter((each) => each.track.mode !== "unplaced");
    const crowded = seen.length > CROWD && this.map.getZoom() < CROWD_ZOOM;
    const [soldiers, doubt, vectors, since]: [Feature[], Feature[], Feature[], Feature[]] = [[], [], [], []];
    for (const each of seen) {
      const { track, shown, soldier } = each;
      const selected = this.state.selected === track.soldier;
      const here = this.state.floor === null || track.floor === null || track.floor === this.state.floor;
      const course = courseOf(track);
      const properties = {
        id: track.soldier,
        icon: soldierIcon(this.map, soldier, shown.state, selected),
        name: crowded && shown.state === "fresh" && !selected ? "" : soldier.callsign + (this.state.floor === null && track.floor !== null ? `  ⌂${track.floor}` : ""),
        words: shown.state === "fresh" ? (selected ? shown.words : "") : shown.words,
        state: shown.state,
        opacity: (here ? 1 : 0.22) * fading(shown.state, shown.age_s, this.state.ages.lost_s),
        label: here ? 1 : 0.3,
        arrow: course === null || shown.state === "lost" ? "" : `arrow-${shown.state}`,
        course: course ?? 0,
        rank: soldier.number,
      };
      soldiers.push(point(shown.place, properties));
      if (!crowded || selected) doubt.push(point(shown.place, { radius_m: shown.radius_95_m, equator_m: shown.radius_95_m / Math.cos((shown.place[1] * Math.PI) / 180), state: shown.state, opacity: here ? 1 : 0.2 }));
      const speed = speedOf(track);
      if (!crowded && speed >= 0.3 && here && shown.state !== "lost") {
        const ahead = moved(shown.place, track.east_velocity_m_s * AHEAD_S, track.north_velocity_m_s * AHEAD_S);
        vectors.push(line([shown.place, ahead], { state: shown.state }));
      }
      if (shown.state !== "fresh" && here) {
        since.push(line([[track.longitude_deg, track.latitude_deg], shown.place], { state: shown.state }));
      }
      if (selected && this.state.following) this.follow(shown.place);
    }
    this.set("soldiers", soldiers);
    this.set("doubt", doubt);
    this.set("vectors", vectors);
    this.set("since", since);
    this.set("trails", this.state.trailsOn && this.state.past === null ? this.trails() : []);
    this.drawForeign();
    this.drawPlan();
  }

  drawObservations(): void {
    if (!this.ready) return;
    const views = [...this.state.observations.values()];
    this.set("observations", views.map((each) => point([each.longitude_deg, each.latitude_deg], {
      id: each.id,
      icon: observationIcon(this.map, each.code),
      name: [each.code?.replaceAll("_", " "), each.text].filter(Boolean).join(": "),
      equator_m: (2.45 * each.accuracy_m) / Math.cos((each.latitude_deg * Math.PI) / 180),
    })));
  }

  private drawForeign(): void {
    const views = this.state.past === null ? [...this.state.foreign.values()] : [];
    this.set("foreign", views.map((each) => point([each.longitude_deg, each.latitude_deg], {
      id: each.uid,
      icon: foreignIcon(this.map, each.affiliation),
      name: `${each.callsign ?? each.uid}${each.stale_s < this.state.now_s ? `\nstale for ${duration(this.state.now_s - each.stale_s)}` : ""}`,
      opacity: each.stale_s < this.state.now_s ? 0.5 : 1,
    })));
  }

  /** What a tool is about to place: lines, points and their labels. */
  drawDraft(features: Feature[]): void {
    this.set("draft", features);
  }

  /** Show everybody who is not lost (but all if all are), and the buildings they may be in. */
  fit(): void {
    const placed = this.state.seen().filter((each) => each.track.mode !== "unplaced");
    const known = placed.filter((each) => each.shown.state !== "lost");
    const places = (known.length ? known : placed).map((each) => each.shown.place);
    for (const feature of this.plan) {
      if (feature.properties?.kind === "room" && feature.geometry.type === "Polygon") places.push(...(feature.geometry.coordinates[0] as Place[]));
    }
    if (places.length === 0) return;
    const [longitudes, latitudes] = [places.map((each) => each[0]), places.map((each) => each[1])];
    const bounds: [number, number, number, number] = [Math.min(...longitudes), Math.min(...latitudes), Math.max(...longitudes), Math.max(...latitudes)];
    this.map.fitBounds(bounds, { padding: 90, maxZoom: 20, duration: 500 });
  }

  centre(soldier: string): void {
    const found = this.state.seen().find((each) => each.track.soldier === soldier);
    if (found) this.map.easeTo({ center: found.shown.place, zoom: Math.max(this.map.getZoom(), 18), duration: 400 });
  }

  private follow(place: Place): void {
    const still = this.followed && Math.abs(this.followed[0] - place[0]) + Math.abs(this.followed[1] - place[1]) < 1e-7;
    if (still || this.map.isMoving()) return;
    this.followed = place;
    this.map.easeTo({ center: place, duration: 240 });
  }

  private trails(): Feature[] {
    const features: Feature[] = [];
    const crowd = this.state.trails.size > CROWD;
    for (const [soldier, trail] of this.state.trails) {
      if (crowd && soldier !== this.state.selected) continue;
      const points = trail.filter((each) => this.state.floor === null || each.floor === null || each.floor === this.state.floor);
      if (points.length > 1) features.push(line(points.map((each) => each.place), { id: soldier, selected: this.state.selected === soldier }));
    }
    return features;
  }

  private drawPlan(): void {
    const shownFloor = this.state.floor ?? this.state.busiestFloor() ?? 0;
    if (this.planFloor === shownFloor || this.plan.length === 0) return;
    this.planFloor = shownFloor;
    const features = this.plan.filter((each) => {
      const floors = each.properties?.floors as number[] | undefined;
      return floors === undefined || floors.includes(shownFloor);
    });
    this.set("plan", features);
  }

  private drawGrid(): void {
    if (!this.ready) return;
    const view = this.map.getBounds();
    const [west, south, east, north] = [view.getWest(), view.getSouth(), view.getEast(), view.getNorth()];
    if (Math.abs(north) > 83 || Math.abs(south) > 83 || east - west > 40) {
      this.set("grid", []);
      this.set("grid-labels", []);
      return;
    }
    const lines = gridLines(west, south, east, north);
    this.set("grid", lines.map((each) => line(each.points, { major: each.major })));
    this.set("grid-labels", lines.map((each) => point(each.vertical ? edge(each.points, 1, south + (north - south) * 0.012) : edge(each.points, 0, east - (east - west) * 0.012), { text: each.label })));
  }

  private set(source: string, features: Feature[]): void {
    (this.map.getSource(source) as GeoJSONSource | undefined)?.setData({ type: "FeatureCollection", features });
  }

  private addArrows(): void {
    for (const state of ["fresh", "stale"] as const) {
      if (!this.map.hasImage(`arrow-${state}`)) addArrow(this.map, `arrow-${state}`, PALETTE[state]);
    }
  }
}

/** Where a line meets a parallel (axis 1) or a meridian (axis 0) at the edge of the view. */
function edge(points: Place[], axis: 0 | 1, value: number): Place {
  for (let index = 1; index < points.length; index++) {
    const [from, to] = [points[index - 1]!, points[index]!];
    const share = (value - from[axis]) / (to[axis] - from[axis]);
    if (share >= 0 && share <= 1) return [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
  }
  return points[0]!;
}

/** Known long ago is fainter; somebody lost stays readable. */
function fading(state: string, age_s: number, lost_s: number): number {
  return state === "fresh" ? 1 : Math.max(0.7, 1 - (0.3 * age_s) / lost_s);
}

function point(coordinates: Place, properties: Record<string, unknown>): Feature {
  return { type: "Feature", geometry: { type: "Point", coordinates }, properties };
}

function line(coordinates: Place[], properties: Record<string, unknown>): Feature {
  return { type: "Feature", geometry: { type: "LineString", coordinates }, properties };
}

function style(theme: Theme): StyleSpecification {
  const empty = { type: "geojson" as const, data: { type: "FeatureCollection" as const, features: [] } };
  return {
    version: 8,
    sources: Object.fromEntries(SOURCES.map((name) => [name, { ...empty }])),
    layers: layers(theme),
  };
}
