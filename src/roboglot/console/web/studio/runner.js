// Running a program on the robot: run, pause, step, stop; which block is lit, what was printed, read, and went wrong.
import { computed, effect, signal, untracked } from "@preact/signals";
import { lacks, language, notice, say, t, translated } from "../base.js";
import { stopRobot } from "../link.js";
import { blocksOfLines } from "./blocks.js";
import * as bubbles from "./bubbles.js";
import * as editor from "./editor.js";
import { ask, debug, frame, listen, online, opened, unopened } from "./link.js";
import { learn, ownerOf } from "./modules.js";
import { isStored, program, python, saveNow, withLineShown } from "./program.js";

const LINES_MAX = 500, READINGS_MAX = 40, REFUSED_MAX = 20;
export const phase = signal(/** @type {"idle" | "starting" | "running" | "paused"} */ ("idle"));
export const lit = signal(""); // the block
export const line = signal(0); // of a program that is text
export const module = signal(""); // whose block is lit, "" for the program's own
export const printed = signal(/** @type {{text: string, level: string, key: number, en?: string, zh?: string}[]} */ ([]));
export const variables = signal(/** @type {Record<string, string>} */ ({}));
export const readings = signal(/** @type {any[]} */ ([]));
export const problems = signal(/** @type {any[]} */ ([])); // of the checker
export const failure = signal(/** @type {any} */ (null)); // of the last run
export const refused = signal(/** @type {{function: string, line: number, module: string, block: string, words: string}[]} */ ([])); // its calls that the robot could not do
export const unknown = computed(() => phase.value !== "idle" && (online.value !== "open" || !opened.value)); // of a run: what it does, now
const under = signal(/** @type {string | null} */ (null)); // the text that runs, null where another page began it
export const older = computed(() => phase.value !== "idle" && under.value !== null && under.value !== python()); // it was changed since
/** A person, or the server, ended the last run: a note says so. */
export const cut = computed(() => printed.value[printed.value.length - 1]?.level === "note");
export const done = signal(false); // a run has ended since the program was opened
export const textBreaks = signal(/** @type {number[]} */ ([]));
export const others = signal(/** @type {string[]} */ ([])); // other programs that run on this robot
export const lights = { count: 0, late: 0 }; // for the benchmark
let ending = false; // a person has ended the run: what is cut short then is no fault
let began = 0, runs = 0, next = 1, frameDue = false;
const NOTE_AFTER = 300; // ms: a class that starts at once moves the page's banner once
let noted = /** @type {Map<string, boolean>} */ (new Map());

/** Another program runs, or runs no more. @param {string} id @param {boolean} runs */
function note(id, runs) {
  if (!noted.size) setTimeout(() => {
    const now = new Set(others.value);
    for (const [one, on] of noted) if (on) now.add(one); else now.delete(one);
    noted = new Map();
    if (now.size !== others.value.length || others.value.some((one) => !now.has(one))) others.value = [...now];
  }, NOTE_AFTER);
  noted.set(id, runs);
}

export const mine = (id) => id === program.value.id;
const words = (/** @type {any} */ found) => found[language.value] || found.en || translated(found.text);
export const failureWords = computed(() => failure.value && words(failure.value));

function stops(step = "") {
  const blocks = program.value.kind === "blocks";
  return { target_id: program.value.id, operate: "break", blocks: blocks ? editor.breaks.value : [], lines: blocks ? [] : textBreaks.value,
    first_block: Boolean(step) && blocks, first: Boolean(step) && !blocks, watched: true };
}

let postponed = /** @type {(() => unknown) | null} */ (null);
/** Do it now, or say that it is done when the link is back; the newest wish counts. @param {() => unknown} what */
function orLater(what) {
  const why = lacks("program");
  if (why) return void say(why, true); // a key was pressed: buttons say it themselves
  if (online.value === "open" && opened.value) return what();
  postponed = what;
  say(t(unopened.value ? "studio.later.robot" : "studio.later"), true);
  return undefined;
}

/** Start it, or go on where it is held, as far as a step. @typedef {"" | "step" | "over" | "out"} Step @param {Step} [step] */
export function run(step = "") { return orLater(() => runNow(step)); }

async function runNow(step) {
  if (phase.value === "paused") return go(step);
  if (phase.value !== "idle") return undefined;
  if (!python().trim()) { say(t("studio.empty")); return undefined; }
  under.value = python(); // first: what ran before is no older version of what starts
  phase.value = "starting";
  learn(python());
  began = performance.now();
  runs += 1;
  ending = false;
  printed.value = []; readings.value = []; variables.value = {}; failure.value = null; refused.value = []; done.value = false; bubbles.clear();
  if (notice.value.bad) say(""); // it was of what is run anew
  try {
    const [known, early] = await Promise.all([isStored(), debug(stops(step)).catch(() => null)]);
    const saved = known ? null : await saveNow();
    if (saved?.feedback.state) {
      phase.value = "idle";
      await check();
      say(problems.value.length ? t("studio.wrong", { why: words(problems.value[0]) }) : t("refused", { why: saved.feedback.describe }), true);
      return undefined;
    }
    const held = known && early ? early : await debug(stops(step)); // of a program that was not there nothing is known
    if (held.error) throw new Error(held.error);
    const { feedback } = await frame({ type: "task", operate: "run", target_id: [program.value.id], mode: "single", condition: "now" });
    if (feedback.state) throw new Error(feedback.describe);
    if (program.value.lesson) say(t("studio.run.lesson"));
  } catch (error) {
    if (phase.value === "starting") phase.value = "idle";
    say(t("refused", { why: error.message }), true);
  }
  return undefined;
}

