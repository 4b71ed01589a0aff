// Opens and decodes bootprint's radio frames: node radio_decoder.js layout.json frames-8.json
// Written against docs/radio.md; the tables of fields come from layout.json.
const crypto = require("crypto");
const fs = require("fs");

const [layout, vectors] = process.argv.slice(2, 4).map((file) => JSON.parse(fs.readFileSync(file, "utf8")));
const TICKS = 65536, CELL_DEG = 180 / 2 ** 26;

class Bits {
  constructor(bytes) { this.bits = [...bytes].map((byte) => byte.toString(2).padStart(8, "0")).join(""); this.at = 0; }
  take(count) {
    if (this.at + count > this.bits.length) throw new Error("short");
    this.at += count;
    return count ? parseInt(this.bits.slice(this.at - count, this.at), 2) : 0;
  }
  // A number in Rice code: so many ones, a zero, then the low bits.
  rice(parameter) {
    let ones = 0;
    while (this.take(1)) ones++;
    return ones * 2 ** parameter + this.take(parameter);
  }
  get left() { return this.bits.length - this.at; }
  finish() { if (this.left >= 8 || this.take(this.left)) throw new Error("too long"); }
  bytes(count) { return Buffer.from(Array.from({ length: count }, () => this.take(8))); }
}

// A field by its name, or the number that a field is the code of; what is not there counts as 0.
function named(name, known) {
  const table = layout.tables[name], by = table?.by.find((field) => field in known);
  return known[name] ?? (by ? table.numbers[known[by]] : 0);
}

// The value of an expression of fields, such as "count + 1".
const evaluate = (expression, known) =>
  new Function(`return ${String(expression).replace(/·/g, "*").replace(/[a-z_]+/g, (name) => named(name, known))}`)();

function readFields(bits, fields, known) {
  const found = {};
  for (const field of fields) {
    const values = { ...known, ...found };
    if (Object.entries(field.when).every(([name, value]) => (values[name] ?? 0) === value))
      found[field.name] = bits.take(evaluate(field.bits, values));
  }
  return found;
}

function readPayload(payload) {
  const bits = new Bits(payload), kind = bits.take(layout.kind_bits), parts = [];
  let known = {};
  for (const part of layout.kinds[kind]) {
    const times = evaluate(part.repeat, { ...known, left: bits.left });
    for (let index = 0; index < times; index++) {
      if (index && !known.counted && bits.left < part.while_left) break;
      const gap = part.rice && index ? { gap: bits.rice(evaluate(part.rice, known)) } : {};
      parts.push({ ...gap, ...readFields(bits, part.fields, known) });
      if (part.repeat === "1") known = { ...known, ...parts.at(-1) };
    }
    if (part.then_bytes) parts.push({ bytes: bits.bytes(known[part.then_bytes]).toString("hex") });
  }
  bits.finish();
  return [kind, parts];
}

function open(frame, epoch, counter) {
  const clear = frame[1] & 8 ? 8 : 2, header = readFields(new Bits(frame.subarray(0, clear)), layout.header, {});
  if (header.version !== 3) throw new Error("version");
  const info = `bootprint radio 2|${vectors.tag_bytes}|${header.sender}|${vectors.net}`;
  const groupKey = Buffer.from(vectors.group_key, "hex");
  const key = Buffer.from(crypto.hkdfSync("sha256", groupKey, Buffer.alloc(0), info, 32));
  const nonce = Buffer.alloc(13);
  nonce.writeUInt16BE(header.sender, 0);
  nonce.writeUInt32BE(header.full ? header.epoch : epoch, 2);
  nonce.writeUInt32BE(header.full ? header.counter_high * 8 + header.counter_low : counter, 6);
  const options = { authTagLength: vectors.tag_bytes }, tagAt = frame.length - vectors.tag_bytes;
  const cipher = crypto.createDecipheriv("aes-256-ccm", key, nonce, options);
  cipher.setAuthTag(frame.subarray(tagAt));
  cipher.setAAD(frame.subarray(0, clear), { plaintextLength: tagAt - clear });
  const payload = cipher.update(frame.subarray(clear, tagAt));
  cipher.final();
  return [header, payload];
}

const unwrap = (low, modulus, near) => near + ((((low - near + modulus / 2) % modulus) + modulus) % modulus) - modulus / 2;
const ageTicks = (code) => (code < 32 ? code : (32 + (code % 32)) * 2 ** (Math.floor(code / 32) - 1));

// Row, column and height of the anchor of a report, on the lattice of its resolution.
function anchor(place) {
  const cell = CELL_DEG * 2 ** place.resolution, { latitude_deg, longitude_deg, height_m } = vectors.origin;
  const width = (name) => 2 ** layout.kinds[0][0].fields.find((field) => field.name === name).bits;
  const near = (name, degrees) => unwrap(place[name], width(name), Math.floor(degrees / cell));
  const far = (name, degrees) => Math.floor((place[name] - degrees / CELL_DEG) / 2 ** place.resolution);
  const height = place.far ? place.far_height - 1024 : unwrap(place.height, 256, Math.round(height_m));
  return place.far ? [far("far_latitude", 90), far("far_longitude", 180), height]
    : [near("latitude", latitude_deg), near("longitude", longitude_deg), height];
}

const time = (ticks, age = 0, modulus = TICKS) => (unwrap(ticks, modulus, vectors.now_ticks) - age) / 10;
const facing = (told) => (told.has_facing ? told.facing * 22.5 : null);
const level = (told) => (told.has_floor ? told.floor - 32 : null);

