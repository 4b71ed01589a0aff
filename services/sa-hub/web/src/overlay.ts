// A canvas over the map with the grid and everything that moves. The map below is drawn only when somebody moves it:
// to draw it for each report, its symbols' layout and all, takes a computer without graphics hardware a second.

import { View } from "./view.ts";
import { place, type Side, type Wish } from "./labels.ts";
import { FIGURES, GRIDS, HALOS, TEXTS, TRAILS, type Theme } from "./layers.ts";
import type { Line, Mark, Trail } from "./marks.ts";
import { PIXELS } from "./symbols.ts";
import type { Place } from "./types.ts";

const FAMILY = 'system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';
const [FONT, BOLD] = [`13px ${FAMILY}`, `bold 13.5px ${FAMILY}`];
const LINE_PX = 16;
const FAR_PX = 80;
const FINE_PX = 1.5;
const TOUCH_PX = 22;
const DASHES = [6, 4];
const DRAFT = "#f0e442";
type Point = [x: number, y: number];

/** What was drawn of a mark the last time: where, and whether its label found room. */
export interface Drawn {
  mark: Mark;
  at: Point;
  label: boolean;
}

/** A line from place to place that a tool draws, with points unless it is a ring, and a text at its end. */
export interface Draft {
  places: Place[];
  ring: boolean;
  text: string;
}

export interface GridDrawing {
  lines: { points: Place[]; major: boolean }[];
  figures: { text: string; at: Point }[];
}

export class Overlay {
  readonly canvas: HTMLCanvasElement;
  /** What stands on the screen, by id; the topmost first. */
  drawn = new Map<string, Drawn>();
  theme: Theme;
  private readonly pen: CanvasRenderingContext2D;
  private readonly widths = new Map<string, number>();
  private sides = new Map<string, Side>();
  private view = new View([0, 0], 0, 1, 1);

  /** `bySoftware`: there is no graphics hardware, which would only be imitated for this canvas too. */
  constructor(theme: Theme, bySoftware: boolean) {
    this.theme = theme;
    this.canvas = document.createElement("canvas");
    this.canvas.className = "overlay";
    this.pen = this.canvas.getContext("2d", { willReadFrequently: bySoftware })!;
  }

  draw(view: View, marks: Mark[], trails: Trail[], grid: GridDrawing, draft: Draft): void {
    this.view = view;
    this.clear();
    for (const major of [false, true]) this.grid(grid.lines.filter((each) => each.major === major), major);
    for (const each of trails) this.trail(each);
    const near = marks.map((mark): Drawn => ({ mark, at: view.toScreen(mark.place), label: false })).filter((each) => this.matters(each));
    for (const each of near) this.ground(each);
    for (const each of trails) this.climbs(each);
    this.edges(grid.figures);
    const shown = near.filter((each) => view.isNear(each.at, FAR_PX));
    for (const each of [...shown].reverse()) this.symbol(each);
    this.labels(shown);
    this.pen.globalAlpha = 1;
    this.draft(draft);
    this.drawn = new Map(shown.map((each) => [each.mark.id, each]));
  }

  /** The id of the symbol at a point, or nearest to it within a finger's breadth. */
  pick([x, y]: Point, among: (id: string) => boolean): string | null {
    let [found, least]: [string | null, number] = [null, TOUCH_PX];
    for (const { mark, at } of this.drawn.values()) {
      const apart = Math.hypot(at[0] - x, at[1] - y);
      if (apart < least && among(mark.id)) [found, least] = [mark.id, apart];
    }
    return found;
  }

  private clear(): void {
    const { width, height } = this.view;
    const [w, h] = [Math.round(width * PIXELS), Math.round(height * PIXELS)];
    if (this.canvas.width !== w || this.canvas.height !== h) [this.canvas.width, this.canvas.height] = [w, h];
    this.pen.setTransform(PIXELS, 0, 0, PIXELS, 0, 0);
    this.pen.clearRect(0, 0, width, height);
    this.pen.textBaseline = "middle";
    this.pen.lineCap = this.pen.lineJoin = "round";
  }

