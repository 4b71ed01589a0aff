// The map's layers and colours by theme. Colours are Okabe and Ito's, told apart by colour-blind people too; a state
// never shows by its colour alone.

import type { LayerSpecification } from "maplibre-gl";

export type Theme = "dark" | "light";

export const PALETTE = { fresh: "#56b4e9", stale: "#e69f00", lost: "#d55e00" } as const;

const SHADES = {
  dark: { ground: "#10161d", grid: "#2a3a48", major: "#3d556a", gridText: "#7e97ab", room: "#223240", wall: "#9db2c4", door: "#10161d", text: "#eef5fb", halo: "#0b1118", obstacle: "#26313b", stairs: "#6f8aa0", trail: "#7fb8dc" },
  light: { ground: "#f3f5f2", grid: "#d4dbdd", major: "#b3c0c6", gridText: "#61737f", room: "#e2e8ec", wall: "#2d3b46", door: "#f3f5f2", text: "#0d1720", halo: "#ffffff", obstacle: "#d3d9d2", stairs: "#7b8b98", trail: "#2c7fb0" },
};

const byState = ["match", ["get", "state"], "lost", PALETTE.lost, "stale", PALETTE.stale, PALETTE.fresh];
/** A radius in metres (at the equator's scale) as pixels: tiles are 512 px and double with each zoom. */
const METRES = 512 / (2 * Math.PI * 6_378_137);
const radius = ["interpolate", ["exponential", 2], ["zoom"], 0, ["*", ["get", "equator_m"], METRES], 24, ["*", ["get", "equator_m"], METRES * 2 ** 24]];
const FONT = ["Noto Sans Regular"];

