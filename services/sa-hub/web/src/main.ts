// The page's beginning: signs in if that is needed, builds the parts, and lets news, clock, clicks and keys drive them.

import { Alerts } from "./alerts.ts";
import { drawCard } from "./card.ts";
import { mgrs } from "./mgrs.ts";
import { icon } from "./icons.ts";
import type { Theme } from "./layers.ts";
import { get, listen, post, Refusal } from "./link.ts";
import { SquadMap } from "./map.ts";
import { floorsOf, withFloors } from "./plan.ts";
import { Rooms } from "./rooms.ts";
import { Roster } from "./roster.ts";
import { Side } from "./side.ts";
import { State, TRAIL_S } from "./state.ts";
import "./style.css";
import { Timeline } from "./timeline.ts";
import { Tools } from "./tools.ts";
import type { Post, Soldier } from "./types.ts";
import { ask, at, h, replaceIfNew, showKeys, toast } from "./ui.ts";

const CLOCK_MS = 250;
const MOST_MS = 1000;
const KEYS: [key: string, what: string][] = [
  ["1 … 9", "a floor, from the lowest up"], ["0", "all floors"],
  ["F", "show everybody"], ["C", "centre on the selected soldier"],
  ["G", "follow the selected soldier"], ["/", "find somebody"],
  ["O", "observation at a place"], ["B", "observation by bearing and range"],
  ["X", "say where the selected soldier is"], ["M", "measure"],
  ["L", "alert everybody"], ["A", "acknowledge the newest alert"],
  ["T", "trails on or off"], ["N", "day or night"],
  ["Space", "play or pause the past"], ["Home", "back to now"],
  ["Esc", "leave a tool, or the selection"], ["?", "these keys"],
];

const ROLES: Record<Post["role"], string> = { view: "looks on", operate: "operates", admin: "administers" };

async function signedIn(): Promise<Post> {
  for (;;) {
    try {
      return await get<Post>("post");
    } catch (error) {
      if (!(error instanceof Refusal) || error.status !== 401) throw error;
      const asked = await ask("bootprint", [{ name: "token", label: "Token", kind: "password" }], "Sign in", "This command post wants a token.");
      if (asked) await post("session", asked).catch((refused: Error) => toast(refused.message, true));
    }
  }
}

class Page {
  readonly state: State;
  readonly map: SquadMap;
  private readonly rooms: Rooms;
  private readonly roster: Roster;
  private readonly side: Side;
  private readonly alerts: Alerts;
  private readonly tools: Tools;
  private readonly timeline: Timeline;
  private theme: Theme = (localStorage.getItem("theme") as Theme | null) ?? "dark";
  private fitted = false;

  constructor(state: State) {
    this.state = state;
    document.documentElement.dataset.theme = this.theme;
    this.map = new SquadMap("map", state, this.theme);
    this.rooms = new Rooms(state, this.map);
    this.roster = new Roster(state, (soldier) => this.select(soldier, true));
    this.alerts = new Alerts(state, (soldier) => this.select(soldier, true));
    this.buildTop();
    this.side = new Side(state, { show: (place) => this.map.show(place, 19), select: (soldier) => this.select(soldier, true) });
    this.tools = new Tools(state, this.map);
    this.timeline = new Timeline(state, () => this.draw());
    this.bind();
    if (state.post.basemap !== null) void this.map.addBasemap(state.post.basemap).catch(() => toast("the basemap cannot be read", true));
  }

  async begin(): Promise<void> {
    if (this.state.post.has_plan) {
      this.map.plan = withFloors((await get<GeoJSON.FeatureCollection>("plan.geojson")).features);
    }
    if (this.state.post.has_history) void this.recall().catch(() => undefined); // trails are a convenience
    listen((news, whole) => {
      this.state.take(news, whole);
      void this.rooms.take(news).catch(() => undefined); // told again when it grows
      if (Object.keys(news.alerts).length) this.alerts.draw(); // these do not wait for the beat
    }, (line) => {
      this.state.line = line;
      this.drawTop();
    });
    this.beat();
  }

