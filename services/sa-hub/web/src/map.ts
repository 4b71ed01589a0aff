// The map: basemap and buildings as MapLibre draws them, and the overlay of the grid and everything that moves.

import { Map as MapLibre, ScaleControl, addProtocol, setWorkerUrl, type GeoJSONSource, type LayerSpecification, type StyleSpecification } from "maplibre-gl";
import workerUrl from "maplibre-gl/dist/maplibre-gl-worker.mjs?worker&url";
import "maplibre-gl/dist/maplibre-gl.css";
import { Protocol } from "pmtiles";
import { basemapLayers, basemapOf, type Basemap } from "./basemap.ts";
import { Grid, type Bounds } from "./grid.ts";
import { layers, showLayers, type Theme } from "./layers.ts";
import { marksOf, trailsOf } from "./marks.ts";
import { Overlay, type Draft } from "./overlay.ts";
import { ROOMS_SOURCE } from "./rooms.ts";
import type { State } from "./state.ts";
import type { Place } from "./types.ts";
import { afterPaint } from "./ui.ts";
import { View } from "./view.ts";

type Feature = GeoJSON.Feature;
const SOURCES = ["plan", ROOMS_SOURCE];
const LOWEST = "outdoor"; // of what lies over a basemap
const FIT_PX = { top: 90, bottom: 130, left: 130, right: 110 }; // names stay clear of tools, floors and timeline
const FIGURES_PX = { right: 6, low: 76 }; // above the timeline

export class SquadMap {
  readonly map: MapLibre;
  readonly overlay: Overlay;
  plan: Feature[] = [];
  ready = false;
  /** What the overlay took the last time. */
  spent_ms = 0;
  private readonly state: State;
  private readonly grid = new Grid();
  private theme: Theme;
  private basemap: Basemap | null = null;
  private draft: Draft = { places: [], ring: false, text: "" };
  private isDue = false;
  private put: Place | null = null; // to the middle, unless something else is wanted meanwhile
  private planFloor: number | null = null;
  private readonly bySoftware: boolean;

  constructor(container: string, state: State, theme: Theme) {
    setWorkerUrl(workerUrl);
    this.state = state;
    this.theme = theme;
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
    this.map.addControl(new ScaleControl({ maxWidth: 110 }), "bottom-left");
    this.bySoftware = isDrawnBySoftware(this.map.getCanvas());
    this.overlay = new Overlay(theme, this.bySoftware);
    this.map.getCanvasContainer().append(this.overlay.canvas);
    this.map.on("load", () => {
      this.ready = true;
      this.draw();
    });
    this.map.on("render", () => this.drawOverlay());
  }

  async addBasemap(kind: "pmtiles" | "mbtiles"): Promise<void> {
    addProtocol("pmtiles", new Protocol().tile);
    const basemap = await basemapOf(kind);
    await new Promise<void>((resolve) => (this.ready ? resolve() : void this.map.once("load", () => resolve())));
    this.basemap = basemap;
    this.map.addSource("basemap", basemap.source);
    for (const layer of basemapLayers(basemap, this.theme)) this.map.addLayer(layer, LOWEST);
  }

  setTheme(theme: Theme): void {
    this.theme = this.overlay.theme = theme;
    const all: LayerSpecification[] = [...layers(theme), ...(this.basemap ? basemapLayers(this.basemap, theme) : [])];
    for (const layer of all) {
      for (const [name, value] of Object.entries(layer.paint ?? {})) this.map.setPaintProperty(layer.id, name as Parameters<MapLibre["setPaintProperty"]>[1], value);
    }
  }

  /** Draw what has changed since the last time: what moves always, the plan when another floor is looked at. */
  draw(): void {
    if (!this.ready) return;
    this.drawPlan();
    this.follow();
    this.overlaySoon();
  }

