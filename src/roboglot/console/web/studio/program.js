// The program that is open: its name, whether it is blocks or text, where it is kept, its versions, files.
import { signal } from "@preact/signals";
import { kept, say, t } from "../base.js";
import { saveAs } from "../copies.js";
import * as editor from "./editor.js";
import { newId } from "./blocks.js";
import { ask, frame, opened } from "./link.js";

const PREFIX = "studio.program.", VERSIONS_MAX = 20, VERSION_EVERY = 60_000, SAVE_AFTER = 1500; // ms
const FILE_MAX = 4_000_000, TEXT_MAX = 262_144, BLOCKS_MAX = 6000, NAME_MAX = 60, PARTED = 12; // bytes; characters; blocks of a file; characters
export const body = signal(""); // of a program that is text
const opening = /** @type {any} */ (read(kept("studio.last", "").value));
export const program = signal(/** @type {{id: string, name: string, kind: "blocks" | "text", lesson?: string, module?: string}} */ (
  opening ? pick(opening) : { id: `s${newIdSafe()}`, name: "", kind: "blocks" }));
export const stored = signal(/** @type {"" | "browser" | "robot"} */ (""));
export const listed = signal(/** @type {any[]} */ ([]));
const last = kept("studio.last", "");
const UNSENT = "studio.unsent"; // ids of programs that the robot does not have as they stand here

function newIdSafe() { return Math.random().toString(36).slice(2, 12); }
function pick({ id, name, kind, lesson, module }) { return { id, name, kind, lesson, module }; }
function read(id) { try { const found = JSON.parse(localStorage.getItem(PREFIX + id) ?? "null"); return found?.id === id ? found : null; } catch { return null; } }

/** The Python of the program, whatever it is made of. */
export const python = () => (program.value.kind === "blocks" ? editor.code.value : body.value);
const style = () => JSON.stringify(program.value.kind === "blocks" ? editor.save() : { roboglot: { kind: "text" } });

/** Everything of the program, for the browser and files. */
export function whole() {
  return { ...program.value, style: program.value.kind === "blocks" ? editor.save() : null, body: python(), saved: Date.now() };
}

/** Show what was there when the page was closed. */
export function restore() {
  const found = read(program.value.id);
  if (!found) return;
  if (found.kind === "text") body.value = String(found.body ?? "");
  else if (found.style) {
    try { editor.load(found.style); } catch (error) { // the blocks stay in the browser as they are
      program.value = { ...program.value, id: `s${newIdSafe()}` };
      asText(String(found.body ?? ""));
      say(t("studio.open.text", { why: error.message }), true);
    }
  }
}

addEventListener("storage", ({ key, newValue }) => { // another tab of this browser changed it
  if (key !== PREFIX + program.value.id || !newValue) return;
  program.value = pick(JSON.parse(newValue));
  restore();
});

let timer = 0;
const versionAt = /** @type {Map<string, number>} */ (new Map()); // by program: when its newest version was kept
/** Something was changed: keep it in the browser at once, on the robot soon. */
export function changed() {
  keep();
  note(program.value.id, true);
  clearTimeout(timer);
  timer = window.setTimeout(() => saveToRobot(), SAVE_AFTER);
}

const unsent = () => { try { return JSON.parse(localStorage.getItem(UNSENT) ?? "[]"); } catch { return []; } };
/** @param {string} id @param {boolean} due */
function note(id, due) {
  const others = unsent().filter((/** @type {string} */ one) => one !== id);
  try { localStorage.setItem(UNSENT, JSON.stringify(due ? [...others, id] : others)); } catch { /* full: keep() says so */ }
}

function keep() {
  const now = whole();
  last.value = now.id;
  try {
    localStorage.setItem(PREFIX + now.id, JSON.stringify(now));
    stored.value = "browser";
    if (!versionAt.has(now.id)) versionAt.set(now.id, versions()[0]?.saved ?? 0);
    if (now.saved - (versionAt.get(now.id) ?? 0) > VERSION_EVERY) keepVersion(now);
  } catch { say(t("studio.storage.full"), true); }
}

