// Excerpts of a recording: fetched some seconds at a time, those around the moment that is shown are kept.
import { signal } from "@preact/signals";
import { fetched } from "./base.js";
import { mapped, opened } from "./link.js";

const SPAN = 10, SPAN_MAX = 120; // s: an excerpt of a recording that is played at its own speed, and the longest
const KEPT = 8; // excerpts
const RETRY = 2000; // ms
const FIELDS = 4; // of a move: time, x, y, yaw

/** What is drawn between two moments: maps and scans with their times, moves in rows of FIELDS, and what happened.
 * @typedef {{until: number, maps: any[], scans: any[], moves: Float32Array, rows: any[]}} Excerpt */

/** @param {ArrayBuffer} data @param {number} until @returns {Promise<Excerpt>} */
async function unpacked(data, until) {
  const found = { until, maps: [], scans: [], moves: new Float32Array(), rows: [] }, view = new DataView(data);
  for (let start = 0; start < data.byteLength;) {
    const end = start + 12 + view.getUint32(start, true), at = view.getFloat64(start + 4, true);
    const { head, payload } = opened(data.slice(start + 12, end));
    if (head.kind === "map") found.maps.push({ at, ...await mapped(head, payload) });
    else if (head.kind === "scan") found.scans.push({ at, ...head, ranges: new Uint16Array(payload) });
    else if (head.kind === "moves") found.moves = new Float32Array(payload);
    else found.rows = JSON.parse(new TextDecoder().decode(payload));
    start = end;
  }
  return found;
}

/** The last of some things at a moment. @param {any[]} things in the order of their times @param {number} at */
export const lastAt = (things, at) => things.findLast((one) => one.at <= at);

/** The excerpts of one robot in a recording. */
export class Excerpts {
  /** @param {string} file @param {string} robot @param {number} seconds how long it is */
  constructor(file, robot, seconds) {
    this.path = `/api/recordings/${encodeURIComponent(file)}/watch/${encodeURIComponent(robot)}`;
    this.seconds = seconds;
    this.kept = /** @type {Map<string, Excerpt | null>} */ (new Map()); // null: on the way
    this.arrived = signal(0); // excerpts so far
    this.failure = signal("");
  }

  /** The excerpt of a moment, and the one before it, as far as they are there; what is missing is fetched.
   * @param {number} at s @param {number} speed @returns {{now: Excerpt | null, before: Excerpt | null}} */
  around(at, speed) {
    const span = Math.min(SPAN_MAX, SPAN * speed), number = Math.floor(at / span);
    const now = this.get(number, span), before = number ? this.kept.get(`${span} ${number - 1}`) ?? null : null;
    if (now && at > (number + 0.5) * span && (number + 1) * span < this.seconds) this.get(number + 1, span);
    return { now, before };
  }

  /** @param {number} number @param {number} span s */
  get(number, span) {
    const key = `${span} ${number}`, found = this.kept.get(key);
    if (found === undefined) { this.kept.set(key, null); this.fetch(key, number * span, span); }
    return found ?? null;
  }

  /** @param {string} key @param {number} since s @param {number} span s */
  async fetch(key, since, span) {
    try {
      this.kept.set(key, await unpacked(await fetched(`${this.path}/${since * 1000}/${span * 1000}`), since + span));
      for (const old of [...this.kept.keys()].slice(0, -KEPT)) this.kept.delete(old);
      this.failure.value = "";
    } catch (error) {
      this.failure.value = error.message;
      setTimeout(() => this.kept.delete(key), RETRY);
    }
    this.arrived.value += 1;
  }
}

/** Where the robot was: the last move at a moment. @param {Float32Array} moves @param {number} at @returns {number} its place in `moves`; -1: none */
export function moveAt(moves, at) {
  let [low, high] = [0, moves.length / FIELDS];
  while (low < high) { const middle = (low + high) >> 1; if (moves[middle * FIELDS] <= at) low = middle + 1; else high = middle; }
  return (low - 1) * FIELDS;
}

/** The places passed between two moments. @param {Excerpt[]} excerpts @param {number} from @param {number} to */
export function trail(excerpts, from, to) {
  const points = [];
  for (const { moves } of excerpts) for (let i = 0; i < moves.length; i += FIELDS) if (moves[i] >= from && moves[i] <= to) points.push([moves[i + 1], moves[i + 2]]);
  return points;
}
