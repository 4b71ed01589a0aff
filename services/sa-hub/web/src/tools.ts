// Tools on the map: place an observation, sight one by bearing and range, fix a soldier, measure.

import type { MapMouseEvent } from "maplibre-gl";
import { azimuth_deg, circle, distance_m } from "./geo.ts";
import { icon } from "./icons.ts";
import { post, Refusal } from "./link.ts";
import type { SquadMap } from "./map.ts";
import { mgrs } from "./mgrs.ts";
import type { State, Tool } from "./state.ts";
import type { Place } from "./types.ts";
import { ask, at, h, toast, type Field } from "./ui.ts";

const TOOLS: [Tool | "alert" | "fit" | "trails", string, string][] = [
  ["select", "Select", "Esc"],
  ["observe", "Observation at a place", "O"],
  ["bearing", "Observation by bearing from the selected soldier", "B"],
  ["fix", "Say where the selected soldier is", "X"],
  ["measure", "Measure", "M"],
  ["alert", "Alert everybody", "L"],
  ["trails", "Trails on or off", "T"],
  ["fit", "Show everybody", "F"],
];
const OPERATING = new Set(["observe", "fix", "alert"]);

export class Tools {
  private readonly state: State;
  private readonly map: SquadMap;
  private readonly buttons = new Map<string, HTMLElement>();
  private points: Place[] = [];

  constructor(state: State, map: SquadMap) {
    this.state = state;
    this.map = map;
    for (const [tool, name, key] of TOOLS) {
      if (OPERATING.has(tool) && !state.mayOperate) continue;
      const button = h("button", { title: `${name} (${key})`, "aria-label": name, "data-tool": tool, onclick: () => this.choose(tool) }, icon(tool));
      this.buttons.set(tool, button);
      at("tools").append(button);
    }
    map.map.on("mousemove", (event: MapMouseEvent) => this.moved([event.lngLat.lng, event.lngLat.lat]));
    this.choose("select");
  }

  choose(tool: Tool | "alert" | "fit" | "trails"): void {
    if (OPERATING.has(tool) && !this.state.mayOperate) return;
    if (tool === "alert") return void this.alert();
    if (tool === "fit") return this.map.fit();
    if (tool === "trails") {
      this.state.trailsOn = !this.state.trailsOn;
      this.buttons.get("trails")!.classList.toggle("on", this.state.trailsOn);
      return this.map.draw();
    }
    if ((tool === "bearing" || tool === "fix") && this.state.selected === null) return toast("Select a soldier first", true);
    this.state.tool = tool;
    this.points = [];
    this.draft();
    for (const [name, button] of this.buttons) if (name !== "trails") button.classList.toggle("on", name === tool);
    this.buttons.get("trails")!.classList.toggle("on", this.state.trailsOn);
    this.drawHint();
    this.map.map.getCanvas().style.cursor = tool === "select" ? "" : "crosshair";
  }

  /** A click on the map; whether a tool took it. */
  click(place: Place): boolean {
    const tool = this.state.tool;
    if (tool === "select") return false;
    if (tool === "measure") {
      this.points = this.points.length >= 8 ? [place] : [...this.points, place];
      this.draft();
    } else {
      this.choose("select"); // at once: another tool may be chosen while this one's answer is awaited
      void this.place(tool, place);
    }
    return true;
  }

  private async place(tool: Tool, place: Place): Promise<void> {
    if (tool === "observe") await this.observe(place);
    else if (tool === "bearing") await this.sight(place);
    else await this.fix(place);
  }

  private moved(place: Place): void {
    if (this.state.tool === "measure" && this.points.length) this.draft(place);
    if (this.state.tool === "bearing") this.draft(place);
  }

  private draft(pointer?: Place): void {
    const start = this.state.tool === "bearing" ? this.selectedPlace() : null;
    const points = [...(start ? [start] : this.points), ...(pointer ? [pointer] : [])];
    const total = points.slice(1).reduce((sum, each, index) => sum + distance_m(points[index]!, each), 0);
    const text = points.length > 1 ? legend(points.at(-2)!, points.at(-1)!, total) : "";
    this.map.drawDraft({ places: points, ring: false, text });
  }

