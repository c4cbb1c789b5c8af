// What every view is made of: the template tag, icons, words in the language chosen, what the browser remembers.
import { h } from "preact";
import htm from "htm";
import { signal, effect } from "@preact/signals";

export const html = htm.bind(h);

/** Keep a choice in the browser; without storage it lasts as long as the page. What does not fit is not ours.
 * @param {string} key @param {string} fallback @param {RegExp} [fits] */
export function kept(key, fallback, fits = /^/) {
  let start = fallback;
  try { start = localStorage.getItem(key) ?? fallback; } catch { /* no storage here */ }
  if (!fits.test(start)) start = fallback;
  const choice = signal(start);
  effect(() => { const now = choice.value; try { localStorage.setItem(key, now); } catch { /* as above */ } });
  return choice;
}

const PREFERRED = (navigator.languages ?? [navigator.language]).some((l) => /^zh/i.test(l)) ? "zh" : "en";
export const language = kept("language", PREFERRED, /^(en|zh)$/);
export const theme = kept("theme", matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark", /^(light|dark)$/);
export const person = kept("person", `guest-${Math.random().toString(36).slice(2, 6)}`, /^.{1,40}$/);

/** The studio of the world that a pupil is sent to, in the same language. @param {{page?: string, elsewhere?: string, code: string, name: string}} given */
export function elsewhere(given) {
  const there = new URL("/studio/", given.page ?? given.elsewhere);
  if (/^(0\.0\.0\.0|\[::\])$/.test(there.hostname)) there.hostname = location.hostname; // it listens on all addresses
  there.search = String(new URLSearchParams({ class: given.code, name: given.name, language: language.value, theme: theme.value }));
  return there.href;
}
export const sent = new URLSearchParams(location.search); // by it
if (/^(en|zh)$/.test(sent.get("language") ?? "")) language.value = String(sent.get("language"));
if (/^(light|dark)$/.test(sent.get("theme") ?? "")) theme.value = String(sent.get("theme"));

/** @type {import("@preact/signals").Signal<Record<string, Record<string, string>>>} */
const words = signal({});

const folders = /** @type {string[]} */ (["/words"]);

/** Load a language's words once. @param {string} name */
async function loadLanguage(name) {
  if (words.value[name]) return;
  const parts = await Promise.all(folders.map((folder) => fetch(`${folder}/${name}.json`).then((r) => r.json())));
  words.value = { ...words.value, [name]: Object.assign({}, ...parts) };
}

/** Load the words of the language chosen from these folders; another language's when it is chosen. @param {...string} from */
export async function loadWords(...from) {
  if (from.length) folders.splice(0, folders.length, ...from);
  await loadLanguage(language.value);
  effect(() => { loadLanguage(language.value).catch(() => {}); });
}

/** The words of the language chosen; those before it until they are there. */
const spoken = () => words.value[language.value] ?? Object.values(words.value)[0] ?? {};

/** What stands behind a prefix in the keys that there are. @param {string} prefix */
export const keysUnder = (prefix) => Object.keys(spoken()).filter((key) => key.startsWith(prefix)).map((key) => key.slice(prefix.length));

/** The sentence under a key, with {names} filled in; ``why`` is the server's. @param {string} key @param {Record<string, unknown>} [values] */
export function t(key, values = {}) {
  const text = spoken()[key] ?? key;
  return text.replace(/\{(\w+)\}/g, (_, name) => (name === "why" ? translated(String(values.why ?? "")) : String(values[name] ?? "")));
}

/** The server's sentences: pieces of the English between gaps, and the Chinese, most words first. */
const sentences = signal(/** @type {[string[], string][]} */ ([]));
const SOON = 1500; // ms after the page
effect(() => { if (language.value === "zh") setTimeout(learn, SOON); });

async function learn() {
  if (sentences.peek().length) return;
  const known = /** @type {[string, string][]} */ (Object.entries(await fetch("/words/server.zh.json").then((r) => r.json(), () => ({}))));
  sentences.value = known.map(([en, zh]) => /** @type {[string[], string]} */ ([en.split("{}"), zh])).sort(([a], [b]) => b.join("").length - a.join("").length);
}

/** What fills the gaps; null if it is another sentence. @param {string[]} pieces @param {string} text */
function gaps([first, ...rest], text) {
  if (!rest.length) return text === first ? [] : null;
  const last = /** @type {string} */ (rest.pop()), found = [];
  let at = first.length;
  if (!text.startsWith(first) || !text.endsWith(last)) return null;
  for (const piece of rest) {
    const next = text.indexOf(piece, at);
    if (next < 0) return null;
    found.push(text.slice(at, next));
    at = next + piece.length;
  }
  if (text.length - last.length < at) return null;
  found.push(text.slice(at, text.length - last.length));
  return found.some((gap) => /[.!?] [A-Z]/.test(gap)) ? null : found;
}

/** A sentence of the server's in the language chosen, if it is known. @param {string} text @returns {string} */
export function translated(text) {
  if (language.value !== "zh" || !/[a-z]{2}/.test(text)) return text;
  for (const [pieces, zh] of sentences.value) {
    const found = gaps(pieces, text);
    if (found) return zh.replace(/\{(\d)\}/g, (_, i) => robotWord(found[i]));
  }
  const parts = text.split(/(?<=[.!?]) (?=\w)|(?=; \w)/);
  return parts[1] ? parts.map(translated).join("") : text;
}

/** A word of the robot's own (a status, a stage, a fault) where we know it in this language; else what is known of the server.
 * @param {string} word @returns {string} */
export function robotWord(word) {
  return spoken()[`robot.${word}`] ?? spoken()[`studio.state.${word}`] ?? translated(word);
}

/** What a robot does: the progress of its order, else its newest action; empty: nothing. @param {any} state */
export const doing = (state) => robotWord(state?.orders?.list[0]?.doing || state?.actions.at(-1)?.name || "");

effect(() => {
  document.documentElement.lang = language.value === "zh" ? "zh-CN" : "en";
  document.documentElement.dataset.theme = theme.value;
});

/** @type {Record<string, string>} */
export const PATHS = {
  map: "M3 6l6-2 6 2 6-2v14l-6 2-6-2-6 2zM9 4v14M15 6v14",
  wire: "M4 7h13l-3-3M20 17H7l3 3",
  world: "M12 3a9 9 0 100 18 9 9 0 000-18M3 12h18M12 3c3 3 3 15 0 18M12 3c-3 3-3 15 0 18",
  robots: "M4 5h7v6H4zM13 5h7v6h-7zM4 13h7v6H4zM13 13h7v6h-7z",
  goal: "M12 21s7-6.5 7-11.5A7 7 0 005 9.5C5 14.5 12 21 12 21zM12 12a2.5 2.5 0 100-5 2.5 2.5 0 000 5",
  route: "M5 19a2 2 0 100-4 2 2 0 000 4zM19 9a2 2 0 100-4 2 2 0 000 4zM7 17h8a3 3 0 000-6H9a3 3 0 010-6h8",
  hand: "M12 3v18M3 12h18M12 3l-3 3M12 3l3 3M12 21l-3-3M12 21l3-3M3 12l3-3M3 12l3 3M21 12l-3-3M21 12l-3 3",
  ruler: "M3 15L15 3l6 6L9 21zM7 11l2 2M10 8l3 3M13 5l2 2",
  follow: "M12 8a4 4 0 100 8 4 4 0 000-8M12 2v4M12 18v4M2 12h4M18 12h4",
  fit: "M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",
  plus: "M12 5v14M5 12h14", minus: "M5 12h14",
  eye: "M2 12s4-7 10-7 10 7 10 7-4 7-10 7S2 12 2 12zM12 15a3 3 0 100-6 3 3 0 000 6",
  sun: "M12 8a4 4 0 100 8 4 4 0 000-8M12 2v2M12 20v2M2 12h2M20 12h2M5 5l1.5 1.5M17.5 17.5L19 19M5 19l1.5-1.5M17.5 6.5L19 5",
  moon: "M20 14A8 8 0 0110 4a8 8 0 1010 10z",
  battery: "M3 8h15v8H3zM21 11v2", bolt: "M13 3L5 14h6l-1 7 8-11h-6z",
  dock: "M5 20V9l7-5 7 5v11M9 20v-6h6v6", copy: "M9 9h11v11H9zM5 15H4V4h11v1", pause: "M8 5v14M16 5v14",
  play: "M7 4l12 8-12 8z", box: "M4 8l8-4 8 4v8l-8 4-8-4zM4 8l8 4 8-4M12 12v8", person: "M12 11a4 4 0 100-8 4 4 0 000 8M4 21c0-5 3-8 8-8s8 3 8 8",
  place: "M6 21V4M6 4h12l-3 4 3 4H6", wall: "M4 20L20 4", stop: "M6 6h12v12H6z", alert: "M12 3l10 18H2zM12 10v5M12 18v.5",
  clock: "M12 3a9 9 0 100 18 9 9 0 000-18M12 7v5l4 2", keys: "M3 6h18v12H3zM7 10h.5M11 10h.5M15 10h.5M7 14h10", dot: "M12 6a6 6 0 100 12 6 6 0 000-12", blocks: "M4 4h7v3h3V4h6v7h-3v3h3v6H4z",
  school: "M3 9l9-5 9 5-9 5zM7 11v5c3 2 7 2 10 0v-5",
  leave: "M14 4h6v16h-6M15 12H4M8 8l-4 4 4 4",
  move: "M12 3a9 9 0 100 18 9 9 0 000-18M12 12l4-4",
};

/** @param {{name: string, size?: number}} props */
export function Icon({ name, size = 20 }) {
  return html`<svg class="icon" width=${size} height=${size} viewBox="0 0 24 24" aria-hidden="true"><path d=${PATHS[name]} /></svg>`;
}

/** What the person at the page may do with the robot that is shown, which right each verb needs, which it has no part for. */
export const rights = signal(/** @type {{mine: string[] | null, needs: Record<string, string>, absent: string[], locked?: boolean}} */ ({ mine: null, needs: {}, absent: [] }));
export const can = (/** @type {string} */ verb) => !rights.value.absent.includes(verb);

/** Why a verb is not for this person, in words; empty: it is. A locked robot may be stopped, and programs that move nothing run. @param {string} [verb] */
export function lacks(verb) {
  const { mine, needs, locked } = rights.value;
  const right = verb ? needs[verb] : undefined;
  if (!verb || !right || !mine) return "";
  if (mine.includes(right)) return locked && right !== "see" && !/^(stop|program)$/.test(verb) ? t("right.locked") : "";
  return t("right.missing", { right: t(`right.${right}`) });
}

/** A button; `on` shows that it is chosen; `verb` is what it has done: it is off without the right to that, or for another `why`, and says so;
 * not there without the part; `of` is what it is about, for those who do not see the row. @param {any} props */
export function Button({ label, of = "", icon, on, verb, why = lacks(verb), kind = "", compact = false, children, ...rest }) {
  if (!can(verb)) return null;
  const toggles = on === undefined ? {} : { "aria-pressed": String(Boolean(on)) };
  const name = compact ? { "aria-label": label, title: label } : of ? { "aria-label": `${label}: ${of}` } : {};
  if (why) Object.assign(rest, { type: "button", "aria-disabled": "true", title: why, onClick: () => say(why, true) });
  return html`<button type="button" class=${`button ${kind} ${compact ? "compact" : ""}`} ...${toggles} ...${name} ...${rest}>
    ${icon && html`<${Icon} name=${icon} />`}${!compact && html`<span>${label}</span>`}${children}</button>`;
}

/** @type {import("@preact/signals").Signal<{text: string, bad: boolean}>} */
export const notice = signal({ text: "", bad: false });
let fading = 0;

/** Say something at the foot of the page for a while. @param {string} text @param {boolean} [bad] */
export function say(text, bad = false) {
  notice.value = { text: translated(text), bad };
  clearTimeout(fading);
  fading = window.setTimeout(() => { notice.value = { text: "", bad: false }; }, bad ? 8000 : 3500);
}

/** Ask the server something over HTTP, or wish something of it; its words, or an Error in plain words.
 * @param {string} path @param {object} [wish] */
export async function fetched(path, wish) {
  const reply = await fetch(path, wish ? { method: "POST", body: JSON.stringify(wish) } : {}).catch(() => { throw new Error(t("link.lost")); });
  const kind = reply.headers.get("content-type") ?? "";
  const words = await (/json/.test(kind) ? reply.json() : /octet/.test(kind) ? reply.arrayBuffer() : reply.text());
  if (!reply.ok) throw new Error(words.error ?? reply.statusText);
  return words;
}

/** A number of so many digits, which is never -0. @param {number} n */
export const fixed = (n, digits = 2) => (Number(n.toFixed(digits)) || 0).toFixed(digits);

/** The place of the page, without the word that it loads. */
export function place() {
  const found = /** @type {HTMLElement} */ (document.getElementById("app"));
  found.replaceChildren();
  return found;
}

/** Seconds as people say them. @param {number} seconds */
export function duration(seconds) {
  if (seconds >= 3600) return t("time.hours", { h: Math.floor(seconds / 3600), m: Math.floor((seconds % 3600) / 60) });
  if (seconds >= 60) return t("time.minutes", { m: Math.floor(seconds / 60), s: Math.floor(seconds % 60) });
  return t("time.seconds", { s: seconds.toFixed(seconds < 10 ? 1 : 0) });
}
