// Building plans: which floors each thing of a plan is on. Rooms and walls say so; doors, stairs and lifts name rooms.

type Feature = GeoJSON.Feature;

/** The same features with `floors`; without it a thing is shown on every floor. */
export function withFloors(features: Feature[]): Feature[] {
  const rooms = new Map<string, number>();
  for (const each of features) {
    const { kind, name, floor, building } = each.properties ?? {};
    if (kind !== "room" || typeof floor !== "number") continue;
    rooms.set(String(name), floor);
    rooms.set(`${building}.${name}`, floor);
    rooms.set(`${building}/${name}`, floor);
  }
  return features.map((each) => ({ ...each, properties: { ...each.properties, ...floors(each, rooms) } }));
}

function floors(feature: Feature, rooms: Map<string, number>): { floors?: number[] } {
  const { floor, between, rooms: served } = feature.properties ?? {};
  if (typeof floor === "number") return { floors: [floor] };
  const names = (between ?? served ?? []) as unknown[];
  const found = names.map((each) => rooms.get(String(each))).filter((each): each is number => each !== undefined);
  return found.length ? { floors: found } : {};
}

/** The floors of a plan that has more than one. */
export function floorsOf(features: Feature[]): number[] {
  const found = new Set(features.flatMap((each) => (each.properties?.kind === "room" ? ((each.properties.floors ?? []) as number[]) : [])));
  return [...found];
}
