// The right side: radio (budget, use, expected error by soldier), processes' health, and the log of events.

import { duration } from "./display.ts";
import { eventRow, eventsOf, type EventActions } from "./events.ts";
import type { State } from "./state.ts";
import type { Health, Link } from "./types.ts";
import { at, h, replaceIfNew } from "./ui.ts";

const FAR_OFF_M = 20;
const MOST_ROWS = 40;
const SILENT_S = 5; // of the host's time; every process tells of its health each second

type Tab = "radio" | "health" | "seen";

export class Side {
  private readonly state: State;
  private readonly body = h("div", { class: "body" });
  private readonly buttons = new Map<Tab, HTMLElement>();
  private readonly actions: EventActions;
  private tab: Tab = "radio";

  constructor(state: State, actions: EventActions) {
    this.state = state;
    this.actions = actions;
    const tabs = h("div", { class: "tabs", role: "tablist" });
    for (const [tab, name] of [["radio", "Radio"], ["health", "Processes"], ["seen", "Events"]] as [Tab, string][]) {
      const button = h("button", { role: "tab", "data-tab": tab, onclick: () => this.show(tab) }, name);
      this.buttons.set(tab, button);
      tabs.append(button);
    }
    at("right").append(tabs, this.body);
    this.show("radio");
  }

  show(tab: Tab): void {
    this.tab = tab;
    for (const [each, button] of this.buttons) button.setAttribute("aria-selected", String(each === tab));
    this.body.dataset.key = "";
    this.draw();
  }

  draw(): void {
    if (this.tab === "radio") this.drawRadio();
    else if (this.tab === "health") this.drawHealth();
    else this.drawSeen();
    const isIll = [...this.state.health.values()].some((each) => this.isSilent(each) || (each.state !== "ok" && each.state !== "starting"));
    for (const each of [this.buttons.get("health")!, at("side-toggle")]) each.classList.toggle("ill", isIll);
    const count = this.state.alertsShown().length + this.state.observationsShown().length;
    const seen = this.buttons.get("seen")!;
    const text = count ? `Events (${count})` : "Events";
    if (seen.textContent !== text) seen.textContent = text;
  }

  private drawRadio(): void {
    const links = [...this.state.links.values()];
    const key = `radio ${links.map((each) => each.time_s).join()}`;
    replaceIfNew(this.body, key, () => (links.length ? links.map((each) => this.link(each)) : [h("p", { class: "note" }, "No radio net has reported yet.")]), `radio ${links.map((each) => each.link).join()}`);
  }

  private link(link: Link): HTMLElement {
    const share = link.budget_bits_per_s ? link.bits_per_s / link.budget_bits_per_s : 0;
    const rejected = link.frames_rejected ? ` · ${link.frames_rejected} refused` : "";
    return h("section", { class: "link" },
      h("h3", {}, link.link),
      meter(share, `${link.bits_per_s.toFixed(0)} of ${link.budget_bits_per_s.toFixed(0)} bit/s`),
      h("p", { class: "note" }, `sent ${link.frames_sent} · heard ${link.frames_received} · missed ${link.frames_lost}${rejected}`
        + (link.airtime_share === null ? "" : ` · on the air ${(100 * link.airtime_share).toFixed(1)} %`)
        + (link.duty_left_s === null ? "" : ` · ${link.duty_left_s.toFixed(0)} s of duty left`)),
      this.errors(link),
    );
  }

  /** How old the net's news of each soldier is, how far off they may be here, and as those who are told by us see them. */
  private errors({ ages_s, expected_errors_m }: Link): HTMLElement | null {
    const all = [...new Set([...Object.keys(expected_errors_m), ...Object.keys(ages_s)])];
    if (all.length === 0) return null;
    const oldest = all.length > MOST_ROWS ? all.sort((a, b) => (ages_s[b] ?? 0) - (ages_s[a] ?? 0)).slice(0, MOST_ROWS) : all;
    const ids = oldest.sort((a, b) => a.localeCompare(b, undefined, { numeric: true }));
    const here = new Map((this.state.past === null ? this.state.seen() : []).map((each) => [each.track.soldier, each.shown.radius_95_m]));
    const tells = Object.keys(expected_errors_m).length > 0;
    const heads = [all.length > ids.length ? `the oldest of ${all.length}` : "", "news", "here ±", ...(tells ? ["told: off by"] : [])];
    return h("table", {}, h("thead", {}, h("tr", {}, ...heads.map((each) => h("th", {}, each)))),
      h("tbody", {}, ...ids.map((id) => {
        const [radius_m, off_m] = [here.get(id), expected_errors_m[id]];
        const cells = [ages_s[id] === undefined ? "–" : duration(ages_s[id]!), metres(radius_m), ...(tells ? [off_m === null ? "unknown" : metres(off_m)] : [])];
        return h("tr", { class: off_m === null || Math.max(off_m ?? 0, (radius_m ?? 0) / 2) > FAR_OFF_M ? "bad" : "" },
          h("td", {}, this.state.callsign(id)), ...cells.map((each) => h("td", {}, each)));
      })));
  }

  private isSilent({ time_s }: Health): boolean {
    return this.state.live_s - time_s > SILENT_S * Math.max(1, this.state.post.speed);
  }

  private drawHealth(): void {
    const rows = [...this.state.health.values()].sort((a, b) => `${a.soldier}${a.service}`.localeCompare(`${b.soldier}${b.service}`));
    const key = `health ${rows.map((each) => `${each.time_s}`).join()}`;
    replaceIfNew(this.body, key, () => rows.length === 0 ? [h("p", { class: "note" }, "No process has reported yet.")] : [h("table", {},
      h("thead", {}, h("tr", {}, ...["process", "state", "CPU s", "MB"].map((each) => h("th", {}, each)))),
      h("tbody", {}, ...rows.flatMap((each) => [
        h("tr", { class: each.state === "ok" && !this.isSilent(each) ? "" : "bad" }, h("td", {}, `${this.state.callsign(each.soldier)} ${each.service}`),
          h("td", {}, this.isSilent(each) ? "silent" : each.state), h("td", {}, (each.gauges.cpu_s ?? 0).toFixed(0)), h("td", {}, (each.gauges.memory_mb ?? 0).toFixed(0))),
        each.note ? h("tr", { class: "bad" }, h("td", { colspan: 4 }, each.note)) : null,
      ].filter((row): row is HTMLTableRowElement => row !== null))))], "health");
  }

  private drawSeen(): void {
    const { events, kind } = eventsOf(this.state);
    const key = `seen ${kind} ${events.map((each) => ("kind" in each ? each.acknowledged_by : "")).join()} ${Math.floor(this.state.now_s / 5)}`;
    replaceIfNew(this.body, key, () => events.length === 0
      ? [h("p", { class: "note" }, "Nothing has been alerted or seen yet. Press O, or choose the target, and click on the map.")]
      : events.map((each) => eventRow(each, this.state, this.actions)), `seen ${kind}`);
  }
}

function metres(value: number | undefined): string {
  return value === undefined ? "–" : `${value < 10 ? value.toFixed(1) : value.toFixed(0)} m`;
}

function meter(share: number, text: string): HTMLElement {
  const bar = h("span", { style: `width:${Math.min(100, 100 * share).toFixed(1)}%`, class: share > 0.9 ? "full" : "" });
  return h("div", { class: "meter", role: "meter", "aria-valuenow": share.toFixed(2), "aria-label": text }, bar, h("em", {}, text));
}
