// The buttons' signs as lines on a 24 by 24 grid: fonts differ from computer to computer, these do not.

const PATHS: Record<string, string> = {
  select: "M5 3l14 8-6 2-3 6z",
  observe: "M12 5a7 7 0 1 0 0 14a7 7 0 1 0 0-14M12 9.5a2.500 2.500 0 1 0 0 5a2.500 2.500 0 1 0 0-5M12 2v3M12 19v3M2 12h3M19 12h3",
  bearing: "M4 20L19 5M13 5h6v6M4 20h16M11 20a8 8 0 0 0-2-5",
  fix: "M12 21s-6-6-6-11a6 6 0 0 1 12 0c0 5-6 11-6 11M12 7.500v5M9.500 10h5",
  measure: "M3 17L17 3l4 4L7 21zM7 13l2 2M10 10l2 2M13 7l2 2",
  alert: "M12 3L2 20h20zM12 9v6M12 17.500v.5",
  trails: "M4 19c5 0 3-6 8-6s3-8 8-8M4 19m-1.500 0a1.500 1.500 0 1 0 3 0a1.500 1.500 0 1 0-3 0",
  fit: "M3 8V3h5M16 3h5v5M21 16v5h-5M8 21H3v-5M9 9h6v6H9z",
  roster: "M4 6h16M4 12h16M4 18h16",
  side: "M3 4h18v16H3zM15 4v16",
  "sound-on": "M6 16V11a6 6 0 0 1 12 0v5l2 2H4zM10 20.500h4",
  "sound-off": "M6 16V11a6 6 0 0 1 12 0v5l2 2H4zM10 20.500h4M3 3l18 18",
  theme: "M12 3a9 9 0 1 0 0 18zM12 3a9 9 0 0 1 0 18",
  keys: "M2 6h20v12H2zM6 10h.1M10 10h.1M14 10h.1M18 10h.1M7 14h10",
  play: "M7 4l13 8-13 8z",
  export: "M12 3v11M7 9.500l5 5 5-5M4 17v4h16v-4",
  pause: "M7 4v16M17 4v16",
};

export function icon(name: string): SVGSVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("class", "icon");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", PATHS[name] ?? "");
  svg.append(path);
  return svg;
}