/** @param {any} now as ``whole`` makes it */
function keepVersion(now) {
  const old = versions();
  if (!now.body.trim() || (old[0]?.body === now.body && old[0].name === now.name)) return;
  versionAt.set(now.id, now.saved);
  localStorage.setItem(`studio.versions.${now.id}`, JSON.stringify([now, ...old].slice(0, VERSIONS_MAX)));
}

/** Back to an earlier version; what was there until now is a version, too. @param {any} version */
export function back(version) {
  try { keepVersion(whole()); } catch { say(t("studio.storage.full"), true); return; }
  show(version);
  changed();
}

export function versions() { try { return [...JSON.parse(localStorage.getItem(`studio.versions.${program.value.id}`) ?? "[]")]; } catch { return []; } }

/** The name of a program that was given none: of several on a robot the later ones have a number. @param {string} id */
export function unnamed(id) {
  const plain = t("studio.untitled"), own = listed.value.find((one) => one.id === id)?.describe;
  if (own?.startsWith(plain)) return own;
  const taken = new Set(listed.value.map((one) => one.describe));
  let name = plain;
  for (let n = 2; taken.has(name); n++) name = `${plain} ${n}`;
  return name;
}

const described = (/** @type {{name: string, id: string}} */ of) => (of.name || unnamed(of.id)).replaceAll('"""', "'");
/** Save a program; under another id, which ``of`` then has, if it would overwrite another page's. @param {any} [of] as ``whole`` makes it */
export async function saveFrame(of = whole()) {
  const made = of.id === program.value.id ? style() : JSON.stringify(of.style ?? { roboglot: { kind: "text" } });
  await part(of, made);
  shared(of.id, of.body, made); // first: another save may look before this one is answered
  return frame({ type: "task", operate: "save", target_id: [of.id], describe: described(of), style: made, mode: "single", condition: "now", body: of.body });
}

const SHARED_MAX = 8; // newest forms of a program that this browser has read from a robot, or sent to it
const sharedHere = /** @type {Record<string, string[]>} */ ({ __proto__: null }); // where nothing can be kept
const placeOf = (/** @type {string} */ id) => `studio.shared.${opened.value?.robot ?? ""}.${id}`;
/** A short form of a program, to compare. @param {string} code @param {string} made */
function mark(code, made) {
  let sum = 0;
  for (const text of [code, made]) for (let i = 0; i < text.length; i++) sum = (Math.imul(sum, 31) + text.charCodeAt(i)) | 0;
  return `${code.length}.${made.length}.${sum}`;
}
/** @param {string} id @returns {string[]} */
function known(id) { try { return JSON.parse(localStorage.getItem(placeOf(id)) ?? "[]"); } catch { return sharedHere[placeOf(id)] ?? []; } }
/** The robot has it in this form. @param {string} id @param {string} code @param {string} made */
function shared(id, code, made) {
  const now = [mark(code, made), ...known(id)].slice(0, SHARED_MAX);
  sharedHere[placeOf(id)] = now;
  try { localStorage.setItem(placeOf(id), JSON.stringify(now)); } catch { /* as long as the page */ }
}

/** Give a program that someone else has changed on the robot an id and a name of its own. @param {any} of @param {string} made */
async function part(of, made) {
  const forms = known(of.id);
  if (!forms.length) return; // never there
  const { program: found } = await ask({ type: "fetch", program: of.id, log: false });
  if (!found || [...forms, mark(of.body, made)].includes(mark(found.body, found.style))) return;
  const { id } = of, name = t("studio.parted.name", { name: described(of).slice(0, NAME_MAX - PARTED) });
  Object.assign(of, { id: `s${newIdSafe()}`, name });
  note(id, false);
  if (id === program.value.id) { program.value = { ...program.value, id: of.id, name }; keep(); } else localStorage.setItem(PREFIX + of.id, JSON.stringify(of));
  note(of.id, true);
  say(t("studio.parted", { name }), true);
}

