// A basemap of one's own below the grid, from the hub: raster tiles as they are, vector tiles in neutral shades by the
// names that their layers and classes have in the OpenMapTiles, Protomaps and Shortbread schemas.

import type { LayerSpecification, SourceSpecification } from "maplibre-gl";
import { PMTiles } from "pmtiles";
import { FONT, type Theme } from "./layers.ts";

export interface Basemap {
  source: SourceSpecification;
  /** Names of the layers in vector tiles; none of raster tiles. */
  given: string[];
}

interface TileJson {
  tiles: string[];
  format: "raster" | "vector";
  minzoom: number;
  maxzoom: number;
  bounds: [number, number, number, number];
  vector_layers: { id: string }[];
}

const RASTER_PX = 256;
const MVT = 1;
const SHADES = {
  dark: { earth: "#161d24", green: "#18261f", built: "#1c2229", water: "#14304a", road: "#46525d", main: "#6b7782", path: "#3a4a45", rail: "#5a5560", building: "#2a343d", edge: "#3a4753", boundary: "#6b5a70", text: "#8fa1af", halo: "#10161d" },
  light: { earth: "#f1f1ec", green: "#dbe8d4", built: "#e8e6e2", water: "#bcd8ea", road: "#ffffff", main: "#fff3d0", path: "#cfc4b2", rail: "#b4aeb8", building: "#d8d4cd", edge: "#bcb6ac", boundary: "#a88fae", text: "#5a6670", halo: "#ffffff" },
};
const kindOf = ["coalesce", ["get", "class"], ["get", "kind"], ""];
const among = (...kinds: string[]) => ["in", kindOf, ["literal", kinds]];
const GREEN = among("wood", "forest", "grass", "grassland", "park", "scrub", "meadow", "garden", "orchard", "farmland", "cemetery", "nature_reserve", "national_park", "golf_course", "recreation_ground", "pitch", "wetland", "village_green", "allotments", "vineyard", "heath");
const MAIN = among("motorway", "trunk", "primary", "secondary", "highway", "major_road");
const PATH = among("path", "track", "footway", "cycleway", "pedestrian", "steps", "bridleway");
const RAIL = among("rail", "transit", "light_rail", "subway", "tram", "narrow_gauge");
const polygon = ["==", ["geometry-type"], "Polygon"];
const linear = ["==", ["geometry-type"], "LineString"];
const wide = (at12: number, at20: number) => ["interpolate", ["exponential", 1.6], ["zoom"], 12, at12, 20, at20];
const all = (...filters: unknown[]) => ["all", ...filters];

type Shade = (typeof SHADES)["dark"];
/** A style layer for each of these source layers that there is: from the ground up. */
const STYLE: [from: string[], type: "fill" | "line", filter: unknown[], paint: (shade: Shade) => Record<string, unknown>][] = [
  [["earth", "land"], "fill", polygon, (s) => ({ "fill-color": ["case", GREEN, s.green, s.earth] })],
  [["landcover", "landuse", "park", "sites"], "fill", polygon, (s) => ({ "fill-color": ["case", GREEN, s.green, s.built], "fill-opacity": 0.9 })],
  [["ocean", "water", "water_polygons"], "fill", polygon, (s) => ({ "fill-color": s.water })],
  [["water", "waterway", "water_lines"], "line", linear, (s) => ({ "line-color": s.water, "line-width": wide(0.8, 10) })],
  [["transportation", "roads", "streets"], "line", all(linear, PATH), (s) => ({ "line-color": s.path, "line-width": wide(0.5, 4), "line-dasharray": [3, 2] })],
  [["transportation", "roads", "streets"], "line", all(linear, ["!", MAIN], ["!", PATH], ["!", RAIL]), (s) => ({ "line-color": s.road, "line-width": wide(0.6, 22) })],
  [["transportation", "roads", "streets"], "line", all(linear, MAIN), (s) => ({ "line-color": s.main, "line-width": wide(1.5, 34) })],
  [["transportation", "roads", "transit", "streets"], "line", all(linear, RAIL), (s) => ({ "line-color": s.rail, "line-width": wide(0.8, 5), "line-dasharray": [4, 1] })],
  [["building", "buildings"], "fill", polygon, (s) => ({ "fill-color": s.building, "fill-outline-color": s.edge })],
  [["boundary", "boundaries"], "line", linear, (s) => ({ "line-color": s.boundary, "line-width": 1, "line-dasharray": [4, 3] })],
];
const NAMES: [from: string[], placement: "point" | "line", size: number, minzoom: number][] = [
  [["transportation_name", "roads", "street_labels"], "line", 11, 14],
  [["place", "places", "place_labels"], "point", 13, 4],
];

/** What the hub has, asked for: a PMTiles file by ranges, or the tiles of an MBTiles file. */
export async function basemapOf(kind: "pmtiles" | "mbtiles"): Promise<Basemap> {
  const address = new URL("basemap", document.baseURI).href;
  return kind === "pmtiles" ? ofPmtiles(address) : ofMbtiles(address);
}

async function ofPmtiles(address: string): Promise<Basemap> {
  const file = new PMTiles(address);
  const isVector = (await file.getHeader()).tileType === MVT;
  const url = `pmtiles://${address}`;
  if (!isVector) return { source: { type: "raster", url, tileSize: RASTER_PX }, given: [] };
  const { vector_layers = [] } = (await file.getMetadata()) as Partial<TileJson>;
  return { source: { type: "vector", url }, given: vector_layers.map((each) => each.id) };
}

async function ofMbtiles(address: string): Promise<Basemap> {
  const { tiles, format, minzoom, maxzoom, bounds, vector_layers } = (await (await fetch(`${address}/tiles.json`)).json()) as TileJson;
  const found = { tiles: tiles.map((each) => `${address}/${each}`), minzoom, maxzoom, bounds };
  if (format === "raster") return { source: { type: "raster", tileSize: RASTER_PX, ...found }, given: [] };
  return { source: { type: "vector", ...found }, given: vector_layers.map((each) => each.id) };
}

export function basemapLayers({ source, given }: Basemap, theme: Theme): LayerSpecification[] {
  const shade = SHADES[theme];
  if (source.type === "raster") return [{ id: "basemap", source: "basemap", type: "raster", paint: theme === "dark" ? { "raster-opacity": 0.7, "raster-saturation": -0.4, "raster-brightness-max": 0.7 } : { "raster-opacity": 0.85, "raster-saturation": 0, "raster-brightness-max": 1 } }];
  const there = (names: string[]) => names.filter((each) => given.includes(each));
  const drawn = STYLE.flatMap(([from, type, filter, paint], index) => there(from).map((name) => ({
    id: `basemap-${index}-${name}`, source: "basemap", "source-layer": name, type, filter, paint: paint(shade),
    ...(type === "line" ? { layout: { "line-cap": "round", "line-join": "round" } } : {}),
  })));
  const named = NAMES.flatMap(([from, placement, size, minzoom]) => there(from).map((name) => ({
    id: `basemap-names-${name}`, source: "basemap", "source-layer": name, type: "symbol", minzoom,
    layout: { "text-field": ["coalesce", ["get", "name"], ""], "text-font": FONT, "text-size": size, "symbol-placement": placement },
    paint: { "text-color": shade.text, "text-halo-color": shade.halo, "text-halo-width": 1.2 },
  })));
  return [...drawn, ...named] as LayerSpecification[];
}
