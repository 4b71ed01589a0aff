// Says how the page sees tracks, places and names: node page_rules.ts < asked.json, from the page's own folder.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const sources = `${process.cwd()}/src`;
const { shown } = await import(`${sources}/display.ts`);
const { fromUtm, toUtm, zoneOf } = await import(`${sources}/geo.ts`);
const { place } = await import(`${sources}/labels.ts`);
const { View } = await import(`${sources}/view.ts`);
const { forward } = createRequire(`${sources}/`)("mgrs");
const asked = JSON.parse(readFileSync(0, "utf8"));

const tracks = asked.tracks.map((each) => shown(each.track, each.now_s, asked.ages));
const places = asked.places.map((place) => {
  const zone = zoneOf(place[0]);
  const utm = toUtm(place, zone);
  return { utm, back: fromUtm(utm, zone), mgrs: forward(place, 5).slice(-10) };
});
const labels = asked.labels.map((each) => Object.fromEntries(place(each.wishes, new Map(Object.entries(each.before)))));
const views = asked.views.map((each) => new View(each.centre, each.zoom, 1000, 800).toScreen(each.place));
process.stdout.write(JSON.stringify({ tracks, places, labels, views }));