async function go(step) {
  const operate = step ? `${step}${program.value.kind === "blocks" ? "_block" : ""}` : "go";
  const answer = await debug({ target_id: program.value.id, operate }).catch(() => null);
  if (!answer) { orLater(() => go(step)); return; } // the link broke meanwhile
  if (answer.error) {
    if (step) { const plain = await debug({ target_id: program.value.id, operate: "go" }); if (!plain.error) say(t("studio.step.not")); else say(answer.error, true); } else say(answer.error, true);
  }
}

export const pause = () => orLater(() => operate("suspend"));
export const stop = () => orLater(async () => { ending = true; ending = await operate("shutdown"); });
/** Stop the robot, and its program. */
export function halt() { if (phase.value !== "idle" && !lacks("program")) stop(); return stopRobot(); }
export const step = (/** @type {Step} */ how = "step") => run(how);

/** @param {"suspend" | "shutdown" | "recover"} operation @param {string} [id] */
export async function operate(operation, id = program.value.id) {
  try {
    const { feedback } = await frame({ type: "task", operate: operation, target_id: [id] });
    const over = operation === "shutdown" && mine(id) && phase.value === "idle"; // the robot's own stop was faster
    if (feedback.state && !over) say(t("refused", { why: feedback.describe }), true);
    return !feedback.state;
  } catch (error) { say(t("refused", { why: error.message }), true); return false; }
}

/** Breakpoints were changed while it runs. */
export async function tellStops() { const wish = stops(); if (phase.peek() === "running" || phase.peek() === "paused") await debug(wish).catch(() => undefined); }

let checking = 0;
/** Ask what is wrong with the program as it stands. */
export async function check() {
  const number = ++checking, text = python();
  if (!text.trim()) { problems.value = []; show(); return; }
  try {
    const answer = await ask({ type: "check", body: text });
    if (number !== checking) return;
    problems.value = answer.problems;
    show();
  } catch { /* asked again with the next change */ }
}

/** Put problems, and the last run's failure, to their blocks. */
export function show() {
  bubbles.draw();
  if (program.value.kind !== "blocks") return;
  const owners = blocksOfLines(editor.code.value), wrong = new Map();
  for (const found of problems.value) if (owners[found.line - 1]) wrong.set(owners[found.line - 1], words(found));
  for (const one of refused.value) if (one.block && !one.module) wrong.set(one.block, t("studio.undone.why", { why: one.words }));
  if (failure.value?.block) wrong.set(failure.value.block, `${words(failure.value)}\n${textOf(failure.value)}`);
  editor.blame(wrong);
}

/** The state of the robot after the page was opened, or the link came back. */
export async function catchUp() {
  const running = opened.value?.running ?? [];
  noted = new Map();
  others.value = running.filter((id) => !mine(id));
  if (!running.includes(program.value.id)) settle("idle");
  await rejoin();
}

const HELD = /** @type {Record<string, "running" | "paused">} */ ({ run: "running", suspend: "paused" });
/** What was missed of the program while the page was away. */
async function rejoin() {
  await learn(python());
  const { id } = program.value, began = runs, { log, where, program: stored, began: last, refused: calls } = await ask({ type: "fetch", program: id });
  if (!mine(id) || began !== runs) return; // another was opened or it was started meanwhile
  const lines = log.filter((/** @type {any} */ e) => last !== null && e.stamp >= last).slice(-LINES_MAX);
  if (last !== null) { printed.value = lines.map(entry); refused.value = calls.map((/** @type {any} */ one) => ({ ...one, words: one.refused })); }
  under.value = stored?.body ?? null;
  if (!HELD[where.state]) { settle("idle"); if (last !== null) ended(); return; }
  failure.value = null;
  variables.value = where.variables;
  bubbles.held(where.variables);
  phase.value = HELD[where.state];
  place(where.block, where.line, where.module);
  show();
}

/** How the last run ended. */
function ended() {
  const found = printed.value.filter((e) => e.level === "error").pop();
  failure.value = found ? { ...found, block: ownerAt(found) } : null;
  done.value = true;
  show();
}

/** The text of the last run, or what stands here now. */
export const ran = () => under.value ?? python();
/** The block of an error. @param {any} found */
const ownerAt = (found) => (found.line && !found.module && program.value.kind === "blocks" && blocksOfLines(ran())[found.line - 1]) || "";
export const textOf = (/** @type {any} */ found) => withLineShown(translated(found.text), found, ran());