  /** Trails of the last minutes, which were told before this page was opened. */
  private async recall(): Promise<void> {
    const now_s = this.state.post.now_s;
    const past = await get<GeoJSON.FeatureCollection>(`history/trails.geojson?begin_s=${now_s - TRAIL_S}&end_s=${now_s}`);
    for (const each of past.features) this.state.recall(each);
  }

  /** Draw again and again, at a pace that leaves the greater part of the time for people's clicks. */
  private beat(): void {
    const began = performance.now();
    this.draw();
    const spent = performance.now() - began + this.map.spent_ms;
    setTimeout(() => this.beat(), Math.min(MOST_MS, Math.max(CLOCK_MS, 6 * spent)));
  }

  private draw(): void {
    this.state.look();
    this.map.draw();
    this.rooms.draw();
    if (!this.fitted && this.state.tracks.size > 0 && this.map.ready) {
      this.fitted = true;
      this.map.fit();
    }
    this.roster.draw();
    this.side.draw();
    this.alerts.draw();
    this.timeline.draw();
    this.drawFloors();
    this.drawTop();
    drawCard(this.state, {
      follow: () => this.follow(),
      centre: () => this.state.selected && this.map.centre(this.state.selected),
      fix: () => this.tools.choose("fix"),
      bearing: () => this.tools.choose("bearing"),
      close: () => this.select(null),
    });
  }

  private select(soldier: string | null, centre = false): void {
    this.state.selected = soldier;
    this.state.following = false;
    if (soldier !== null && centre) this.map.centre(soldier);
    this.draw();
  }

  private follow(): void {
    this.state.following = this.state.selected !== null && !this.state.following;
    this.draw();
  }

  private buildTop(): void {
    const post_ = this.state.post;
    at("top").append(
      h("b", { class: "brand" }, "bootprint"),
      h("span", { class: "realm" }, `${post_.realm} · ${this.state.callsign(post_.soldier)}`),
      h("span", { id: "line", role: "status" }),
      h("span", { class: "spring" }),
      h("span", { class: "realm" }, post_.who === "local" ? "" : `${post_.who} (${ROLES[post_.role]})`),
      h("button", { id: "roster-toggle", title: "Roster", onclick: () => document.body.classList.toggle("no-left") }, icon("roster")),
      h("button", { id: "side-toggle", title: "Radio and health", onclick: () => this.toggleSide() }, icon("side")),
      h("button", { id: "sound", title: "Sound of alerts", onclick: () => this.toggleSound() }, icon(this.alerts.sound ? "sound-on" : "sound-off")),
      h("button", { id: "theme", title: "Day or night (N)", onclick: () => this.toggleTheme() }, icon("theme")),
      h("button", { id: "keys", title: "Keys (?)", "aria-label": "Keys", onclick: () => showKeys(KEYS) }, icon("keys")),
    );
  }

  private drawTop(): void {
    const words = { connecting: "connecting …", live: "live", gone: "hub out of reach: the picture stands still" }[this.state.line];
    const text = this.state.past === null ? words : "looking back";
    const line = at("line");
    if (line.textContent !== text) line.textContent = text;
    line.className = this.state.past === null ? this.state.line : "past";
  }

  private drawFloors(): void {
    const floors = [...new Set([...floorsOf(this.map.plan), ...this.rooms.floors(), ...this.state.floorsInUse()])].sort((a, b) => b - a);
    const counts = new Map<number, number>();
    for (const each of this.state.seen()) if (each.track.floor !== null) counts.set(each.track.floor, (counts.get(each.track.floor) ?? 0) + 1);
    at("floors").hidden = floors.length === 0;
    const key = JSON.stringify([floors, [...counts], this.state.floor]);
    replaceIfNew(at("floors"), key, () => [
      h("button", { class: this.state.floor === null ? "on" : "", "data-floor": "all", title: "All floors (0)", onclick: () => this.chooseFloor(null) }, "all"),
      ...floors.map((each) => h("button", { class: this.state.floor === each ? "on" : "", "data-floor": each, onclick: () => this.chooseFloor(each) }, String(each), h("small", {}, counts.has(each) ? String(counts.get(each)) : ""))),
    ], floors.join());
  }

