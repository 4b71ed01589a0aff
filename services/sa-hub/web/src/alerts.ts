// Alerts that cannot be missed: a banner over everything until somebody acknowledges it, and a sound if wanted.

import { duration } from "./display.ts";
import { post, Refusal } from "./link.ts";
import type { State } from "./state.ts";
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

  draw(): void {
    const unseen = this.state.unseenAlerts();
    const near = [...this.state.warnings.values()].filter((each) => each.reasons.length > 0 && this.state.live_s - each.time_s < WARNING_S);
    const key = `${unseen.map((each) => each.id).join()} ${near.length} ${Math.floor(this.state.live_s)}`;
    document.body.classList.toggle("alarmed", unseen.length > 0);
    document.title = unseen.length ? `⚠ ${unseen.length} · bootprint` : "bootprint · command post";
    replaceIfNew(at("alerts"), key, () => [
      ...unseen.slice(0, MOST).map((each) => h("div", { class: `alert ${each.kind}`, "data-alert": each.id },
        h("b", {}, each.kind.toUpperCase()),
        h("button", { class: "from", onclick: () => this.onShow(each.soldier) }, this.state.callsign(each.soldier)),
        h("span", { class: "text" }, each.text),
        h("span", {}, `${duration(this.state.live_s - each.time_s)} ago`),
        this.state.mayOperate ? h("button", { class: "seen", onclick: () => void this.acknowledge(each.id) }, "Acknowledge (A)") : null)),
      ...near.map((each) => h("div", { class: "alert warning" }, h("b", {}, "FRIENDLY"), h("button", { class: "from", onclick: () => this.onShow(each.friendly) }, this.state.callsign(each.friendly)),
        h("span", { class: "text" }, `${each.reasons.map((reason) => reason.replaceAll("_", " ")).join(", ")}, ${each.distance_m.toFixed(0)} m`))),
      unseen.length > MOST ? h("div", { class: "alert" }, `and ${unseen.length - MOST} more`) : null,
    ]);
    this.ring(unseen.map((each) => each.id));
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
