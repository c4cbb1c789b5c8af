// The socket to the runtime: the state of every robot, commands, its own age.
import { signal, computed, batch, effect } from "@preact/signals";
import { lacks, notice, person, rights, say, sent, t, kept } from "./base.js";
import { pulse } from "./pulse.js";

export const status = signal(/** @type {"opening" | "open" | "lost" | "out"} */ ("opening")); // out: a name is needed
export const me = signal({ name: "", asks: false, ended: false }); // who signed in here; whether names are asked for; whether the server ended that
export const age = signal(/** @type {number | null} */ (null)); // ms there and back; of an open question, since it was asked
export const connections = signal(0); // sockets opened so far: what a page fetched before may have ended
export const hello = signal(/** @type {any} */ (null));
export const you = signal("");
export const clock = signal(0); // robot time, s
export const states = signal(/** @type {Record<string, any>} */ ({}));
export const poses = signal(/** @type {Record<string, number[]>} */ ({}));
export const truth = signal(/** @type {any} */ (null));
export const scan = signal(/** @type {any} */ (null));
export const path = signal(/** @type {Float32Array} */ (new Float32Array()));
export const grid = signal(/** @type {any} */ (null));
export const exchanges = signal(/** @type {any[][]} */ ([]));
export const seen = signal(/** @type {any[][]} */ ([])); // what the camera makes out
export const pace = signal({ paused: false, speed: 1, lockstep: false, seed: 1, behind: 0 });
export const missed = signal(0);
export const recording = signal(false);
export const padRefused = signal("");

export const chosen = kept("robot", "");
if (sent.has("robot")) { // by the fleet's page; after a reload the choice counts that was made since
  chosen.value = String(sent.get("robot"));
  history.replaceState(null, "", location.pathname + location.hash);
}
export const current = computed(() => {
  const robots = hello.value?.robots ?? [];
  return robots.some((r) => r.name === chosen.value) ? chosen.value : robots[0]?.name ?? "";
});
export const state = computed(() => states.value[current.value] ?? null);
export const stale = computed(() => status.value === "lost" || Boolean(state.value?.faults?.some((f) => f.name === "link lost"))); // the values are old
export const simulated = computed(() => Boolean(hello.value?.robots.find((r) => r.name === current.value)?.simulated));
export const TEACHER = "console teacher"; // a role: who locked the robots of a class
effect(() => {
  const robot = hello.value?.robots.find((r) => r.name === current.value);
  rights.value = { mine: robot ? [...robot.rights, ...(hello.value.all ? ["all"] : [])] : null, needs: hello.value?.needs ?? {}, absent: state.value?.absent ?? [], locked: !hello.value?.teacher && state.value?.control.taken_by === TEACHER };
});
export const wanted = signal({ wire: false, truth: false, seen: false, moving: true }); // moving: at the rate of a map that is drawn

const KEPT_MAX = 20_000; // exchanges
const RETRY = 1000; // ms
let socket = /** @type {WebSocket | null} */ (null);
const REVOKED = 1008; // the code with which a socket is closed when its person's rights change
let next = 1, sequence = 0, server = { now: 0, at: 0 };
const waiting = /** @type {Map<number, {resolve: (v: any) => void, reject: (e: Error) => void}>} */ (new Map());

/** Whether this browser may open the socket: it needs no name here, or has one. Fails without a connection. */
async function admitted() {
  const reply = await fetch("/api/me");
  if (reply.status === 401) return false;
  if (!reply.ok) throw new Error();
  me.value = { ...await reply.json(), ended: false };
  return true;
}

/** Open the socket, and again whenever it is lost. */
export async function connect() {
  try {
    if (!await admitted()) { batch(() => { status.value = "out"; hello.value = null; me.value = { name: "", asks: true, ended: Boolean(me.value.name) }; }); return; }
  } catch { status.value = "lost"; setTimeout(connect, RETRY); return; }
  const opened = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
  socket = opened;
  opened.binaryType = "arraybuffer";
  opened.onopen = () => {
    batch(() => { status.value = "open"; connections.value += 1; exchanges.value = []; missed.value = 0; truth.value = null; }); // they come again, whole
    introduce(); watch(); beats.begin();
  };
  opened.onmessage = ({ data }) => (typeof data === "string" ? receive(JSON.parse(data)) : receiveFrame(data));
  opened.onclose = ({ code }) => {
    if (socket !== opened) return;
    socket = null;
    opened.close();
    beats.end();
    batch(() => { status.value = "lost"; age.value = null; });
    for (const { reject } of waiting.values()) reject(new Error(t("link.lost")));
    waiting.clear();
    if (code === REVOKED) say(t("rights.changed"), true);
    setTimeout(connect, code === REVOKED ? 0 : RETRY);
  };
}

/** Forget who signed in here; the page asks for a name again. */
export async function signOut() {
  await fetch("/api/sign_out", { method: "POST" });
  me.value = { ...me.value, name: "" }; // it was wished
  socket?.close();
}

/** @param {object} message */
function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

export function introduce() { send({ type: "hello", name: person.value }); }

export function watch() {
  if (current.value) send({ type: "watch", robot: current.value, ...wanted.value });
}

