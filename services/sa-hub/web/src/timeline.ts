// The timeline: live, or back in the archive with play, seek and speed, on the same map.

import { duration } from "./display.ts";
import { icon } from "./icons.ts";
import { get } from "./link.ts";
import type { State } from "./state.ts";
import type { Alert, History, Picture } from "./types.ts";
import { ask, at, h, replaceIfNew } from "./ui.ts";

const STEP_MS = 200;
const LOOK_EVERY_S = 5;
const SPEEDS = [1, 2, 5, 10, 30, 60];

export class Timeline {
  private readonly state: State;
  private readonly onChange: () => void;
  private readonly slider = h("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": "Moment", id: "seek" });
  private readonly clock = h("output", { id: "clock" });
  private readonly playButton = h("button", { id: "play", title: "Play or pause (space)", "aria-label": "Play or pause" }, icon("play"));
  private readonly liveButton = h("button", { id: "live", title: "Back to now (Home)" }, "LIVE");
  private readonly marks = h("div", { class: "marks" });
  private readonly speed = h("select", { id: "speed", "aria-label": "Speed" }, ...SPEEDS.map((each) => h("option", { value: each }, `${each}×`)));
  private span: [number, number] | null = null;
  private asking = false;
  private wanted: number | null = null;

  constructor(state: State, onChange: () => void) {
    this.state = state;
    this.onChange = onChange;
    this.playButton.addEventListener("click", () => this.toggle());
    this.liveButton.addEventListener("click", () => this.live());
    this.slider.addEventListener("input", () => void this.seek(Number(this.slider.value)));
    const exporting = h("button", { id: "export", title: "Export", "aria-label": "Export", onclick: () => void this.export() }, icon("export"));
    const track = h("div", { class: "track" }, this.slider, this.marks);
    at("timeline").append(...(state.post.has_history ? [this.liveButton, this.playButton, track, this.speed, this.clock, exporting] : [this.clock]));
    at("timeline").classList.toggle("bare", !state.post.has_history);
    if (state.post.has_history) {
      void this.look();
      setInterval(() => void this.look(), 1000 * LOOK_EVERY_S);
      setInterval(() => this.play(), STEP_MS);
    }
  }

  draw(): void {
    const { past } = this.state;
    const words = past === null ? "" : `  (${duration(this.state.live_s - past.time_s)} ago)`;
    this.clock.textContent = new Date(1000 * this.state.now_s).toISOString().slice(0, 19).replace("T", " ") + "Z" + words;
    this.liveButton.classList.toggle("on", past === null);
    replaceIfNew(this.playButton, past?.playing ? "pause" : "play", () => [icon(past?.playing ? "pause" : "play")]);
    document.body.classList.toggle("past", past !== null);
    if (past === null && this.span) this.slider.value = String(this.span[1]);
  }

  toggle(): void {
    if (this.state.past === null) return void this.seek(this.span ? Math.max(this.span[0], this.span[1] - 60) : this.state.live_s - 60).then(() => this.toggle());
    this.state.past.playing = !this.state.past.playing;
    this.draw();
  }

  live(): void {
    this.state.past = null;
    this.onChange();
  }

  /** Look at a moment; while one answer is awaited only the newest wish is kept. */
  async seek(time_s: number): Promise<void> {
    this.wanted = time_s;
    if (this.asking) return;
    this.asking = true;
    try {
      while (this.wanted !== null) {
        const moment: number = this.wanted;
        this.wanted = null;
        const picture = await get<Picture>(`history/picture?time_s=${moment}`);
        const { playing = false } = this.state.past ?? {};
        this.state.past = { time_s: moment, tracks: new Map(Object.entries(picture.tracks)), playing, speed: Number(this.speed.value) };
      }
    } finally {
      this.asking = false;
    }
    this.onChange();
  }

  /** A file of the whole history, or of its last minutes, by the browser's own download. */
  private async export(): Promise<void> {
    if (!this.span) return;
    const formats = ["gpx", "kml", "geojson", "csv", "mcap"].map((each): [string, string] => [each, each.toUpperCase()]);
    const asked = await ask("Export", [{ name: "format", label: "Format", options: formats }, { name: "minutes", label: "Last minutes (empty: everything)", value: "", kind: "number" }], "Export");
    if (!asked) return;
    const begin = asked.minutes ? Math.max(this.span[0], this.span[1] - 60 * Number(asked.minutes)) : this.span[0];
    h("a", { href: `api/v1/history/export?format=${asked.format}&begin_s=${begin}&end_s=${this.span[1] + 1}`, download: "" }).click();
  }

  private play(): void {
    const { past } = this.state;
    if (!past?.playing || this.asking) return;
    const next = past.time_s + (Number(this.speed.value) * STEP_MS) / 1000;
    if (this.span && next >= this.span[1]) return this.live();
    this.slider.value = String(next);
    void this.seek(next);
  }

  private async look(): Promise<void> {
    const history = await get<History>("history").catch(() => null);
    if (!history?.begin_s || !history.end_s) return;
    this.span = [history.begin_s, history.end_s];
    this.slider.min = String(this.span[0]);
    this.slider.max = String(this.span[1]);
    const events = await get<Picture>(`history/events?begin_s=${this.span[0]}&end_s=${this.span[1] + 1}`).catch(() => null);
    if (events) this.mark(Object.values(events.alerts));
    this.draw();
  }

  private mark(alerts: Alert[]): void {
    const [begin, end] = this.span!;
    this.marks.replaceChildren(...alerts.map((each) => h("i", { title: `${each.kind} ${each.text}`, style: `left:${(100 * (each.time_s - begin)) / Math.max(1, end - begin)}%` })));
  }
}
