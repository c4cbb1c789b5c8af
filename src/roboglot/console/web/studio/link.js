// The studio's socket: frames of block programs, debugging, checks, the log; opens again whenever it is lost.
import { signal } from "@preact/signals";
import { t } from "../base.js";
import { current } from "../link.js";
import { pulse } from "../pulse.js";

export const online = signal(/** @type {"opening" | "open" | "lost"} */ ("opening"));
export const opened = signal(/** @type {any} */ (null)); // what the server said of the robot
export const unopened = signal(""); // why the robot cannot be programmed, now
const RETRY = 1000, RETRY_MAX = 8000; // ms
let refusals = 0, retry = 0, shown = "";
let socket = /** @type {WebSocket | null} */ (null);
let next = 1;
const waiting = /** @type {Map<number | string, {resolve: (v: any) => void, reject: (e: Error) => void}>} */ (new Map());
const listeners = /** @type {Set<(message: any) => void>} */ (new Set());

/** Hear every message of the server. @param {(message: any) => void} listener */
export function listen(listener) { listeners.add(listener); return () => listeners.delete(listener); }

export function connect() {
  const made = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/studio`);
  socket = made;
  made.onopen = () => { online.value = "open"; beats.begin(); };
  made.onmessage = ({ data }) => receive(JSON.parse(data));
  made.onclose = () => {
    if (socket !== made) return;
    socket = null;
    made.close();
    beats.end();
    online.value = "lost";
    opened.value = null;
    clearTimeout(retry);
    for (const { reject } of waiting.values()) reject(new Error(t("link.lost")));
    waiting.clear();
    setTimeout(connect, RETRY);
  };
}

/** Say which robot is programmed, and which program is shown. @param {string} [program] */
export function open(program = shown) {
  shown = program;
  if (current.value) send({ type: "open", robot: current.value, program });
}

/** @param {object} message */
export function send(message) {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify(message));
  return true;
}

const beats = pulse(send, () => socket?.onclose?.(new CloseEvent("close")));

/** @param {number | string} key @param {object} message @returns {Promise<any>} */
function asked(key, message) {
  return new Promise((resolve, reject) => {
    waiting.set(key, { resolve, reject });
    if (!send(message)) { waiting.delete(key); reject(new Error(t("link.lost"))); }
  });
}

/** Ask the server something of ours; the answer has the same id. @param {object} message */
export function ask(message) { const id = next++; return asked(id, { ...message, id }); }

/** Send a frame as a front end does (2002); its first answer. @param {object} fields @returns {Promise<any>} */
export function frame(fields) {
  const id = `studio_${Date.now()}_${next++}`;
  return asked(id, { type: "frame", text: JSON.stringify({ ...fields, id }) });
}

/** Debug as on the door's /debug. @param {object} wish */
export async function debug(wish) { return JSON.parse((await ask({ type: "debug", text: JSON.stringify(wish) })).text); }

/** Whether the robot can be programmed; if not, ask again: programs may come after the page. @param {any} message */
function answered(message) {
  if (message.robot !== current.value) return false; // another was chosen meanwhile
  unopened.value = message.error ?? "";
  opened.value = message.error ? null : message;
  clearTimeout(retry);
  if (message.error) retry = window.setTimeout(() => open(), Math.min(RETRY * 2 ** refusals++, RETRY_MAX)); else refusals = 0;
  return !message.error;
}

/** @param {any} message */
function receive(message) {
  if (message.type === "pong") { beats.answered(message.at); return; }
  if (message.type === "opened" && !answered(message)) return;
  if (message.type === "frame") {
    const frame = JSON.parse(message.text);
    settle(frame.feedback?.id ?? frame.response?.id ?? "", frame);
    message = { type: "frame", frame };
  } else if (message.type === "refused") {
    const one = waiting.get(message.id);
    waiting.delete(message.id);
    one?.reject(new Error(message.why));
  } else if (message.id !== undefined) settle(message.id, message);
  for (const listener of listeners) listener(message);
}

function settle(key, value) {
  const one = waiting.get(key);
  if (one) { waiting.delete(key); one.resolve(value); }
}
