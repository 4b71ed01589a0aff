// MIL-STD-2525 symbols of dismounted soldiers and of things seen, drawn by milsymbol onto small canvases.

import ms from "milsymbol";
import type { Soldier, TrackState } from "./types.ts";

/** Of a picture to a CSS pixel. */
export const PIXELS = Math.min(2, Math.max(1, window.devicePixelRatio));

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
  friendly: ["3", "10", "000000"],
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

/** A drawn symbol: its picture, its size in CSS pixels, and where in it the place is that it stands for. */
export interface Symbol {
  picture: HTMLCanvasElement;
  width: number;
  height: number;
  anchor: [x: number, y: number];
}

const drawn = new Map<string, Symbol>();

/** The symbol of a soldier in a state; drawn once for all of the same role. */
export function soldierSymbol(soldier: Soldier, state: TrackState, selected: boolean): Symbol {
  const options = { size: 26, fillColor: FRIEND[state], outlineColor: selected ? "#ffffff" : "#0b1118", outlineWidth: selected ? 7 : 3 };
  return once(`soldier:${soldier.role}:${state}:${selected}`, () => symbolOf(sidc(soldier), options));
}

/** The symbol of a thing seen. */
export function observationSymbol(code: string | null): Symbol {
  return once(`seen:${code}`, () => middled(observationCanvas(code, 24)));
}

/** The symbol of a unit of another system, by its affiliation. */
export function foreignSymbol(affiliation: string): Symbol {
  const digit = { friend: "3", hostile: "6", neutral: "4" }[affiliation] ?? "1";
  return once(`foreign:${digit}`, () => symbolOf(`100${digit}10000000000000`, { size: 22, outlineColor: "#0b1118", outlineWidth: 3 }));
}

function once(name: string, draw: () => Symbol): Symbol {
  const found = drawn.get(name) ?? draw();
  drawn.set(name, found);
  return found;
}

export function observationCanvas(code: string | null, size: number): HTMLCanvasElement {
  const known = code === null ? undefined : SEEN[code];
  if (known) return symbolCanvas(`100${known[0]}${known[1]}0000${known[2]}0000`, { size, outlineColor: "#0b1118", outlineWidth: 3 });
  return letterCanvas(code === null ? "i" : (LETTERS[code] ?? "?"), size);
}

export function soldierCanvas(soldier: Soldier, state: TrackState, size: number): HTMLCanvasElement {
  return symbolCanvas(sidc(soldier), { size, fillColor: FRIEND[state], outlineColor: "#0b1118", outlineWidth: 3 });
}

function symbolCanvas(code: string, options: Record<string, unknown>): HTMLCanvasElement {
  return milsymbol(code, options).asCanvas() as HTMLCanvasElement;
}

function symbolOf(code: string, options: Record<string, unknown>): Symbol {
  const symbol = milsymbol(code, options);
  const { x, y } = symbol.getAnchor();
  return { ...middled(symbol.asCanvas() as HTMLCanvasElement), anchor: [x / PIXELS, y / PIXELS] };
}

function middled(picture: HTMLCanvasElement): Symbol {
  const [width, height] = [picture.width / PIXELS, picture.height / PIXELS];
  return { picture, width, height, anchor: [width / 2, height / 2] };
}

function milsymbol(code: string, options: Record<string, unknown>) {
  return new ms.Symbol(code, { ...options, size: Number(options.size) * PIXELS });
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