/** Whether the robot has exactly this program, and it is right: then it need not be saved and checked before it runs. */
export async function isStored() {
  const { program: found } = await ask({ type: "fetch", program: program.value.id, log: false });
  return Boolean(found) && found.describe === described(program.value) && found.body === python() && found.style === style() && found.state !== "error" && found.mode === "single" && found.condition === "now";
}

/** Save what is about to run; the save that its last change has waiting is then not needed. */
export async function saveNow() {
  const of = whole(), drawn = style(), due = timer;
  clearTimeout(due);
  const saved = await saveFrame(of).catch((error) => { if (timer === due) timer = window.setTimeout(() => saveToRobot(), SAVE_AFTER); throw error; });
  if (program.value.id !== of.id || python() !== of.body || style() !== drawn) return saved; // changed meanwhile: that has its own save
  if (!saved.feedback.state) { note(of.id, false); stored.value = "robot"; }
  return saved;
}

async function saveToRobot(of = whole()) {
  if (!opened.value) return; // handed over when the robot is there
  if (!of.body.trim() || of.module) { note(of.id, false); return; } // a module is kept by its own menu
  try {
    const { feedback } = await saveFrame(of);
    if (feedback.state !== 0 && feedback.state !== 23) return; // what is wrong is kept, too
    const now = read(of.id);
    if (now && now.saved > of.saved && now.body !== of.body) return; // changed again meanwhile
    note(of.id, false);
    if (of.id === program.value.id) stored.value = "robot";
  } catch { /* the browser has it */ }
}

/** Keep it now, as a person is used to ask for, and say where. */
export async function keepNow() {
  keep();
  note(program.value.id, true);
  clearTimeout(timer);
  await saveToRobot();
  if (stored.value) say(t(`studio.stored.${stored.value}`));
}

/** Hand over what was written while the robot was away, or while the program ran. */
export async function handOver() {
  for (const id of unsent()) {
    if (id !== program.value.id && opened.value?.running.includes(id)) continue; // once it has ended
    const of = id === program.value.id ? whole() : read(id);
    if (of) await saveToRobot(of); else note(id, false);
  }
}

/** @param {Partial<{name: string, lesson: string}>} change */
export function rename(change) { program.value = { ...program.value, ...change }; changed(); }

export function fresh(/** @type {"blocks" | "text"} */ kind = "blocks", /** @type {any} */ more = {}) {
  program.value = { id: `s${newIdSafe()}`, name: "", kind, ...more };
  body.value = "";
  editor.clear();
  stored.value = "";
  last.value = program.value.id;
}

/** @param {{id?: string, name?: string, kind?: string, style?: any, body?: string, lesson?: string, module?: string}} given */
export function show(given) {
  const { style: made } = given, empty = given.kind === "blocks" && !given.body; // blocks that are none yet
  const kind = empty || (given.kind !== "text" && made && (made.blocks || made.variables)) ? "blocks" : "text";
  program.value = { id: given.id ?? `s${newIdSafe()}`, name: given.name ?? "", kind, lesson: given.lesson, module: given.module };
  if (kind === "blocks") { body.value = ""; try { editor.load(given.style ?? {}); } catch (error) { asText(given.body ?? ""); say(t("studio.open.text", { why: error.message }), true); } }
  else asText(given.body ?? "");
  stored.value = "";
  keep();
}

function asText(text) { program.value = { ...program.value, kind: "text" }; body.value = text; editor.clear(); }

/** From the library of the robot. @param {string} id */
export async function openStored(id) {
  const { program: found } = await ask({ type: "fetch", program: id });
  if (!found) throw new Error(t("studio.gone"));
  let made = null;
  try { made = JSON.parse(found.style); } catch { /* the app's or another front end's */ }
  const blocks = made && made.blocks && Array.isArray(made.blocks.blocks) && made.blocks.blocks.length;
  shared(id, found.body, found.style);
  show({ id, name: found.describe, kind: blocks ? "blocks" : "text", style: made, body: found.body });
  stored.value = "robot";
}

