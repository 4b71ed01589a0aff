// The log of what was alerted and seen, the newest first; while somebody looks back, of what had been until then.

import { clock, duration } from "./display.ts";
import type { State } from "./state.ts";
import { observationCanvas } from "./symbols.ts";
import type { Alert, Observation, Place } from "./types.ts";
import { h } from "./ui.ts";

const MOST = 200;

export interface EventActions {
  /** Show the place of a thing seen. */
  show: (place: Place) => void;
  /** Show a soldier. */
  select: (soldier: string) => void;
}

/** What there is to list, and what tells one list's buttons from another's. */
export function eventsOf(state: State): { events: (Alert | Observation)[]; kind: string } {
  const events = [...state.alertsShown(), ...state.observationsShown()].sort((one, other) => other.time_s - one.time_s).slice(0, MOST);
  return { events, kind: events.map((each) => each.id).join() };
}

export function eventRow(event: Alert | Observation, state: State, actions: EventActions): HTMLElement {
  return "kind" in event ? alertRow(event, state, actions) : seenRow(event, state, actions);
}

function alertRow(alert: Alert, state: State, { select }: EventActions): HTMLElement {
  const seen = alert.acknowledged_by === null ? (state.past === null ? "not acknowledged" : "") : `seen by ${alert.acknowledged_by}`;
  return row(h("span", { class: "sign" }, "⚠"), alert.kind, alert.time_s, [alert.text, `from ${state.callsign(alert.soldier)}`, seen], state, () => select(alert.soldier), "alerted");
}

function seenRow(thing: Observation, state: State, { show }: EventActions): HTMLElement {
  const words = [thing.text, `±${thing.accuracy_m.toFixed(0)} m`, `by ${state.callsign(thing.soldier)}`];
  return row(observationCanvas(thing.code, 16), (thing.code ?? "note").replaceAll("_", " "), thing.time_s, words, state, () => show([thing.longitude_deg, thing.latitude_deg]), "seen");
}

function row(sign: HTMLElement, title: string, time_s: number, words: string[], state: State, onclick: () => void, kind: string): HTMLElement {
  return h("button", { class: `row ${kind}`, title: clock(time_s), onclick },
    h("span", { class: "symbol" }, sign),
    h("span", { class: "who" }, h("span", { class: "first" }, h("b", {}, title), h("span", { class: "age" }, `${duration(state.now_s - time_s)} ago`)),
      h("small", {}, words.filter(Boolean).join(" · "))));
}