let drawn = ""; // the robot that scan, map, path and wire are of
effect(() => {
  const now = current.value;
  if (!now || now === drawn) return;
  const left = drawn;
  if (left && !hello.value.robots.some((r) => r.name === left)) say(t("notice.gone", { name: left, now }), true);
  if (left) batch(() => { scan.value = null; grid.value = null; path.value = new Float32Array(); exchanges.value = []; seen.value = []; });
  drawn = now;
});

/** Show another robot. @param {string} name */
export function choose(name) {
  if (name === current.value) return;
  chosen.value = name;
  watch();
}

/** @param {Partial<typeof wanted.value>} change */
export function want(change) {
  const now = { ...wanted.value, ...change };
  if (JSON.stringify(now) === JSON.stringify(wanted.value)) return;
  if (!now.truth) truth.value = null; // it would grow old
  wanted.value = now;
  watch();
}

const beats = pulse(send, () => socket?.onclose?.(new CloseEvent("close")), (ms) => { age.value = ms; });

/** Have a robot (empty: the world) do something; the answer, or an Error in plain words.
 * @param {string} robot @param {string} verb @param {object} [values] @returns {Promise<any>} */
export function ask(robot, verb, values = {}) {
  if (socket?.readyState !== WebSocket.OPEN) return Promise.reject(new Error(t("link.lost")));
  const id = next++;
  send({ type: "do", id, robot, verb, values });
  return new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
}

/** The same for the robot that is shown; what is refused is said. @param {string} verb @param {object} [values] */
export async function command(verb, values = {}, robot = current.value) {
  if (lacks(verb)) return void say(lacks(verb), true);
  try { return await ask(robot, verb, values); } catch (error) { say(t("refused", { why: error.message }), true); return undefined; }
}

let stopFirst = false;
/** Stop the robot that is shown; before the first greeting: with it. */
export function stopRobot() {
  if (hello.value || status.value === "out") return command("stop");
  stopFirst = true;
}

/** @param {string} verb @param {object} [values] */
export const changeWorld = (verb, values) => command(verb, values, "");

/** Drive by hand: shares of the top speeds. The server brakes when this falls silent.
 * @param {number} x @param {number} y @param {number} yaw */
export function drive(x, y, yaw) {
  if (status.value !== "open") { // a held pad asks ten times a second: the reason stays
    if ((x || y || yaw) && !notice.value.bad) say(t("refused", { why: t("link.lost") }), true);
    return;
  }
  const stamp = server.now + performance.now() - server.at;
  send({ type: "drive", robot: current.value, seq: ++sequence, stamp, x, y, yaw });
}

/** @param {typeof pace.value} now */
function steer(now) {
  if (JSON.stringify(now) !== JSON.stringify(pace.value)) pace.value = now;
}

/** @param {any} message */
function receive(message) {
  if (message.now !== undefined) server = { now: message.now, at: performance.now() };
  switch (message.type) {
    case "hello":
      batch(() => { hello.value = message; states.value = {}; pace.value = message.pace; });
      watch();
      if (stopFirst) stopRobot();
      stopFirst = false;
      break;
    case "you": you.value = message.client; break;
    case "pong": beats.answered(message.at); break;
    case "moment":
      batch(() => { clock.value = message.time; poses.value = Object.fromEntries(Object.entries(message.poses).filter(([, p]) => p[0] !== null)); recording.value = message.recording; if (message.truth) truth.value = message.truth; steer(message.pace); });
      break;
    case "state": {
      const known = states.value[message.robot], [last] = message.state.history ?? [];
      states.value = { ...states.value, [message.robot]: { ...known, ...message.state } };
      if (known && last?.status === "ABORTED" && last.client === you.value) say(message.robot === current.value ? last.reason : t("notice.robot", { name: message.robot, why: last.reason }), true);
      break;
    }
    case "seen":
      if (message.robot === current.value) seen.value = message.boxes;
      break;
    case "wire":
      batch(() => {
        if (message.robot === current.value) exchanges.value = [...exchanges.value, ...message.rows].slice(-KEPT_MAX);
        missed.value += message.skipped;
      });
      break;
    case "pad":
      padRefused.value = message.refused;
      if (message.refused) say(t("refused", { why: message.refused }), true);
      break;
    case "done": {
      const one = waiting.get(message.id);
      waiting.delete(message.id);
      if (message.error) one?.reject(new Error(message.error)); else one?.resolve(message.result ?? null);
    }
  }
}

/** A frame's head and what follows it. @param {ArrayBuffer} data */
export function opened(data) {
  const length = new DataView(data).getUint16(0, true);
  return { head: JSON.parse(new TextDecoder().decode(new Uint8Array(data, 2, length))), payload: data.slice(2 + length) };
}

/** A map with its cells. @param {any} head @param {ArrayBuffer} payload */
export async function mapped(head, payload) {
  const stream = new Blob([payload]).stream().pipeThrough(new DecompressionStream("deflate"));
  return { ...head, cells: new Uint8Array(await new Response(stream).arrayBuffer()) };
}

/** @param {ArrayBuffer} data */
async function receiveFrame(data) {
  const { head, payload } = opened(data);
  if (head.robot !== current.value) return;
  if (head.kind === "scan") scan.value = { ...head, ranges: new Uint16Array(payload) };
  else if (head.kind === "path") path.value = new Float32Array(payload);
  else if (head.kind === "map") grid.value = await mapped(head, payload);
}