/** The tasks and modules on the robot. */
export async function list() {
  const [tasks, modules] = await Promise.all(["task", "module"].map((type) => frame({ type, operate: "inquiry", target_id: [] })));
  listed.value = tasks.response.list;
  editor.modules.value = modules.response.list;
  return listed.value;
}

export async function remove(id) {
  const { feedback } = await frame({ type: "task", operate: "delete", target_id: [id] });
  if (feedback.state) say(feedback.describe, true);
  await list();
}

/** Write a file. @param {"json" | "py" | "style"} form */
export function download(form) {
  const name = (program.value.name || t("studio.untitled")).replace(/[^\p{L}\p{N}_-]+/gu, "_");
  const text = form === "py" ? plain(python()) : form === "style" ? style() : JSON.stringify(whole(), null, 1);
  saveAs(new Blob([text], { type: form === "py" ? "text/x-python" : "application/json" }), `${name}.${form === "py" ? "py" : form === "style" ? "style.json" : "roboglot.json"}`);
}

/** Read a file: our own, the app's style, or Python. @param {File} file */
export async function upload(file) {
  if (file.size > FILE_MAX) throw new Error(t("studio.file.large"));
  const text = await file.text(), name = file.name.replace(/\.(roboglot\.|style\.)?(json|py|txt)$/i, "").slice(0, NAME_MAX);
  if (text.includes("\0")) throw new Error(t("studio.file.other"));
  if (/\.(py|txt)$/i.test(file.name)) { if (text.length > TEXT_MAX) throw new Error(t("studio.file.large")); show({ name, kind: "text", body: text }); say(t("studio.open.python")); changed(); return; }
  const { made, named, kind, code } = contents(text);
  if ((JSON.stringify(made ?? null).match(/"type":/g) ?? []).length > BLOCKS_MAX || code.length > TEXT_MAX) throw new Error(t("studio.file.large"));
  show({ name: named || name, kind, style: made, body: code });
  if (kind === "text" || !made) say(t("studio.open.python"));
  changed();
}

/** Blocks and text of a JSON file. @param {string} text @returns {{made: any, named: string, kind: string | undefined, code: string}} */
function contents(text) {
  try {
    const found = JSON.parse(text), made = found.blocks ? found : typeof found.style === "string" ? JSON.parse(found.style) : found.style;
    if (!made && typeof found.body !== "string") throw new TypeError("it has neither");
    return { made, named: String(found.name ?? found.describe ?? "").slice(0, NAME_MAX), kind: found.kind, code: String(found.body ?? "") };
  } catch { throw new Error(t("studio.file.other")); }
}

/** Blocks become text for good. */
export function continueAsText() { const text = plain(editor.code.value); fresh("text", { name: program.value.name, lesson: program.value.lesson }); body.value = text; changed(); }

/** Python without the marks of blocks. @param {string} code */
export const plain = (code) => code.replace(/^[ \t]*cyberdog\.task\.block\('[0-9A-Za-z]+'\)\n/gm, "");

export const marks = signal(false); // whether the page shows the lines that mark blocks
/** The number that the page shows at a line of the program. @param {{line: number, module: string}} at @param {string} code of the program */
export function lineShown({ line, module }, code) {
  if (module || marks.value || program.value.kind !== "blocks") return line;
  return line - code.split("\n").slice(0, line).filter((row) => row.trim().startsWith("cyberdog.task.block('")).length;
}
/** An error's own words, with its line as the page counts. @param {string} text @param {{line: number, module: string}} at @param {string} code of the program */
export const withLineShown = (text, at, code) => text.replace(/ \((module \w+, )?line \d+: /, (_, module = "") => ` (${module}${t("studio.line", { n: lineShown(at, code) })}: `);
