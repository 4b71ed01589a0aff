// Alerts that cannot be missed: a banner over everything until somebody acknowledges it, and a sound if wanted.

import { clock, duration } from "./display.ts";
import { post, Refusal } from "./link.ts";
import type { State } from "./state.ts";
import type { Alert, Warning } from "./types.ts";
import { at, h, replaceIfNew, toast } from "./ui.ts";

const MOST = 4;
const WARNING_S = 12; // a warning that lasts is told again every five

export class Alerts {
  sound = localStorage.getItem("sound") === "on";
  private readonly state: State;
  private readonly onShow: (soldier: string) => void;
  private rung = new Set<string>();
  private first = true;

  constructor(state: State, onShow: (soldier: string) => void) {
    this.state = state;
    this.onShow = onShow;
  }

  /** The newest lies lowest, so that none moves when another comes. */
  draw(): void {
    const { state } = this;
    const unseen = state.unseenAlerts();
    const shown = unseen.slice(0, MOST).reverse();
    const near = [...state.warnings.values()].filter((each) => each.reasons.length > 0 && state.live_s - each.time_s < WARNING_S);
    const then = state.alertsThen();
    document.body.classList.toggle("alarmed", unseen.length > 0);
    document.title = unseen.length ? `⚠ ${unseen.length} · bootprint` : "bootprint · command post";
    const kind = [...[...shown, ...then].map((each) => each.id), ...near.map((each) => each.friendly), unseen.length > MOST].join();
    replaceIfNew(at("alerts"), `${kind} ${Math.floor(state.live_s)} ${near.map((each) => each.distance_m).join()}`, () => [
      unseen.length > MOST ? h("div", { class: "alert more" }, `and ${unseen.length - MOST} older`) : null,
      ...shown.map((each) => this.banner(each)),
      ...near.map((each) => this.warning(each)),
      ...then.map((each) => this.bannerThen(each)),
    ], kind);
    this.ring(unseen.map((each) => each.id));
  }

  private banner(alert: Alert): HTMLElement {
    return h("div", { class: `alert ${alert.kind}`, "data-alert": alert.id },
      h("b", {}, alert.kind.toUpperCase()), this.from(alert.soldier), h("span", { class: "text" }, alert.text),
      h("span", { class: "age" }, `${duration(this.state.live_s - alert.time_s)} ago`),
      this.state.mayOperate ? h("button", { class: "seen", onclick: () => void this.acknowledge(alert.id) }, "Acknowledge (A)") : null);
  }

  /** While looking back: what was alerted then. */
  private bannerThen(alert: Alert): HTMLElement {
    return h("div", { class: "alert then" }, h("b", {}, alert.kind.toUpperCase()), this.from(alert.soldier),
      h("span", { class: "text" }, alert.text), h("span", { class: "age" }, `at ${clock(alert.time_s)}`));
  }

  private warning(near: Warning): HTMLElement {
    return h("div", { class: "alert warning" }, h("b", {}, "FRIENDLY"), this.from(near.friendly),
      h("span", { class: "text" }, `${near.reasons.map((reason) => reason.replaceAll("_", " ")).join(", ")}, ${near.distance_m.toFixed(0)} m`));
  }

  private from(soldier: string): HTMLElement {
    return h("button", { class: "from", onclick: () => this.onShow(soldier) }, this.state.callsign(soldier));
  }

  async acknowledge(id = this.state.unseenAlerts()[0]?.id): Promise<void> {
    if (id === undefined) return;
    try {
      await post(`alerts/${encodeURIComponent(id)}/acknowledgement`);
    } catch (error) {
      toast(error instanceof Refusal ? error.message : "the hub cannot be reached", true);
    }
  }

  toggleSound(): boolean {
    this.sound = !this.sound;
    localStorage.setItem("sound", this.sound ? "on" : "off");
    if (this.sound) beep();
    return this.sound;
  }

  private ring(ids: string[]): void {
    const news = ids.filter((each) => !this.rung.has(each));
    this.rung = new Set([...this.rung, ...ids]);
    if (news.length && this.sound && !this.first) beep();
    this.first = false;
  }
}

function beep(): void {
  const audio = new AudioContext();
  for (const [index, pitch] of [880, 660, 880].entries()) {
    const [tone, gain] = [audio.createOscillator(), audio.createGain()];
    tone.frequency.value = pitch;
    gain.gain.value = 0.15;
    tone.connect(gain).connect(audio.destination);
    tone.start(audio.currentTime + 0.18 * index);
    tone.stop(audio.currentTime + 0.18 * index + 0.14);
  }
}
