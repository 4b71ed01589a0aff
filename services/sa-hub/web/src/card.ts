// The card of the selected soldier, beside the map where there is room: everything that is known, what can be done.

import { courseOf, facingOf, reliability, speedOf } from "./display.ts";
import { mgrs } from "./mgrs.ts";
import type { State } from "./state.ts";
import { at, h, replaceIfNew } from "./ui.ts";

export function drawCard(state: State, actions: { follow: () => void; centre: () => void; fix: () => void; bearing: () => void; close: () => void }): void {
  const card = at("card");
  const seen = state.selected === null ? undefined : state.seen().find((each) => each.track.soldier === state.selected);
  const [wide, classes] = [matchMedia("(min-width: 1301px)").matches, document.body.classList];
  const home = (wide ? !classes.contains("no-right") : classes.contains("show-right")) ? at("right") : at("over");
  if (card.parentElement !== home) home.id === "right" ? home.prepend(card) : home.append(card);
  card.hidden = state.selected === null;
  if (state.selected === null) return;
  const soldier = state.roster.get(state.selected);
  const rows: [string, string][] = seen === undefined ? [["position", "never heard"]] : [
    ["last report", seen.shown.words],
    ["MGRS", mgrs(seen.shown.place)],
    ["within", `${seen.shown.radius_95_m.toFixed(1)} m (95 %), ${reliability(seen.track.mode, seen.shown.radius_95_m)}`],
    ["by", seen.track.mode],
    ["moves", courseOf(seen.track) === null ? (facingOf(seen.track) === null ? "stands" : `stands, faces ${facingOf(seen.track)!.toFixed(0)}°`) : `${speedOf(seen.track).toFixed(1)} m/s towards ${courseOf(seen.track)!.toFixed(0)}°`],
    ["floor", seen.track.floor === null ? "outdoors or not known" : String(seen.track.floor)],
    ["height", seen.track.height_m === null ? "not known" : `${seen.track.height_m.toFixed(1)} m`],
    ["heard by", `${seen.track.via}${seen.track.hops ? `, ${seen.track.hops} hop${seen.track.hops > 1 ? "s" : ""}` : ""}`],
    ["status", seen.status ? `${seen.status.condition}${seen.status.battery_pct === null ? "" : `, battery ${seen.status.battery_pct.toFixed(0)} %`}` : "not told"],
  ];
  const state_ = seen?.shown.state ?? "lost";
  replaceIfNew(card, JSON.stringify([state.selected, rows, state.following]), () => [
    h("h2", { class: state_ }, soldier?.callsign ?? state.selected!, h("small", {}, ` ${soldier?.unit ?? ""} ${soldier?.role.replaceAll("_", " ") ?? ""}`), h("button", { class: "close", "aria-label": "Close", onclick: actions.close }, "✕")),
    h("dl", {}, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", { "data-row": name }, value)])),
    h("div", { class: "buttons" },
      h("button", { onclick: actions.centre }, "Centre (C)"),
      h("button", { class: state.following ? "on" : "", onclick: actions.follow }, "Follow (G)"),
      state.mayOperate && h("button", { onclick: actions.bearing }, "Sees… (B)"),
      state.mayOperate && h("button", { onclick: actions.fix }, "Is here… (X)")),
  ], state.selected);
}
