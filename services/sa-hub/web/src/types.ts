// What the hub's interface says; the same structs as in its OpenAPI description.

export type TrackState = "fresh" | "stale" | "lost";

export interface Soldier {
  soldier: string;
  number: number;
  unit: string;
  callsign: string;
  role: string;
}

export interface Track {
  time_s: number;
  soldier: string;
  state: TrackState;
  latitude_deg: number;
  longitude_deg: number;
  height_m: number | null;
  accuracy_m: number;
  east_velocity_m_s: number;
  north_velocity_m_s: number;
  mode: string;
  floor: number | null;
  via: string;
  hops: number;
  received_s: number | null;
  held_m: number | null;
  held_s: number | null;
  facing_rad: number | null;
}

export interface Foreign {
  time_s: number;
  uid: string;
  callsign: string | null;
  affiliation: string;
  cot_type: string;
  latitude_deg: number;
  longitude_deg: number;
  accuracy_m: number | null;
  course_rad: number | null;
  speed_m_s: number | null;
  stale_s: number;
}

export interface Alert {
  time_s: number;
  id: string;
  soldier: string;
  kind: string;
  text: string;
  acknowledged_by: string | null;
}

export interface Observation {
  time_s: number;
  id: string;
  soldier: string;
  latitude_deg: number;
  longitude_deg: number;
  accuracy_m: number;
  text: string;
  code: string | null;
}

export interface Status {
  time_s: number;
  soldier: string;
  condition: string;
  battery_pct: number | null;
}

export interface Link {
  time_s: number;
  link: string;
  budget_bits_per_s: number;
  bits_per_s: number;
  frames_sent: number;
  frames_received: number;
  frames_rejected: number;
  frames_lost: number;
  airtime_share: number | null;
  duty_left_s: number | null;
  drops: Record<string, number>;
  ages_s: Record<string, number>;
  expected_errors_m: Record<string, number | null>;
}

export interface Health {
  time_s: number;
  soldier: string;
  service: string;
  state: string;
  note: string;
  counters: Record<string, number>;
  gauges: Record<string, number>;
}

export interface Warning {
  time_s: number;
  friendly: string;
  reasons: string[];
  distance_m: number;
  probability_pct: number;
}

export interface Picture {
  now_s: number;
  revision: number;
  tracks: Record<string, Track>;
  foreign: Record<string, Foreign>;
  statuses: Record<string, Status>;
  alerts: Record<string, Alert>;
  observations: Record<string, Observation>;
  links: Record<string, Link>;
  health: Record<string, Health>;
  warnings: Record<string, Warning>;
  rooms: Record<string, { time_s: number; soldier: string; floors: number[] }>;
}

export interface Post {
  realm: string;
  soldier: string;
  origin_deg: [number, number];
  now_s: number;
  speed: number;
  stale_s: number;
  lost_s: number;
  has_plan: boolean;
  basemap: "pmtiles" | "mbtiles" | null;
  has_history: boolean;
  alert_kinds: string[];
  codes: string[];
  who: string;
  role: "view" | "operate" | "admin";
}

export interface History {
  kept: boolean;
  begin_s: number | null;
  end_s: number | null;
}

export type Place = [longitude_deg: number, latitude_deg: number];
