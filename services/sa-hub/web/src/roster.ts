// The roster: everybody by unit, with state in words, mode, how far to rely on it, floor, status and battery.

import { reliability, speedOf } from "./display.ts";
import type { Seen, State } from "./state.ts";
import { soldierCanvas } from "./symbols.ts";
import type { Soldier } from "./types.ts";
import { at, h } from "./ui.ts";

interface Row {
  root: HTMLElement;
  name: HTMLElement;
  age: HTMLElement;
  line: HTMLElement;
  tail: HTMLElement;
  symbol: HTMLElement;
  drawn: string;
}

const MODES: Record<string, string> = { gnss: "GNSS", boots: "boots", body: "body unit", camera: "camera", coasting: "coasting", lost: "lost", unplaced: "no place yet" };

export class Roster {
  private readonly state: State;
  private readonly rows = new Map<string, Row>();
  private readonly inView = new Set<Element>();
  private readonly watcher = new IntersectionObserver((entries) => {
    for (const each of entries) each.isIntersecting ? this.inView.add(each.target) : this.inView.delete(each.target);
  });
  private readonly list = h("div", { class: "rows" });
  private readonly summary = h("div", { class: "summary" });
  private readonly search = h("input", { type: "search", placeholder: "Find (/)", "aria-label": "Find a soldier", id: "find" });

  constructor(state: State, onSelect: (soldier: string) => void) {
    this.state = state;
    at("left").append(h("div", { class: "head" }, this.summary, this.search), this.list);
    let unit = "";
    for (const soldier of [...state.roster.values()].sort((a, b) => a.unit.localeCompare(b.unit) || a.number - b.number)) {
      if (soldier.unit !== unit) this.list.append(h("h3", {}, (unit = soldier.unit)));
      this.list.append(this.addRow(soldier, onSelect).root);
    }
    this.search.addEventListener("input", () => this.draw());
  }

  draw(): void {
    const seen = new Map(this.state.seen().map((each) => [each.track.soldier, each]));
    const wanted = this.search.value.trim().toLowerCase();
    const counts = { fresh: 0, stale: 0, lost: 0, never: 0 };
    for (const [id, row] of this.rows) {
      const found = seen.get(id);
      if (found || id !== this.state.post.soldier) counts[found ? found.shown.state : "never"]++;
      const soldier = this.state.roster.get(id)!;
      const hidden = wanted !== "" && !`${soldier.callsign} ${id} ${soldier.unit}`.toLowerCase().includes(wanted);
      if (row.root.hidden !== hidden) row.root.hidden = hidden;
      if (this.inView.has(row.root) || row.drawn === "") this.drawRow(row, soldier, found);
    }
    this.summary.textContent = `${counts.fresh} fresh · ${counts.stale} silent · ${counts.lost} lost${counts.never ? ` · ${counts.never} never heard` : ""}`;
  }

  private addRow(soldier: Soldier, onSelect: (soldier: string) => void): Row {
    const [name, age, symbol] = [h("b", {}, soldier.callsign), h("span", { class: "age" }), h("span", { class: "symbol" })];
    const [line, tail] = [h("small", {}), h("small", { class: "tail" })];
    const root = h("button", { class: "row", "data-soldier": soldier.soldier, onclick: () => onSelect(soldier.soldier) },
      symbol, h("span", { class: "who" }, h("span", { class: "first" }, name, age), h("span", { class: "second" }, line, tail)));
    const row = { root, name, age, line, tail, symbol, drawn: "" };
    this.watcher.observe(root);
    this.rows.set(soldier.soldier, row);
    return row;
  }

  private drawRow(row: Row, soldier: Soldier, seen: Seen | undefined): void {
    const state = seen?.shown.state ?? "never";
    const condition = seen?.status && seen.status.condition !== "ok" ? seen.status.condition : "";
    set(row.age, seen ? seen.shown.words : soldier.soldier === this.state.post.soldier ? "this post" : "never heard");
    set(row.line, seen ? lineOf(seen, condition) : soldier.role.replaceAll("_", " "));
    set(row.tail, seen ? tailOf(seen) : "");
    const classes = `row ${state}${this.state.selected === soldier.soldier ? " selected" : ""}${condition ? " hurt" : ""}`;
    if (row.root.className !== classes) row.root.className = classes;
    if (row.drawn !== state) {
      row.drawn = state;
      row.symbol.replaceChildren(soldierCanvas(soldier, seen?.shown.state ?? "fresh", 19));
    }
  }
}

function lineOf({ track, shown }: Seen, condition: string): string {
  const trust = reliability(track.mode, shown.radius_95_m);
  return [
    condition.toUpperCase(),
    MODES[track.mode] ?? track.mode,
    trust === "none" ? "" : `${trust} ±${shown.radius_95_m < 10 ? shown.radius_95_m.toFixed(1) : shown.radius_95_m.toFixed(0)} m`,
    speedOf(track) < 0.3 ? "" : `${speedOf(track).toFixed(1)} m/s`,
  ].filter(Boolean).join(" · ");
}

/** What is never cut off: floor and battery. */
function tailOf({ track, status }: Seen): string {
  const battery = status?.battery_pct ?? null;
  return [track.floor === null ? "" : `⌂${track.floor}`, battery === null ? "" : `▮${battery.toFixed(0)} %`].filter(Boolean).join(" ");
}

function set(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}