  private async observe(place: Place): Promise<void> {
    this.map.drawDraft({ places: circle(place, 10), ring: true, text: "" });
    const asked = await ask("Observation", [...this.what(), { name: "accuracy_m", label: "Accuracy, m (1 σ)", value: 10, kind: "number" }], "Send", mgrs(place));
    this.draft();
    if (!asked) return;
    await this.send("observations", { longitude_deg: place[0], latitude_deg: place[1], accuracy_m: Number(asked.accuracy_m), text: asked.text, code: asked.code || null }, "Observation sent");
  }

  private async sight(place: Place): Promise<void> {
    const [soldier, start] = [this.state.selected, this.selectedPlace()];
    if (soldier === null || start === null) return;
    const asked = await ask(`Seen by ${this.state.callsign(soldier)}`, [
      ...this.what(),
      { name: "azimuth_deg", label: "Bearing, ° true", value: azimuth_deg(start, place).toFixed(1), kind: "number" },
      { name: "range_m", label: "Range, m", value: distance_m(start, place).toFixed(0), kind: "number" },
    ], "Send");
    if (!asked) return;
    await this.send("sightings", { soldier, azimuth_deg: Number(asked.azimuth_deg), range_m: Number(asked.range_m), text: asked.text, code: asked.code || null }, "Observation sent");
  }

  private async fix(place: Place): Promise<void> {
    const soldier = this.state.selected;
    if (soldier === null) return;
    const asked = await ask(`${this.state.callsign(soldier)} is here`, [
      { name: "accuracy_m", label: "Accuracy, m (1 σ)", value: 5, kind: "number" },
      { name: "azimuth_deg", label: "Faces, ° true (empty: not known)", value: "", kind: "number" },
    ], "Fix", mgrs(place));
    if (!asked) return;
    const body = { soldier, longitude_deg: place[0], latitude_deg: place[1], accuracy_m: Number(asked.accuracy_m), azimuth_deg: asked.azimuth_deg === "" ? null : Number(asked.azimuth_deg) };
    const done = await this.send<{ told: boolean }>("fixes", body, "");
    if (done) toast(done.told ? "Their own computer has been told" : "Shown and relayed from here: fixes do not travel by radio");
  }

  private async alert(): Promise<void> {
    const kinds = this.state.post.alert_kinds.map((each): [string, string] => [each, each]);
    const asked = await ask("Alert everybody", [{ name: "kind", label: "What", options: kinds }, { name: "text", label: "Text" }], "Send alert");
    if (asked) await this.send("alerts", asked, "Alert sent");
  }

  private what(): Field[] {
    const codes = this.state.post.codes.map((each): [string, string] => [each, each.replaceAll("_", " ")]);
    return [{ name: "code", label: "What", options: [...codes, ["", "by text only"]] }, { name: "text", label: "Text" }];
  }

  private async send<T>(path: string, body: unknown, done: string): Promise<T | null> {
    try {
      const answer = await post<T>(path, body);
      if (done) toast(done);
      return answer;
    } catch (error) {
      toast(error instanceof Refusal ? error.message : "the hub cannot be reached", true);
      return null;
    }
  }

  private selectedPlace(): Place | null {
    return this.state.seen().find((each) => each.track.soldier === this.state.selected)?.shown.place ?? null;
  }

  /** What to do now, and a way out for fingers. */
  private drawHint(): void {
    const text = this.hint();
    at("hint").replaceChildren(...(text ? [text, h("button", { onclick: () => this.choose("select") }, "Leave (Esc)")] : []));
  }

  private hint(): string {
    const name = this.state.selected === null ? "" : this.state.callsign(this.state.selected);
    const hints: Record<Tool, string> = {
      select: "",
      observe: "Click where the thing is",
      bearing: `Click the direction and distance from ${name}`,
      fix: `Click where ${name} is`,
      measure: "Click from point to point",
    };
    return hints[this.state.tool];
  }
}

function legend(from: Place, to: Place, total_m: number): string {
  const leg = distance_m(from, to);
  const metres = (value: number) => (value < 1000 ? `${value.toFixed(1)} m` : `${(value / 1000).toFixed(2)} km`);
  const sum = total_m > leg + 0.01 ? ` · Σ ${metres(total_m)}` : "";
  return `${metres(leg)} · ${azimuth_deg(from, to).toFixed(1)}° · ${((azimuth_deg(from, to) * 6400) / 360).toFixed(0)} mil${sum}`;
}