  /** Whether anything of a mark can be on the screen: its circle or line may be where its symbol is not. */
  private matters({ mark, at }: Drawn): boolean {
    const reach = mark.radius_m === null ? 0 : mark.radius_m * this.view.pixelsPerMetre(mark.place[1]);
    return this.view.isNear(at, FAR_PX + reach) || mark.since !== null;
  }

  private grid(lines: GridDrawing["lines"], major: boolean): void {
    this.pen.beginPath();
    for (const { points } of lines) {
      points.forEach((each, index) => (index === 0 ? this.pen.moveTo(...this.view.toScreen(each)) : this.pen.lineTo(...this.view.toScreen(each))));
    }
    this.stroke(GRIDS[this.theme][major ? "major" : "minor"], major ? 1.4 : 0.8, 1);
  }

  private trail({ pieces, selected }: Trail): void {
    const { pen, view } = this;
    for (const { places, freshness } of pieces) {
      pen.beginPath();
      let last: Point | null = null;
      for (const each of places) {
        const point = view.toScreen(each);
        if (last === null) pen.moveTo(...point);
        else if (Math.hypot(point[0] - last[0], point[1] - last[1]) < FINE_PX) continue;
        else pen.lineTo(...point);
        last = point;
      }
      this.stroke(TRAILS[this.theme], selected ? 3 : 1.8, (selected ? 0.9 : 0.55) * freshness);
    }
  }

  /** Where somebody came to another floor. */
  private climbs({ climbs, selected }: Trail): void {
    this.pen.textAlign = "center";
    this.pen.globalAlpha = selected ? 1 : 0.6;
    for (const { place: where, text } of climbs) this.text({ text, colour: TRAILS[this.theme], bold: true }, ...this.view.toScreen(where));
  }

  /** What of a mark lies on the ground: its circle, and lines to where it was and will be. */
  private ground({ mark, at }: Drawn): void {
    const { pen, view } = this;
    if (mark.radius_m !== null) {
      pen.beginPath();
      pen.arc(...at, mark.radius_m * view.pixelsPerMetre(mark.place[1]), 0, 2 * Math.PI);
      pen.globalAlpha = 0.09 * mark.opacity * this.share(mark);
      pen.fillStyle = mark.colour;
      pen.fill();
      this.stroke(mark.colour, 1.3, 0.75 * mark.opacity);
    }
    if (mark.since) this.line(view.toScreen(mark.since), at, mark, 1.6, DASHES);
    if (mark.ahead) this.line(at, view.toScreen(mark.ahead), mark, 2.2);
  }

  /** Of its tint that a circle is given: one as large as the screen would only dye the map. */
  private share(mark: Mark): number {
    const radius = (mark.radius_m ?? 0) * this.view.pixelsPerMetre(mark.place[1]);
    const half = Math.min(this.view.width, this.view.height) / 2;
    return Math.max(0, 1 - radius / half);
  }

  private line(from: Point, to: Point, mark: Mark, width: number, dashes: number[] = []): void {
    this.pen.beginPath();
    this.pen.moveTo(...from);
    this.pen.lineTo(...to);
    this.pen.setLineDash(dashes);
    this.stroke(mark.colour, width, 0.8 * mark.opacity);
    this.pen.setLineDash([]);
  }

  private stroke(colour: string, width: number, opacity: number): void {
    this.pen.globalAlpha = opacity;
    this.pen.strokeStyle = colour;
    this.pen.lineWidth = width;
    this.pen.stroke();
  }

  private symbol({ mark, at }: Drawn): void {
    const { picture, width, height, anchor } = mark.symbol;
    this.pen.globalAlpha = mark.opacity;
    this.pen.drawImage(picture, at[0] - anchor[0], at[1] - anchor[1], width, height);
    if (mark.course !== null) this.arrow(at, (mark.course * Math.PI) / 180, mark);
  }

