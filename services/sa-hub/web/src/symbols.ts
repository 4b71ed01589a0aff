// MIL-STD-2525 symbols of dismounted soldiers and of things seen, drawn by milsymbol onto the map's images.

import type { Map as MapLibre } from "maplibre-gl";
import ms from "milsymbol";
import type { Soldier, TrackState } from "./types.ts";

const PIXELS = Math.min(2, Math.max(1, window.devicePixelRatio));

/** Entities of symbol set 27 (dismounted individual) by role; a plain rifleman for what is not known. */
const ENTITY: Record<string, string> = {
  rifleman: "110301",
  squad_leader: "110220",
  team_leader: "110221",
  platoon_leader: "110220",
  company_leader: "110220",
  medic: "110212",
  radio_operator: "110213",
  machine_gunner: "110305",
  gunner: "110305",
  grenadier: "110309",
  marksman: "110211",
  sniper: "110209",
  scout: "110214",
};

/** Land symbols of observed things: affiliation (6 hostile, 4 neutral, 1 unknown, 3 friend), set and entity. */
const SEEN: Record<string, [affiliation: string, set: string, entity: string]> = {
  infantry: ["6", "10", "121100"],
  vehicle: ["6", "15", "160100"],
  armour: ["6", "10", "120500"],
  artillery: ["6", "10", "130300"],
  aircraft: ["6", "01", "110000"],
  drone: ["6", "01", "110300"],
  sniper: ["6", "27", "110209"],
  ied: ["6", "15", "210300"],
  mine: ["6", "15", "210100"],
  civilian: ["4", "11", "110000"],
  casualty: ["3", "27", "110212"],
};

/** Marks of plain places, drawn as letters in a square: there is no symbol that everybody reads. */
const LETTERS: Record<string, string> = {
  obstacle: "✕",
  rally_point: "RP",
  landing_zone: "LZ",
  supply: "SUP",
  entrance: "ENT",
  building: "BLD",
  route: "RTE",
};

const FRIEND: Record<TrackState, string> = { fresh: "#80c8ff", stale: "#f5c04a", lost: "#ff9d7a" };

export function sidc(soldier: Soldier): string {
  if (soldier.role === "command_post") return "10031002000000000000";
  return `10032700001${(ENTITY[soldier.role] ?? ENTITY.rifleman!).slice(1)}0000`;
}

/** The name of the map's image of a soldier in a state; drawn once for all of the same role. */
export function soldierIcon(map: MapLibre, soldier: Soldier, state: TrackState, selected: boolean): string {
  const name = `soldier:${soldier.role}:${state}:${selected ? 1 : 0}`;
  if (!map.hasImage(name)) {
    const options = { size: 26, fillColor: FRIEND[state], outlineColor: selected ? "#ffffff" : "#0b1118", outlineWidth: selected ? 7 : 3 };
    add(map, name, symbolCanvas(sidc(soldier), options));
  }
  return name;
}

export function observationIcon(map: MapLibre, code: string | null): string {
  const name = `seen:${code ?? "text"}`;
  if (!map.hasImage(name)) add(map, name, observationCanvas(code, 24));
  return name;
}

/** The image of a unit of another system, by its affiliation. */
export function foreignIcon(map: MapLibre, affiliation: string): string {
  const name = `foreign:${affiliation}`;
  const digit = { friend: "3", hostile: "6", neutral: "4" }[affiliation] ?? "1";
  if (!map.hasImage(name)) add(map, name, symbolCanvas(`100${digit}10000000000000`, { size: 22, outlineColor: "#0b1118", outlineWidth: 3 }));
  return name;
}

export function observationCanvas(code: string | null, size: number): HTMLCanvasElement {
  const known = code === null ? undefined : SEEN[code];
  if (known) return symbolCanvas(`100${known[0]}${known[1]}0000${known[2]}0000`, { size, outlineColor: "#0b1118", outlineWidth: 3 });
  return letterCanvas(code === null ? "i" : (LETTERS[code] ?? "?"), size);
}

export function soldierCanvas(soldier: Soldier, state: TrackState, size: number): HTMLCanvasElement {
  return symbolCanvas(sidc(soldier), { size, fillColor: FRIEND[state], outlineColor: "#0b1118", outlineWidth: 3 });
}

/** A triangle that points up, for headings. */
export function addArrow(map: MapLibre, name: string, colour: string): void {
  const [canvas, pen] = blank(18, 60);
  pen.beginPath();
  pen.moveTo(9, 1);
  pen.lineTo(16, 13);
  pen.lineTo(9, 10);
  pen.lineTo(2, 13);
  pen.closePath();
  pen.fillStyle = colour;
  pen.strokeStyle = "#0b1118";
  pen.lineWidth = 1.5;
  pen.fill();
  pen.stroke();
  add(map, name, canvas);
}

function symbolCanvas(code: string, options: Record<string, unknown>): HTMLCanvasElement {
  const size = Number(options.size) * PIXELS;
  return new ms.Symbol(code, { ...options, size }).asCanvas() as HTMLCanvasElement;
}

function letterCanvas(text: string, size: number): HTMLCanvasElement {
  const side = Math.max(size * 1.3, text.length * size * 0.55);
  const [canvas, pen] = blank(side, size * 1.2);
  pen.fillStyle = "#ffe58a";
  pen.strokeStyle = "#0b1118";
  pen.lineWidth = 2;
  pen.beginPath();
  pen.roundRect(1, 1, side - 2, size * 1.2 - 2, 4);
  pen.fill();
  pen.stroke();
  pen.fillStyle = "#0b1118";
  pen.font = `700 ${size * 0.6}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, side / 2, size * 0.64);
  return canvas;
}

function blank(width: number, height: number): [HTMLCanvasElement, CanvasRenderingContext2D] {
  const canvas = document.createElement("canvas");
  canvas.width = Math.ceil(width * PIXELS);
  canvas.height = Math.ceil(height * PIXELS);
  const pen = canvas.getContext("2d")!;
  pen.scale(PIXELS, PIXELS);
  return [canvas, pen];
}

function add(map: MapLibre, name: string, canvas: HTMLCanvasElement): void {
  const pixels = canvas.getContext("2d")!.getImageData(0, 0, canvas.width, canvas.height);
  map.addImage(name, pixels, { pixelRatio: PIXELS });
}
