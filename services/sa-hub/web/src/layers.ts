// The layers of what stands still on the map, and all colours by theme. Colours are Okabe and Ito's, told apart by
// colour-blind people too; a state never shows by its colour alone.

import type { LayerSpecification, Map as MapLibre } from "maplibre-gl";

export type Theme = "dark" | "light";

export const PALETTE = { fresh: "#56b4e9", stale: "#e69f00", lost: "#d55e00" } as const;

const SHADES = {
  dark: { ground: "#10161d", grid: "#2a3a48", major: "#3d556a", gridText: "#7e97ab", room: "#223240", wall: "#9db2c4", door: "#10161d", text: "#eef5fb", halo: "#0b1118", obstacle: "#26313b", stairs: "#6f8aa0", trail: "#7fb8dc" },
  light: { ground: "#f3f5f2", grid: "#d4dbdd", major: "#b3c0c6", gridText: "#61737f", room: "#e2e8ec", wall: "#2d3b46", door: "#f3f5f2", text: "#0d1720", halo: "#ffffff", obstacle: "#d3d9d2", stairs: "#7b8b98", trail: "#2c7fb0" },
};

/** Of writing over the map, by state. */
export const TEXTS = {
  dark: { fresh: SHADES.dark.text, stale: "#f5c04a", lost: "#ff9d7a" },
  light: { fresh: SHADES.light.text, stale: "#8a5d00", lost: "#a83c00" },
} as const;
export const HALOS = { dark: SHADES.dark.halo, light: SHADES.light.halo };
export const TRAILS = { dark: SHADES.dark.trail, light: SHADES.light.trail };
export const GRIDS = { dark: { minor: SHADES.dark.grid, major: SHADES.dark.major }, light: { minor: SHADES.light.grid, major: SHADES.light.major } };
export const FIGURES = { dark: SHADES.dark.gridText, light: SHADES.light.gridText };

export const FONT = ["Noto Sans Regular"];

export function layers(theme: Theme): LayerSpecification[] {
  const shade = SHADES[theme];
  const kind = (name: string) => ["==", ["get", "kind"], name];
  return [
    { id: "ground", type: "background", paint: { "background-color": shade.ground } },
    { id: "outdoor", source: "plan", type: "line", filter: kind("outdoor"), paint: { "line-color": shade.grid, "line-dasharray": [4, 3] } },
    { id: "obstacles", source: "plan", type: "fill", filter: kind("obstacle"), paint: { "fill-color": shade.obstacle, "fill-outline-color": shade.stairs } },
    { id: "rooms", source: "plan", type: "fill", filter: kind("room"), paint: { "fill-color": shade.room, "fill-opacity": 0.92 } },
    { id: "mapped", source: "mapped", type: "fill", paint: { "fill-antialias": false, "fill-color": ["match", ["get", "kind"], "wall", "#cc79a7", "#009e73"], "fill-opacity": ["match", ["get", "kind"], "seen", 0.18, ["interpolate", ["linear"], ["get", "sigma_m"], 0.3, 0.5, 3, 0.2]] } },
    { id: "room-edges", source: "plan", type: "line", filter: kind("room"), paint: { "line-color": shade.wall, "line-opacity": 0.25, "line-width": 1 } },
    { id: "stairs", source: "plan", type: "line", filter: kind("stairs"), paint: { "line-color": shade.stairs, "line-width": ["interpolate", ["exponential", 2], ["zoom"], 16, 2, 22, 60], "line-dasharray": [0.12, 0.12], "line-opacity": 0.7 } },
    { id: "walls", source: "plan", type: "line", filter: kind("wall"), layout: { "line-cap": "square" }, paint: { "line-color": shade.wall, "line-width": ["interpolate", ["linear"], ["zoom"], 15, 1, 20, 3] } },
    { id: "lifts", source: "plan", type: "circle", filter: kind("lift"), paint: { "circle-radius": 7, "circle-color": shade.room, "circle-stroke-color": shade.wall, "circle-stroke-width": 2 } },
    { id: "plan-names", source: "plan", type: "symbol", minzoom: 18.2, filter: ["any", kind("room"), kind("place"), kind("stairs"), kind("lift")], layout: { "text-field": ["coalesce", ["get", "name"], ""], "text-font": FONT, "text-size": 11 }, paint: { "text-color": shade.gridText, "text-halo-color": shade.halo, "text-halo-width": 1 } },
  ] as LayerSpecification[];
}

/** Layers of a source that holds nothing are hidden, or its empty tiles would have the map drawn again and again. */
export function showLayers(map: MapLibre, source: string, visible: boolean): void {
  for (const each of layers("dark")) if ("source" in each && each.source === source) map.setLayoutProperty(each.id, "visibility", visible ? "visible" : "none");
}
