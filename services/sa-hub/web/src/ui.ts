// Building the page's elements: `h` makes one, `dialog` asks for values, `toast` tells of an outcome.

type Child = Node | string | null | undefined | false;

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Record<string, unknown> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value as EventListener);
    else if (name === "class") element.className = String(value);
    else if (value !== undefined && value !== null && value !== false) element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((each): each is Node | string => each !== null && each !== undefined && each !== false));
  return element;
}

export function at(id: string): HTMLElement {
  return document.getElementById(id)!;
}

export interface Field {
  name: string;
  label: string;
  value?: string | number;
  options?: [value: string, label: string][];
  kind?: "text" | "number" | "password";
}

/** Ask for values in a dialog of its own; null if it was left. */
export function ask(title: string, fields: Field[], button: string, note = ""): Promise<Record<string, string> | null> {
  return new Promise((resolve) => {
    const dialog = h("dialog", {});
    const inputs = fields.map((each) => input(each));
    const finish = (answer: Record<string, string> | null) => {
      dialog.close();
      dialog.remove();
      resolve(answer);
    };
    const sent = (event: Event) => {
      event.preventDefault();
      finish(Object.fromEntries(fields.map((each, index) => [each.name, inputs[index]!.value])));
    };
    dialog.append(h("form", { onsubmit: sent },
      h("h2", {}, title),
      note ? h("p", { class: "note" }, note) : null,
      ...fields.map((each, index) => h("label", {}, h("span", {}, each.label), inputs[index]!)),
      h("div", { class: "buttons" }, h("button", { type: "button", onclick: () => finish(null) }, "Cancel"), h("button", { class: "primary" }, button)),
    ));
    dialog.addEventListener("cancel", () => finish(null));
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** Say which key does what, until any is pressed. */
export function showKeys(keys: [key: string, what: string][]): void {
  const dialog = h("dialog", { onclose: () => dialog.remove(), onkeydown: () => dialog.close() },
    h("h2", {}, "Keys"),
    h("div", { class: "keys" }, ...keys.flatMap(([key, what]) => [h("kbd", {}, key), h("span", {}, what)])),
    h("form", { method: "dialog", class: "buttons" }, h("button", { class: "primary" }, "Close")));
  document.body.append(dialog);
  dialog.showModal();
}

function input(field: Field): HTMLInputElement | HTMLSelectElement {
  if (field.options) {
    const select = h("select", { name: field.name }, ...field.options.map(([value, label]) => h("option", { value, selected: value === field.value }, label)));
    return select;
  }
  return h("input", { name: field.name, type: field.kind ?? "text", value: field.value, step: "any", maxlength: 200 });
}

let toastTimer = 0;

/** Tell of an outcome for a few seconds. */
export function toast(text: string, bad = false): void {
  let element = document.getElementById("toast");
  if (!element) document.body.append((element = h("div", { id: "toast", role: "status" })));
  element.textContent = text;
  element.className = bad ? "bad shown" : "shown";
  clearTimeout(toastTimer);
  toastTimer = window.setTimeout(() => (element.className = ""), bad ? 7000 : 3500);
}

/** Do what takes long when what answers a person is on the screen. */
export function afterPaint(job: () => void): void {
  requestAnimationFrame(() => setTimeout(job));
}

/**
 * Replace an element's children only if their text would change (`key`): hovering and focus survive. Where the new ones
 * are of the same `kind` as the old, only texts and attributes change: a click that has begun on a button ends on it.
 */
export function replaceIfNew(element: HTMLElement, key: string, children: () => Child[], kind = key): void {
  if (element.dataset.key === key) return;
  const alike = element.dataset.kind === kind;
  [element.dataset.key, element.dataset.kind] = [key, kind];
  const nodes = children().filter((each): each is Node | string => each !== null && each !== undefined && each !== false);
  if (alike) renew(element, nodes.map((each) => (typeof each === "string" ? document.createTextNode(each) : each)));
  else element.replaceChildren(...nodes);
}

/** Make the children of an element like these by changing as little as can be. */
function renew(element: Element, wanted: Node[]): void {
  const there = [...element.childNodes];
  wanted.forEach((node, index) => {
    const old = there[index];
    if (old instanceof Text && node instanceof Text) {
      if (old.data !== node.data) old.data = node.data;
    } else if (old instanceof Element && node instanceof Element && old.tagName === node.tagName && !(node instanceof HTMLCanvasElement)) {
      renewAttributes(old, node);
      renew(old, [...node.childNodes]);
    } else if (old) old.replaceWith(node);
    else element.append(node);
  });
  for (const old of there.slice(wanted.length)) old.remove();
}

function renewAttributes(old: Element, wanted: Element): void {
  for (const { name } of [...old.attributes]) if (!wanted.hasAttribute(name)) old.removeAttribute(name);
  for (const { name, value } of wanted.attributes) if (old.getAttribute(name) !== value) old.setAttribute(name, value);
}
