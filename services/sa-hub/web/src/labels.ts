// Names beside symbols: each where it covers no other name and, if it can be, no symbol; who matters most chooses first.

export interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface Wish {
  id: string;
  /** The symbol that the name belongs to. */
  symbol: Box;
  width: number;
  height: number;
  /** Drawn even where it covers something. */
  must: boolean;
}

export type Side = "right" | "left" | "below" | "above";

const SIDES: Side[] = ["right", "left", "below", "above"];
const GAP_PX = 4;
const CELL_PX = 96;

/** Boxes that are taken, found by the cells of a grid that they touch. */
class Taken {
  private readonly cells = new Map<string, Box[]>();

  add(box: Box): void {
    for (const cell of cellsOf(box)) {
      const boxes = this.cells.get(cell);
      if (boxes) boxes.push(box);
      else this.cells.set(cell, [box]);
    }
  }

  isFree(box: Box, except?: Box): boolean {
    for (const cell of cellsOf(box)) for (const each of this.cells.get(cell) ?? []) if (each !== except && overlap(each, box)) return false;
    return true;
  }
}

/** Where names go, by id, in order of wishes; one that finds no place is left out. `before`: sides of the last time. */
export function place(wishes: Wish[], before: Map<string, Side>): Map<string, { box: Box; side: Side }> {
  const [symbols, names] = [new Taken(), new Taken()];
  for (const each of wishes) symbols.add(each.symbol);
  const placed = new Map<string, { box: Box; side: Side }>();
  for (const wish of wishes) {
    const last = before.get(wish.id);
    const sides = last ? [last, ...SIDES.filter((each) => each !== last)] : SIDES;
    const boxes = sides.map((side) => ({ side, box: beside(wish, side) }));
    const free = boxes.filter(({ box }) => names.isFree(box));
    const found = free.find(({ box }) => symbols.isFree(box, wish.symbol)) ?? free[0] ?? (wish.must ? boxes[0] : undefined);
    if (!found) continue;
    names.add(found.box);
    placed.set(wish.id, found);
  }
  return placed;
}

function beside({ symbol, width, height }: Wish, side: Side): Box {
  const [middleX, middleY] = [symbol.x + (symbol.width - width) / 2, symbol.y + (symbol.height - height) / 2];
  if (side === "right") return { x: symbol.x + symbol.width + GAP_PX, y: middleY, width, height };
  if (side === "left") return { x: symbol.x - GAP_PX - width, y: middleY, width, height };
  if (side === "below") return { x: middleX, y: symbol.y + symbol.height + GAP_PX, width, height };
  return { x: middleX, y: symbol.y - GAP_PX - height, width, height };
}

function overlap(one: Box, other: Box): boolean {
  return one.x < other.x + other.width && other.x < one.x + one.width && one.y < other.y + other.height && other.y < one.y + one.height;
}

function* cellsOf({ x, y, width, height }: Box): Iterable<string> {
  for (let column = Math.floor(x / CELL_PX); column <= Math.floor((x + width) / CELL_PX); column++)
    for (let row = Math.floor(y / CELL_PX); row <= Math.floor((y + height) / CELL_PX); row++) yield `${column} ${row}`;
}
