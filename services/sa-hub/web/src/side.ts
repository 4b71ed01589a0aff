// The right side: radio (budget, use, expected error by soldier), processes' health, and what has been seen.

import { duration } from "./display.ts";
import type { State } from "./state.ts";
import { observationCanvas } from "./symbols.ts";
import type { Link, Observation } from "./types.ts";
import { at, h, replaceIfNew } from "./ui.ts";

type Tab = "radio" | "health" | "seen";

export class Side {
  private readonly state: State;
  private readonly body = h("div", { class: "body" });
  private readonly buttons = new Map<Tab, HTMLElement>();
  private readonly onShow: (observation: Observation) => void;
  private tab: Tab = "radio";

  constructor(state: State, onShow: (observation: Observation) => void) {
    this.state = state;
    this.onShow = onShow;
    const tabs = h("div", { class: "tabs", role: "tablist" });
    for (const [tab, name] of [["radio", "Radio"], ["health", "Processes"], ["seen", "Seen"]] as [Tab, string][]) {
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
    const ill = [...this.state.health.values()].filter((each) => each.state !== "ok" && each.state !== "starting").length;
    const button = this.buttons.get("health")!;
    button.classList.toggle("ill", ill > 0);
    const count = this.state.observations.size;
    const seen = this.buttons.get("seen")!;
    const text = count ? `Seen (${count})` : "Seen";
    if (seen.textContent !== text) seen.textContent = text;
  }

  private drawRadio(): void {
    const links = [...this.state.links.values()];
    const key = `radio ${links.map((each) => each.time_s).join()}`;
    replaceIfNew(this.body, key, () => (links.length ? links.map((each) => this.link(each)) : [h("p", { class: "note" }, "No radio net has reported yet.")]));
  }

  private link(link: Link): HTMLElement {
    const share = link.budget_bits_per_s ? link.bits_per_s / link.budget_bits_per_s : 0;
    const ids = [...new Set([...Object.keys(link.expected_errors_m), ...Object.keys(link.ages_s)])].sort((a, b) => a.localeCompare(b, undefined, { numeric: true }));
    const soldiers = ids.map((id): [string, number | null | undefined] => [id, link.expected_errors_m[id]]);
    const rejected = link.frames_rejected ? ` · ${link.frames_rejected} refused` : "";
    return h("section", { class: "link" },
      h("h3", {}, link.link),
      meter(share, `${link.bits_per_s.toFixed(0)} of ${link.budget_bits_per_s.toFixed(0)} bit/s`),
      h("p", { class: "note" }, `sent ${link.frames_sent} · heard ${link.frames_received} · missed ${link.frames_lost}${rejected}`
        + (link.airtime_share === null ? "" : ` · on the air ${(100 * link.airtime_share).toFixed(1)} %`)
        + (link.duty_left_s === null ? "" : ` · ${link.duty_left_s.toFixed(0)} s of duty left`)),
      soldiers.length ? h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "as receivers see"), h("th", {}, "off by"), h("th", {}, "age"))),
        h("tbody", {}, ...soldiers.map(([id, error]) => h("tr", { class: error === null || (error ?? 0) > 20 ? "bad" : "" },
          h("td", {}, this.state.callsign(id)), h("td", {}, error === undefined ? "–" : error === null ? "unknown" : `${error.toFixed(1)} m`),
          h("td", {}, link.ages_s[id] === undefined ? "–" : duration(link.ages_s[id]!)))))) : null,
    );
  }

  private drawHealth(): void {
    const rows = [...this.state.health.values()].sort((a, b) => `${a.soldier}${a.service}`.localeCompare(`${b.soldier}${b.service}`));
    const silent = (time_s: number) => this.state.live_s - time_s > 5 * Math.max(1, this.state.post.speed);
    const key = `health ${rows.map((each) => `${each.time_s}`).join()}`;
    replaceIfNew(this.body, key, () => rows.length === 0 ? [h("p", { class: "note" }, "No process has reported yet.")] : [h("table", {},
      h("thead", {}, h("tr", {}, ...["process", "state", "CPU s", "MB"].map((each) => h("th", {}, each)))),
      h("tbody", {}, ...rows.flatMap((each) => [
        h("tr", { class: each.state === "ok" && !silent(each.time_s) ? "" : "bad" }, h("td", {}, `${this.state.callsign(each.soldier)} ${each.service}`),
          h("td", {}, silent(each.time_s) ? "silent" : each.state), h("td", {}, (each.gauges.cpu_s ?? 0).toFixed(0)), h("td", {}, (each.gauges.memory_mb ?? 0).toFixed(0))),
        each.note ? h("tr", { class: "bad" }, h("td", { colspan: 4 }, each.note)) : null,
      ].filter((row): row is HTMLTableRowElement => row !== null))))]);
  }

  private drawSeen(): void {
    const rows = [...this.state.observations.values()].sort((a, b) => b.time_s - a.time_s);
    const key = `seen ${rows.map((each) => each.id).join()} ${Math.floor(this.state.live_s / 5)}`;
    replaceIfNew(this.body, key, () => rows.length === 0
      ? [h("p", { class: "note" }, "Nothing has been seen yet. Press O, or choose the target, and click on the map.")]
      : rows.map((each) => h("button", { class: "row", onclick: () => this.onShow(each) },
        h("span", { class: "symbol" }, observationCanvas(each.code, 16)),
        h("span", { class: "who" }, h("span", { class: "first" }, h("b", {}, (each.code ?? "note").replaceAll("_", " ")), h("span", { class: "age" }, `${duration(this.state.live_s - each.time_s)} ago`)),
          h("small", {}, [each.text, `±${each.accuracy_m.toFixed(0)} m`, `by ${this.state.callsign(each.soldier)}`].filter(Boolean).join(" · "))))));
  }
}

function meter(share: number, text: string): HTMLElement {
  const bar = h("span", { style: `width:${Math.min(100, 100 * share).toFixed(1)}%`, class: share > 0.9 ? "full" : "" });
  return h("div", { class: "meter", role: "meter", "aria-valuenow": share.toFixed(2), "aria-label": text }, bar, h("em", {}, text));
}