  /** A head outside of the symbol that points where the soldier goes. */
  private arrow([x, y]: Point, azimuth: number, mark: Mark): void {
    const { pen } = this;
    const [sine, cosine, reach] = [Math.sin(azimuth), Math.cos(azimuth), mark.symbol.height / 2 + 13];
    const to = (aside: number, ahead: number): Point => [x + aside * cosine + ahead * sine, y + aside * sine - ahead * cosine];
    pen.beginPath();
    pen.moveTo(...to(0, reach));
    pen.lineTo(...to(7, reach - 12));
    pen.lineTo(...to(0, reach - 9));
    pen.lineTo(...to(-7, reach - 12));
    pen.closePath();
    pen.fillStyle = mark.colour;
    pen.fill();
    this.stroke(HALOS[this.theme], 1.2, mark.opacity);
  }

  /** What a tool is about to place, over everything. */
  private draft({ places, ring, text }: Draft): void {
    if (places.length === 0) return;
    const { pen, view } = this;
    const points = places.map((each) => view.toScreen(each));
    pen.beginPath();
    for (const each of points) pen.lineTo(...each);
    pen.setLineDash(DASHES);
    this.stroke(DRAFT, 2.5, 1);
    pen.setLineDash([]);
    for (const [x, y] of ring ? [] : points) {
      pen.beginPath();
      pen.arc(x, y, 6, 0, 2 * Math.PI);
      pen.fillStyle = DRAFT;
      pen.fill();
      this.stroke("#0b1118", 2, 1);
    }
    const [x, y] = points.at(-1)!;
    pen.textAlign = "center";
    if (text) this.text({ text, colour: TEXTS[this.theme].fresh, bold: true }, x, y - 20);
  }

  private labels(shown: Drawn[]): void {
    const named = shown.filter((each) => each.mark.label.length > 0);
    const placed = place(named.map((each) => this.wish(each)), this.sides);
    this.sides = new Map([...placed].map(([id, { side }]) => [id, side]));
    for (const each of named) {
      const found = placed.get(each.mark.id);
      if (!found) continue;
      each.label = true;
      this.pen.globalAlpha = each.mark.labelOpacity;
      this.pen.textAlign = found.side === "left" ? "right" : found.side === "right" ? "left" : "center";
      const x = found.box.x + found.box.width * { left: 1, right: 0, above: 0.5, below: 0.5 }[found.side];
      each.mark.label.forEach((line, index) => this.text(line, x, found.box.y + LINE_PX * (index + 0.5)));
    }
  }

  private wish({ mark, at }: Drawn): Wish {
    const { width, height, anchor } = mark.symbol;
    return {
      id: mark.id,
      symbol: { x: at[0] - anchor[0], y: at[1] - anchor[1], width, height },
      width: Math.max(...mark.label.map((each) => this.widthOf(each))),
      height: LINE_PX * mark.label.length,
      must: mark.must,
    };
  }

  private widthOf({ text, bold }: Line): number {
    const kind = `${bold ? "bold " : ""}${text.replace(/\d/g, "0")}`; // counting seconds does not move a name
    let width = this.widths.get(kind);
    if (width === undefined) {
      this.pen.font = bold ? BOLD : FONT;
      this.widths.set(kind, (width = this.pen.measureText(text).width));
    }
    return width;
  }

  private text({ text, colour, bold }: Line, x: number, y: number): void {
    this.pen.font = bold ? BOLD : FONT;
    this.pen.lineWidth = 3;
    this.pen.strokeStyle = HALOS[this.theme];
    this.pen.strokeText(text, x, y);
    this.pen.fillStyle = colour;
    this.pen.fillText(text, x, y);
  }

  /** The grid's figures at the edges: they end where they are put. */
  private edges(edges: GridDrawing["figures"]): void {
    this.pen.globalAlpha = 0.8;
    this.pen.textAlign = "right";
    for (const { text, at } of edges) this.text({ text, colour: FIGURES[this.theme] }, ...at);
  }
}