  private chooseFloor(floor: number | null): void {
    this.state.floor = floor;
    this.draw();
  }

  private toggleTheme(): void {
    this.theme = this.theme === "dark" ? "light" : "dark";
    localStorage.setItem("theme", this.theme);
    document.documentElement.dataset.theme = this.theme;
    this.map.setTheme(this.theme);
  }

  /** Where there is room the side is open until closed, on a tablet closed until opened. */
  private toggleSide(): void {
    for (const name of ["no-right", "show-right"]) document.body.classList.toggle(name);
  }

  private toggleSound(): void {
    at("sound").replaceChildren(icon(this.alerts.toggleSound() ? "sound-on" : "sound-off"));
  }

  private bind(): void {
    const map = this.map.map;
    map.on("click", (event) => {
      if (this.tools.click([event.lngLat.lng, event.lngLat.lat])) return;
      this.select(this.soldierAt(event.point));
    });
    map.on("dragstart", () => (this.state.following = false));
    map.on("mousemove", (event) => {
      at("readout").textContent = mgrs([event.lngLat.lng, event.lngLat.lat]);
      if (this.state.tool === "select") map.getCanvas().style.cursor = this.soldierAt(event.point) === null ? "" : "pointer";
    });
    document.addEventListener("keydown", (event) => this.key(event));
  }

  private soldierAt({ x, y }: { x: number; y: number }): string | null {
    return this.map.overlay.pick([x, y], (id) => this.state.tracks.has(id) || this.state.past?.tracks.has(id) === true);
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || target.closest("dialog") || (target.matches("input, select") && target.getAttribute("type") !== "range")) {
      if (event.key === "Escape") target.blur();
      return;
    }
    if (/^[0-9]$/.test(event.key)) return this.chooseFloor(event.key === "0" ? null : this.floorOfKey(Number(event.key)));
    const keys: Record<string, () => void> = {
      f: () => this.map.fit(), c: () => this.state.selected && this.map.centre(this.state.selected), g: () => this.follow(),
      o: () => this.tools.choose("observe"), b: () => this.tools.choose("bearing"), x: () => this.tools.choose("fix"), m: () => this.tools.choose("measure"),
      l: () => this.tools.choose("alert"), t: () => this.tools.choose("trails"), a: () => void this.alerts.acknowledge(), n: () => this.toggleTheme(),
      "/": () => at("find").focus(), " ": () => this.state.post.has_history && this.timeline.toggle(), home: () => this.timeline.live(),
      escape: () => (this.state.tool === "select" ? this.select(null) : this.tools.choose("select")), "?": () => showKeys(KEYS),
    };
    const action = keys[event.key.toLowerCase()];
    if (!action) return;
    event.preventDefault();
    action();
  }

  /** Key 1 is the lowest floor there is. */
  private floorOfKey(number: number): number | null {
    const floors = [...new Set([...floorsOf(this.map.plan), ...this.state.floorsInUse()])].sort((a, b) => a - b);
    return floors[number - 1] ?? null;
  }
}

async function main(): Promise<void> {
  try {
    const post_ = await signedIn();
    const page = new Page(new State(post_, await get<Soldier[]>("roster")));
    Object.assign(window, { bootprint: page }); // for browser tests, and for the curious at the console
    await page.begin();
  } catch (error) {
    toast(`The hub cannot be reached: ${(error as Error).message}`, true);
    throw error;
  }
}

void main();
