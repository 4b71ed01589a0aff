// The line to the hub: requests, and the live telling with reconnection.

import type { Picture } from "./types.ts";

const ROOT = "api/v1";

/** A request that the hub refused, with its reason for people. */
export class Refusal extends Error {
  readonly status: number;

  constructor(status: number, reason: string) {
    super(reason);
    this.status = status;
  }
}

export async function get<T>(path: string): Promise<T> {
  return answer<T>(await fetch(`${ROOT}/${path}`));
}

export async function post<T>(path: string, body: unknown = {}): Promise<T> {
  return answer<T>(
    await fetch(`${ROOT}/${path}`, {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify(body),
    }),
  );
}

async function answer<T>(response: Response): Promise<T> {
  const value = (await response.json().catch(() => ({ error: response.statusText }))) as T & { error?: string };
  if (!response.ok) throw new Refusal(response.status, value.error ?? response.statusText);
  return value;
}

export type LineState = "connecting" | "live" | "gone";

/** Listens until the page closes; the first telling after each connection is the whole picture. */
export function listen(onNews: (news: Picture, whole: boolean) => void, onState: (state: LineState) => void): void {
  let wait_ms = 500;
  const connect = () => {
    const address = new URL(`${ROOT}/live`, document.baseURI);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    let whole = true;
    socket.onmessage = (event) => {
      wait_ms = 500;
      onState("live");
      onNews(JSON.parse(event.data as string) as Picture, whole);
      whole = false;
    };
    socket.onclose = (event) => {
      if (event.code === 4401) location.reload();
      onState("gone");
      setTimeout(connect, wait_ms);
      wait_ms = Math.min(8000, 2 * wait_ms);
    };
  };
  onState("connecting");
  connect();
}