  /** With the next frame, and once in it, however much asks for it; where the map below moves, together with it. */
  private overlaySoon(): void {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => this.isDue && this.drawOverlay());
  }

  private drawOverlay(): void {
    this.isDue = false;
    if (!this.ready) return;
    const began = performance.now();
    const { lng, lat } = this.map.getCenter();
    const { clientWidth, clientHeight } = this.map.getContainer();
    const view = new View([lng, lat], this.map.getZoom(), clientWidth, clientHeight);
    this.grid.cover(this.bounds());
    const corner = this.map.unproject([clientWidth - FIGURES_PX.right, clientHeight - FIGURES_PX.low]);
    const figures = this.grid.figures(corner.lat, corner.lng).map(({ text, place }) => ({ text, at: view.toScreen(place) }));
    this.overlay.draw(view, marksOf(this.state, this.map.getZoom(), this.theme), trailsOf(this.state), { lines: this.grid.lines, figures }, this.draft);
    this.spent_ms = performance.now() - began;
  }

  private bounds(): Bounds {
    const found = this.map.getBounds();
    return { west: found.getWest(), south: found.getSouth(), east: found.getEast(), north: found.getNorth() };
  }

  /** What a tool is about to place: lines, points and their labels. */
  drawDraft(draft: Draft): void {
    this.draft = draft;
    this.overlaySoon();
  }

  /** Show everybody who is not lost (but all if all are), and the buildings they may be in. */
  fit(): void {
    this.put = null;
    const placed = this.state.seen().filter((each) => each.track.mode !== "unplaced");
    const known = placed.filter((each) => each.shown.state !== "lost");
    const places = (known.length ? known : placed).map((each) => each.shown.place);
    for (const feature of this.plan) {
      if (feature.properties?.kind === "room" && feature.geometry.type === "Polygon") places.push(...(feature.geometry.coordinates[0] as Place[]));
    }
    if (places.length === 0) return;
    const [longitudes, latitudes] = [places.map((each) => each[0]), places.map((each) => each[1])];
    const bounds: [number, number, number, number] = [Math.min(...longitudes), Math.min(...latitudes), Math.max(...longitudes), Math.max(...latitudes)];
    this.map.fitBounds(bounds, { padding: FIT_PX, maxZoom: 20, duration: this.lasting(500) });
  }

  centre(soldier: string): void {
    const found = this.state.seen().find((each) => each.track.soldier === soldier);
    if (found) this.show(found.shown.place, 18);
  }

  /** Bring a place to the middle, and near enough. */
  show(place: Place, zoom: number): void {
    this.put = place;
    const move = () => this.put === place && this.map.easeTo({ center: place, zoom: Math.max(this.map.getZoom(), zoom), duration: this.lasting(400) });
    if (this.bySoftware) afterPaint(move);
    else move();
  }

  /** Keep the selected soldier in the middle, if that is wanted. */
  private follow(): void {
    if (!this.state.following || this.map.isMoving()) return;
    const place = this.state.seen().find((each) => each.track.soldier === this.state.selected)?.shown.place;
    if (place === undefined) return;
    const [at, { clientWidth, clientHeight }] = [this.map.project(place), this.map.getContainer()];
    if (Math.hypot(at.x - clientWidth / 2, at.y - clientHeight / 2) >= 1) this.map.easeTo({ center: place, duration: this.lasting(240) });
  }

  /** How long a movement of the map may last: without graphics hardware each of its frames takes too long. */
  private lasting(wanted_ms: number): number {
    return this.bySoftware ? 0 : wanted_ms;
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

  private set(source: string, features: Feature[]): void {
    showLayers(this.map, source, features.length > 0);
    (this.map.getSource(source) as GeoJSONSource | undefined)?.setData({ type: "FeatureCollection", features });
  }
}

/** Whether the processor only imitates graphics hardware. */
function isDrawnBySoftware(canvas: HTMLCanvasElement): boolean {
  const gl = canvas.getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  return info != null && /swiftshader|llvmpipe|softpipe|basic render/i.test(String(gl!.getParameter(info.UNMASKED_RENDERER_WEBGL)));
}

function style(theme: Theme): StyleSpecification {
  const empty = { type: "geojson" as const, data: { type: "FeatureCollection" as const, features: [] } };
  return {
    version: 8,
    sources: Object.fromEntries(SOURCES.map((name) => [name, { ...empty }])),
    layers: layers(theme).map((each) => ("source" in each ? { ...each, layout: { ...each.layout, visibility: "none" } } : each) as LayerSpecification),
  };
}
