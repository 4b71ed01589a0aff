// The timeline: live, or back in the archive with play, seek and speed, on the same map.

import { duration } from "./display.ts";
import { icon } from "./icons.ts";
import { get, Refusal } from "./link.ts";
import { Recall } from "./recall.ts";
import type { State } from "./state.ts";
import type { Alert, History, Picture } from "./types.ts";
import { ask, at, h, replaceIfNew, toast } from "./ui.ts";

const STEP_MS = 200;
const MOST_STEP_S = 1; // of the host's time, where answers are slow
const WEEK_S = 7 * 86_400; // more is not told at once
const SURVEY_EVERY_S = 5;
const START_S = 60; // before now, where playing begins
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
  private visit = 0;
  private stepped_ms = 0;
  private wanted: number | null = null;
  private readonly recall: Recall;

  constructor(state: State, onChange: () => void) {
    this.state = state;
    this.recall = new Recall(state);
    this.onChange = onChange;
    this.playButton.addEventListener("click", () => this.toggle());
    this.liveButton.addEventListener("click", () => this.live());
    this.slider.addEventListener("input", () => void this.seek(Number(this.slider.value)));
    const exporting = h("button", { id: "export", title: "Export", "aria-label": "Export", onclick: () => void this.export() }, icon("export"));
    const track = h("div", { class: "track" }, this.slider, this.marks);
    at("timeline").append(...(state.post.has_history ? [this.liveButton, this.playButton, track, this.speed, this.clock, exporting] : [this.clock]));
    at("timeline").classList.toggle("bare", !state.post.has_history);
    if (state.post.has_history) {
      void this.survey();
      setInterval(() => void this.survey(), 1000 * SURVEY_EVERY_S);
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
    if (past === null && this.span && !this.asking) this.slider.value = String(this.span[1]);
  }

  toggle(): void {
    const { past } = this.state;
    if (past === null) return void this.seek(this.span ? Math.max(this.span[0], this.span[1] - START_S) : this.state.live_s - START_S, true);
    past.playing = !past.playing;
    this.draw();
  }

  live(): void {
    this.visit++; // an answer that is still awaited comes too late
    this.wanted = null;
    this.state.past = null;
    this.onChange();
  }

  /** Look at a moment; while one answer is awaited only the newest wish is kept. */
  async seek(time_s: number, playing = this.state.past?.playing ?? false): Promise<void> {
    this.wanted = time_s;
    if (this.asking) return;
    this.asking = true;
    try {
      while (this.wanted !== null) await this.look(this.wanted, playing);
    } catch (error) {
      if (this.state.past) this.state.past.playing = false; // or it would fail again at each beat
      toast(error instanceof Refusal ? error.message : "the hub cannot be reached", true);
    } finally {
      this.asking = false;
    }
    this.onChange();
  }

  private async look(moment: number, playing: boolean): Promise<void> {
    const visit = this.visit;
    this.wanted = null;
    const picture = await get<Picture>(`history/picture?time_s=${moment}`);
    if (visit !== this.visit) return;
    this.state.past = { time_s: moment, tracks: new Map(Object.entries(picture.tracks)), playing: this.state.past?.playing ?? playing, speed: Number(this.speed.value) };
    void this.recall.cover(moment);
  }

  /** A file of the whole history, or of its last minutes, by the browser's own download. */
  private async export(): Promise<void> {
    if (!this.span) return;
    const formats = ["gpx", "kml", "geojson", "csv", "mcap"].map((each): [string, string] => [each, each.toUpperCase()]);
    const asked = await ask("Export", [{ name: "format", label: "Format", options: formats }, { name: "minutes", label: "Last minutes (empty: all of the last week)", value: "", kind: "number" }], "Export");
    if (!asked) return;
    const begin = asked.minutes ? Math.max(this.begin(), this.span[1] - 60 * Number(asked.minutes)) : this.begin();
    h("a", { href: `api/v1/history/export?format=${asked.format}&begin_s=${begin}&end_s=${this.span[1] + 1}`, download: "" }).click();
  }

  private play(): void {
    const { past } = this.state;
    const since_s = Math.min(MOST_STEP_S, (performance.now() - this.stepped_ms) / 1000);
    if (past?.playing && this.asking) return;
    this.stepped_ms = performance.now();
    if (!past?.playing) return;
    const next = past.time_s + Number(this.speed.value) * since_s;
    if (this.span && next >= this.span[1]) return this.live();
    this.slider.value = String(next);
    void this.seek(next);
  }

  /** What there is to look back to. */
  private async survey(): Promise<void> {
    const history = await get<History>("history").catch(() => null);
    if (!history?.begin_s || !history.end_s) return;
    this.span = [history.begin_s, history.end_s];
    this.slider.min = String(this.span[0]);
    this.slider.max = String(this.span[1]);
    const events = await get<Picture>(`history/events?begin_s=${this.begin()}&end_s=${this.span[1] + 1}`).catch(() => null);
    if (events) {
      this.state.archived = { alerts: Object.values(events.alerts), observations: Object.values(events.observations) };
      this.mark(this.state.archived.alerts);
    }
    this.draw();
  }

  private begin(): number {
    const [begin, end] = this.span!;
    return Math.max(begin, end + 1 - WEEK_S);
  }

  private mark(alerts: Alert[]): void {
    const [begin, end] = this.span!;
    this.marks.replaceChildren(...alerts.map((each) => h("i", { title: `${each.kind} ${each.text}`, style: `left:${(100 * (each.time_s - begin)) / Math.max(1, end - begin)}%` })));
  }
}