export function layers(theme: Theme): LayerSpecification[] {
  const shade = SHADES[theme];
  const label = { "text-color": shade.text, "text-halo-color": shade.halo, "text-halo-width": 1.6 };
  const kind = (name: string) => ["==", ["get", "kind"], name];
  return [
    { id: "ground", type: "background", paint: { "background-color": shade.ground } },
    { id: "grid", source: "grid", type: "line", paint: { "line-color": ["case", ["get", "major"], shade.major, shade.grid], "line-width": ["case", ["get", "major"], 1.4, 0.8] } },
    { id: "outdoor", source: "plan", type: "line", filter: kind("outdoor"), paint: { "line-color": shade.grid, "line-dasharray": [4, 3] } },
    { id: "obstacles", source: "plan", type: "fill", filter: kind("obstacle"), paint: { "fill-color": shade.obstacle, "fill-outline-color": shade.stairs } },
    { id: "rooms", source: "plan", type: "fill", filter: kind("room"), paint: { "fill-color": shade.room, "fill-opacity": 0.92 } },
    { id: "room-edges", source: "plan", type: "line", filter: kind("room"), paint: { "line-color": shade.wall, "line-opacity": 0.25, "line-width": 1 } },
    { id: "stairs", source: "plan", type: "line", filter: kind("stairs"), paint: { "line-color": shade.stairs, "line-width": ["interpolate", ["exponential", 2], ["zoom"], 16, 2, 22, 60], "line-dasharray": [0.12, 0.12], "line-opacity": 0.7 } },
    { id: "walls", source: "plan", type: "line", filter: kind("wall"), layout: { "line-cap": "square" }, paint: { "line-color": shade.wall, "line-width": ["interpolate", ["linear"], ["zoom"], 15, 1, 20, 3] } },
    { id: "lifts", source: "plan", type: "circle", filter: kind("lift"), paint: { "circle-radius": 7, "circle-color": shade.room, "circle-stroke-color": shade.wall, "circle-stroke-width": 2 } },
    { id: "plan-names", source: "plan", type: "symbol", minzoom: 18.2, filter: ["any", kind("room"), kind("place"), kind("stairs"), kind("lift")], layout: { "text-field": ["coalesce", ["get", "name"], ""], "text-font": FONT, "text-size": 11 }, paint: { "text-color": shade.gridText, "text-halo-color": shade.halo, "text-halo-width": 1 } },
    { id: "grid-names", source: "grid-labels", type: "symbol", layout: { "text-field": ["get", "text"], "text-font": FONT, "text-size": 10, "text-allow-overlap": true }, paint: { "text-color": shade.gridText, "text-halo-color": shade.halo, "text-halo-width": 1.5 } },
    { id: "trails", source: "trails", type: "line", layout: { "line-cap": "round", "line-join": "round" }, paint: { "line-color": shade.trail, "line-width": ["case", ["get", "selected"], 3, 1.6], "line-opacity": ["case", ["get", "selected"], 0.9, 0.32] } },
    { id: "doubt", source: "doubt", type: "circle", paint: { "circle-radius": radius, "circle-pitch-alignment": "map", "circle-color": byState, "circle-opacity": ["*", ["get", "opacity"], theme === "dark" ? 0.08 : 0.09], "circle-stroke-color": byState, "circle-stroke-width": 1.3, "circle-stroke-opacity": ["*", ["get", "opacity"], 0.75] } },
    { id: "vectors", source: "vectors", type: "line", layout: { "line-cap": "round" }, paint: { "line-color": byState, "line-width": 2.2, "line-opacity": 0.8 } },
    { id: "since", source: "since", type: "line", paint: { "line-color": byState, "line-width": 1.6, "line-dasharray": [3, 2] } },
    { id: "seen-doubt", source: "observations", type: "circle", paint: { "circle-radius": radius, "circle-color": "#cc79a7", "circle-opacity": 0.08, "circle-stroke-color": "#cc79a7", "circle-stroke-width": 1, "circle-stroke-opacity": 0.6 } },
    { id: "observations", source: "observations", type: "symbol", layout: { "icon-image": ["get", "icon"], "icon-allow-overlap": true, "text-field": ["get", "name"], "text-font": FONT, "text-size": 12, "text-offset": [0, 1.5], "text-anchor": "top", "text-optional": true }, paint: label },
    { id: "foreign", source: "foreign", type: "symbol", layout: { "icon-image": ["get", "icon"], "icon-allow-overlap": true, "text-field": ["get", "name"], "text-font": FONT, "text-size": 12, "text-offset": [0, 1.5], "text-anchor": "top", "text-optional": true }, paint: { ...label, "icon-opacity": ["get", "opacity"] } },
    { id: "soldiers", source: "soldiers", type: "symbol", layout: { "icon-image": ["get", "icon"], "icon-allow-overlap": true, "icon-ignore-placement": true, "symbol-sort-key": ["get", "rank"] }, paint: { "icon-opacity": ["get", "opacity"] } },
    { id: "headings", source: "soldiers", type: "symbol", filter: ["!=", ["get", "arrow"], ""], layout: { "icon-image": ["get", "arrow"], "icon-rotate": ["get", "course"], "icon-rotation-alignment": "map", "icon-offset": [0, -25], "icon-allow-overlap": true, "icon-ignore-placement": true }, paint: { "icon-opacity": ["get", "opacity"] } },
    { id: "names", source: "soldiers", type: "symbol", layout: { "text-field": ["format", ["get", "name"], { "font-scale": 1 }, ["case", ["==", ["get", "words"], ""], "", ["concat", "\n", ["get", "words"]]], { "font-scale": 0.95, "text-color": ["match", ["get", "state"], "lost", theme === "dark" ? "#ff9d7a" : "#a83c00", "stale", theme === "dark" ? "#f5c04a" : "#8a5d00", shade.text] }], "text-font": FONT, "text-size": 13, "text-anchor": "left", "text-offset": [1.7, 0], "text-justify": "left", "symbol-sort-key": ["get", "rank"], "text-variable-anchor-offset": ["left", [1.7, 0], "right", [-1.7, 0], "top", [0, 1.2], "bottom", [0, -1.2]] }, paint: { ...label, "text-opacity": ["get", "label"] } },
    { id: "draft-lines", source: "draft", type: "line", paint: { "line-color": "#f0e442", "line-width": 2.5, "line-dasharray": [2, 1.5] } },
    { id: "draft-points", source: "draft", type: "circle", filter: ["==", ["geometry-type"], "Point"], paint: { "circle-radius": 6, "circle-color": "#f0e442", "circle-stroke-color": "#0b1118", "circle-stroke-width": 2 } },
    { id: "draft-names", source: "draft", type: "symbol", filter: ["==", ["geometry-type"], "Point"], layout: { "text-field": ["coalesce", ["get", "text"], ""], "text-font": FONT, "text-size": 13, "text-offset": [0, -1.2], "text-anchor": "bottom", "text-allow-overlap": true }, paint: label },
  ] as LayerSpecification[];
}

/** A given basemap below the grid: raster tiles as they are, vector tiles plainly by their geometry. */
export function BASEMAP(raster: boolean): LayerSpecification[] {
  if (raster) return [{ id: "basemap", source: "basemap", type: "raster", paint: { "raster-opacity": 0.85 } }];
  const plain: [string, string, string][] = [["earth", "fill", "#20303c"], ["landuse", "fill", "#22352c"], ["water", "fill", "#17344d"], ["buildings", "fill", "#33424f"], ["roads", "line", "#4a5a68"]];
  return plain.map(([name, type, colour]) => ({ id: `basemap-${name}`, source: "basemap", "source-layer": name, type, paint: type === "fill" ? { "fill-color": colour } : { "line-color": colour, "line-width": 1.2 } })) as LayerSpecification[];
}
