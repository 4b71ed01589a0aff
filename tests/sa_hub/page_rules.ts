// Says how the page sees tracks, places and names: node page_rules.ts < asked.json, from the page's own folder.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const sources = `${process.cwd()}/src`;
globalThis.window = { devicePixelRatio: 1 }; // that of symbols, which nothing here draws
const { shown } = await import(`${sources}/display.ts`);
const { fromUtm, toUtm, zoneOf } = await import(`${sources}/geo.ts`);
const { place } = await import(`${sources}/labels.ts`);
const { climbOf } = await import(`${sources}/marks.ts`);
const { Recall } = await import(`${sources}/recall.ts`);
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
const climbs = asked.climbs.map((each) => climbOf(each.points, each.floor, each.now_s));
const recalls = [];
for (const each of asked.recalls) recalls.push(await recalled(each));
process.stdout.write(JSON.stringify({ tracks, places, labels, views, climbs, recalls }));

/** Times of everybody's trails, and questions asked, after looks at moments; each answer has so many reports at most. */
async function recalled({ names, period_s, most, speed, moments }) {
  const state = { roster: new Map(names.map((name) => [name, {}])), selected: null, past: { speed }, trailsThen: new Map() };
  let questions = 0;
  globalThis.fetch = async (address) => {
    questions++;
    const wanted = new URL(address, "http://post").searchParams;
    const [begin, end] = ["begin_s", "end_s"].map((each) => Number(wanted.get(each)));
    const all = [];
    for (let beat = Math.ceil(begin / period_s); beat * period_s < end; beat++) for (const name of names) all.push([name, beat * period_s]);
    const told = all.slice(0, most);
    const features = names.map((name) => {
      const times_s = told.filter(([whose]) => whose === name).map(([, time_s]) => time_s);
      return { geometry: { type: "LineString", coordinates: times_s.map(() => [0, 0]) }, properties: { soldier: name, times_s, floors: [] } };
    });
    return Response.json({ features, until_s: all.length > most ? all[most][1] : end });
  };
  const recall = new Recall(state);
  const found = [];
  for (const moment of moments) {
    await recall.cover(moment);
    found.push({ questions, times_s: Object.fromEntries([...state.trailsThen].map(([name, points]) => [name, points.map((each) => each.time_s)])) });
  }
  return found;
}