/** Another program was opened: what was shown is the other's. */
export function forget() {
  settle("idle");
  printed.value = []; readings.value = []; variables.value = {}; failure.value = null; refused.value = []; done.value = false; under.value = null; problems.value = []; textBreaks.value = []; bubbles.clear();
}

function settle(now) {
  phase.value = now;
  if (now === "idle") { lit.value = ""; line.value = 0; module.value = ""; editor.light(""); }
}

function place(block, number, unit) { lit.value = block; line.value = number; module.value = unit; draw(); }

function draw() {
  if (frameDue) return;
  frameDue = true;
  requestAnimationFrame(() => {
    frameDue = false;
    const known = editor.light(phase.value === "idle" ? "" : lit.value, phase.value === "paused");
    if (!known && lit.value && !module.value && program.value.kind === "blocks") module.value = ownerOf(lit.value) || "…";
  });
}

/** Where it is exactly, once it is held. */
async function look() {
  const where = await debug({ target_id: program.value.id, operate: "where" }).catch(() => null);
  if (where) place(where.block, where.line, where.module);
}

const entry = (/** @type {any} */ e) => ({ ...e, key: next++ });
/** A line of the log as it is shown: what the program did not print itself are the server's words. @param {any} e */
export const lineOf = (e) => (e.en ? `${words(e)}\n${textOf(e)}` : e.level === "print" ? e.text : translated(e.text));

effect(() => { if (unknown.value) untracked(() => place("", 0, "")); }); // it may be anywhere by now
const LOOK_EVERY = 100; // ms between two looks at the line of a text: no block says it
let looking = 0;
effect(() => {
  clearInterval(looking);
  if (program.value.kind === "text" && phase.value === "running" && !unknown.value) looking = window.setInterval(follow, LOOK_EVERY);
});
let following = false;
async function follow() {
  if (following || document.hidden) return;
  following = true;
  const { id } = program.value, found = await ask({ type: "fetch", program: id, log: false, text: false }).catch(() => null);
  following = false;
  if (found && mine(id) && phase.value === "running" && found.where.state === "run") { line.value = found.where.module ? 0 : found.where.line; module.value = found.where.module; }
}

listen((message) => {
  switch (message.type) {
    case "opened": catchUp().catch(() => undefined).then(() => { const wish = postponed; postponed = null; wish?.(); }); break;
    case "frame": report(message.frame); break;
    case "log": {
      if (!mine(message.task)) break;
      const line = entry(message);
      printed.value = [...printed.value, line].slice(-LINES_MAX);
      if (line.level === "error") blameRun(line);
      break;
    }
    case "variables":
      if (!mine(message.task)) break;
      variables.value = message.variables;
      bubbles.held(message.variables);
      break;
    case "reading":
      if (!mine(message.task)) break;
      readings.value = [{ ...message, key: next++ }, ...readings.value].slice(0, READINGS_MAX);
      if (!message.module) bubbles.answered(message.block, message.refused || message.value);
      if (message.refused) noteRefused({ ...message, words: message.refused });
  }
});

/** Said once for each place and reason. @param {typeof refused.value[0]} call */
function noteRefused(call) {
  if (ending || refused.value.length >= REFUSED_MAX || refused.value.some(({ line, module, words }) => line === call.line && module === call.module && words === call.words)) return;
  refused.value = [...refused.value, call];
  say(t("studio.undone.why", { why: call.words }), true);
  show();
}

function blameRun(found) {
  failure.value = { ...found, block: ownerAt(found) || (found.line ? lit.value : "") };
  say(words(found), true); // whatever panel is shown
  show();
}

/** @param {any} frame */
function report({ feedback, block }) {
  if (!feedback || feedback.type !== "task") return;
  if (!mine(feedback.target_id)) {
    if (feedback.operate === "start" || /now state is suspend/.test(feedback.describe)) note(feedback.target_id, true);
    if (feedback.operate === "stop" || /now state is shutdown/.test(feedback.describe)) note(feedback.target_id, false);
    return;
  }
  if (block) {
    if (block.type === "begin") {
      if (phase.value === "starting") { phase.value = "running"; }
      if (!lights.count++) lights.late = performance.now() - began;
      module.value = "";
      lit.value = block.id;
      draw();
    }
    return;
  }
  if (/Task loop feedback/.test(feedback.describe)) {
    if (/is suspend/.test(feedback.describe)) { if (phase.value === "idle") rejoin().catch(() => undefined); else { phase.value = "paused"; look(); } } else if (/is run$/.test(feedback.describe)) phase.value = "running"; else over();
  } else if (feedback.operate === "start") { if (phase.value === "idle") { runs += 1; under.value = null; refused.value = []; failure.value = null; done.value = false; } phase.value = feedback.state ? "idle" : "running"; }
  else if (feedback.operate === "stop") over();
}

function over() { done.value ||= phase.value !== "idle"; settle("idle"); }