// East and north, m/s.
function velocity(told) {
  if (!told.moving) return [0, 0];
  const speed = 0.3 * 1.28 ** (told.speed ?? named("pace_speed", told)), azimuth = (told.direction * Math.PI) / 8;
  return [speed * Math.sin(azimuth), speed * Math.cos(azimuth)];
}

function reports(place, soldiers) {
  const [row, column, height] = anchor(place), cell = CELL_DEG * 2 ** place.resolution;
  let before = NaN;
  return soldiers.map((soldier) => {
    before = soldier.number ?? before + 1;
    const up = soldier.up ?? (soldiers[0] === place ? 0 : null), [east_m_s, north_m_s] = velocity(soldier);
    return {
      number: before,
      time_s: time(place.time, ageTicks(soldier.age ?? 0)),
      latitude_deg: (row + (soldier.north ?? 0) + 0.5) * cell,
      longitude_deg: (column + (soldier.east ?? 0) + 0.5) * cell,
      height_m: place.has_height && up !== null ? height + up : null,
      floor: level(soldier),
      facing_deg: facing(soldier),
      east_m_s,
      north_m_s,
    };
  });
}

const METRES_PER_DEG = 40007863 / 360, DAMPING_S = 60, cosine = (degrees) => Math.cos((degrees * Math.PI) / 180);
const around = (degrees, turn) => ((((degrees + turn / 2) % turn) + turn) % turn) - turn / 2;

// Latitude and longitude after some seconds, by the damped rule; back in time it is not damped.
function moved(latitude, longitude, east_m_s, north_m_s, seconds) {
  const reach = seconds > 0 ? DAMPING_S * (1 - Math.exp(-seconds / DAMPING_S)) : seconds;
  const east = (east_m_s * reach) / (METRES_PER_DEG * cosine(latitude));
  return [latitude + (north_m_s * reach) / METRES_PER_DEG, around(longitude + east, 360)];
}

// Middle of the cell with these low bits that is nearest to where somebody is believed to be.
const nearest = (low, modulus, degrees, cell) =>
  (low + modulus * Math.round((degrees / cell - 0.5 - low) / modulus) + 0.5) * cell;

// Whether who stands is told within 4 m of where he was, and so faces as before.
const stays = (before, [latitude, longitude], velocity) => !velocity.some(Boolean) && METRES_PER_DEG * Math.hypot(
  before.latitude_deg - latitude, around(before.longitude_deg - longitude, 360) * cosine(before.latitude_deg)) < 4;

// What the entries of an update mean to who has heard what the sender told before; the others are left out.
function updated(update, entries, sender, told) {
  const row = CELL_DEG * 2 ** named("cells", update), reach = named("reach", update);
  const column = row * 2 ** Math.round(-Math.log2(cosine(vectors.origin.latitude_deg)));
  const now_s = time(update.time, 0, 256);
  let number = update.own ? sender : update.near ? sender + update.beside - 8 : update.first;
  return entries.flatMap((entry, index) => {
    number += index ? entry.gap + 1 : 0;
    const before = told[number];
    if (!before) return [];
    const [latitude, longitude] =
      moved(before.latitude_deg, before.longitude_deg, before.east_m_s, before.north_m_s, now_s - before.time_s);
    const modulus = 2 ** (reach + (update.varied ? (entry.far ? 2 : -1) : 0));
    const place = [nearest(entry.north, modulus, latitude, row), around(nearest(entry.east, modulus, longitude, column), 360)];
    const [east_m_s, north_m_s] = entry.steady ? [before.east_m_s, before.north_m_s] : velocity(entry), age_s = ageTicks(entry.age ?? 0) / 10;
    const [latitude_deg, longitude_deg] = moved(...place, -east_m_s, -north_m_s, age_s);
    const known = before.height_m !== null && entry.has_height;
    return [{
      number, time_s: now_s - age_s, latitude_deg, longitude_deg, east_m_s, north_m_s,
      height_m: !entry.level ? before.height_m : known ? unwrap(entry.height, 256, before.height_m) : null,
      floor: entry.level ? level(entry) : before.floor,
      facing_deg: entry.turned ? facing(entry) : stays(before, [latitude_deg, longitude_deg], [east_m_s, north_m_s]) ? before.facing_deg : null,
    }];
  });
}

function meaning(kind, parts, sender, before) {
  const [first, ...rest] = parts, soldiers = rest.filter((part) => "east" in part), told = { number: first.number, time_s: time(first.time) };
  const text = () => Buffer.from(rest.at(-1).bytes, "hex").toString("utf8");
  const degrees = (code, from) => (code + 0.5) * CELL_DEG - from;
  switch (kind) {
    case 0: return reports(first, [first]).map((report) => ({ ...report, number: sender }));
    case 1: return reports(first, soldiers);
    case 5: return updated(first, soldiers, sender, before);
    case 2: return [{ ...told, text: text() }];
    case 3: return [{ ...told, latitude_deg: degrees(first.far_latitude, 90),
      longitude_deg: degrees(first.far_longitude, 180), text: text() }];
    case 4: return [told];
    default: return [];
  }
}

// What was told of whom, by the one sender of these frames, of which none is missing.
const told = {};
const decoded = vectors.frames.map(({ frame, epoch, counter }) => {
  const [header, payload] = open(Buffer.from(frame, "hex"), epoch, counter), [kind, values] = readPayload(payload);
  const means = meaning(kind, values, header.sender, told);
  if ([0, 1, 5].includes(kind)) for (const report of means) told[report.number] = report;
  return { payload: payload.toString("hex"), kind, values, means };
});
process.stdout.write(JSON.stringify(decoded));
