// Missions: which there are, what one asks, the program tried in its world, stars and reasons; and simulate first.
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { Button, Icon, html, kept, language, robotWord, say, t } from "../base.js";
import { palette } from "../chart.js";
import { blocksOfLines, stateOf, table } from "./blocks.js";
import * as editor from "./editor.js";
import { ask, listen, send } from "./link.js";
import { changed, fresh, lineShown, program, python, rename } from "./program.js";

const PATH_MAX = 4000;
export const missions = signal(/** @type {any[]} */ ([]));
export const trying = signal(false);
export const outcome = signal(/** @type {any} */ (null));
const trace = signal(/** @type {number[][]} */ ([]));
const litThere = signal("");
const hints = signal(0);
const stars = kept("studio.stars", "{}");
const said = (/** @type {any} */ w) => w[language.value] ?? w.en;
const earned = (id) => results()[id] ?? 0;
export const mission = () => missions.value.find((m) => m.id === program.value.lesson);
/** @returns {Record<string, number>} */
export const results = () => { try { return { ...JSON.parse(stars.value) }; } catch { return {}; } };

export async function loadMissions() { missions.value = await (await fetch("/api/lessons")).json(); allowHere(); }
export function allowHere() { const m = mission(); editor.allow(m?.allowed.length ? m.allowed : null); }

/** What was tried was another program. */
export function forget() { outcome.value = null; trace.value = []; }

/** Begin a mission with its blocks. @param {any} m */
function begin(m) {
  fresh("blocks", { name: said(m.title), lesson: m.id });
  forget(); hints.value = 0;
  allowHere();
  const states = m.blocks.map((key) => { const f = table.functions.find((f) => f.key === key); return f ? stateOf(f, false) : null; }).filter(Boolean);
  let top = null;
  for (const { kind, ...state } of states.reverse()) top = { ...state, ...(top ? { next: { block: top } } : {}) };
  if (top) editor.load({ blocks: { languageVersion: 0, blocks: [{ ...top, x: 40, y: 40 }] } });
  changed();
}

let calledOff = false; // the trial under way, in this page

function callOff() { calledOff = true; send({ type: "end_try" }); }

/** Try the program in the mission's world, or in a copy of the robot's. @param {string} lesson */
export async function attempt(lesson) {
  if (trying.value) return;
  if (!python().trim()) { say(t("studio.empty")); return; }
  const body = python();
  trying.value = true; calledOff = false; outcome.value = null; trace.value = [];
  try {
    const found = await ask({ type: "try", body, lesson });
    outcome.value = { ...found, body };
    if (found.grade && found.grade.stars > earned(lesson)) stars.value = JSON.stringify({ ...results(), [lesson]: found.grade.stars });
  } catch (error) {
    if (calledOff) say(t("studio.try.ended")); else say(t("refused", { why: error.message }), true);
  } finally { trying.value = false; litThere.value = ""; editor.light(""); }
}

listen((message) => {
  if (message.type !== "trial") return;
  if (message.what === "spot") trace.value = [...trace.value, [message.x, message.y, message.yaw]].slice(-PATH_MAX);
  else if (message.what === "block") { litThere.value = message.id; editor.light(message.id); }
});

export function Stars({ count }) { return html`<span class="stars" role="img" aria-label=${t("studio.stars", { n: count })}>${[1, 2, 3].map((n) => html`<span class=${n <= count ? "on" : ""}><${Icon} name="star" size=${18} /></span>`)}</span>`; }

/** The way of a try, from above. */
function Chart({ scene }) {
  const place = useRef(/** @type {any} */ (null));
  useEffect(() => { if (place.current) paint(place.current, scene, trace.value); });
  void trace.value;
  return html`<canvas class="trace" ref=${place} width="640" height="400" role="img" aria-label=${t("studio.trace")}></canvas>`;
}

function paint(canvas, scene, path) {
  const c = /** @type {any} */ (palette()), pen = canvas.getContext("2d");
  const points = [...path, ...scene.goals, ...scene.boxes, scene.start ?? path[0] ?? [0, 0]];
  const xs = points.map((p) => p[0]), ys = points.map((p) => p[1]), [x0, x1, y0, y1] = [Math.min(...xs) - 1, Math.max(...xs) + 1, Math.min(...ys) - 1, Math.max(...ys) + 1];
  const scale = Math.min(canvas.width / (x1 - x0), canvas.height / (y1 - y0)), at = (x, y) => [canvas.width / 2 + (x - (x0 + x1) / 2) * scale, canvas.height / 2 - (y - (y0 + y1) / 2) * scale];
  pen.fillStyle = c.bg; pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.strokeStyle = c.grid; pen.lineWidth = 1;
  for (let x = Math.ceil(x0 - 5); x < x1 + 5; x++) { const [px] = at(x, 0); pen.beginPath(); pen.moveTo(px, 0); pen.lineTo(px, canvas.height); pen.stroke(); }
  for (let y = Math.ceil(y0 - 5); y < y1 + 5; y++) { const [, py] = at(0, y); pen.beginPath(); pen.moveTo(0, py); pen.lineTo(canvas.width, py); pen.stroke(); }
  pen.fillStyle = c.box;
  for (const [x, y, w, d] of scene.boxes) { const [px, py] = at(x - w / 2, y + d / 2); pen.fillRect(px, py, w * scale, d * scale); }
  pen.strokeStyle = c.goal; pen.fillStyle = c.goal; pen.lineWidth = 3;
  scene.goals.forEach(([x, y], i) => { // flags, with numbers where there are several
    const [px, py] = at(x, y);
    pen.beginPath(); pen.moveTo(px, py); pen.lineTo(px, py - 32); pen.stroke();
    pen.beginPath(); pen.moveTo(px, py - 34); pen.lineTo(px + 24, py - 25); pen.lineTo(px, py - 16); pen.fill();
    pen.beginPath(); pen.arc(px, py, 5, 0, 7); pen.fill();
    if (scene.goals.length > 1) { pen.font = "bold 16px sans-serif"; pen.fillText(String(i + 1), px + 9, py); }
  });
  pen.strokeStyle = c.path; pen.lineWidth = 4; pen.beginPath();
  path.forEach(([x, y], i) => { const [px, py] = at(x, y); if (i) pen.lineTo(px, py); else pen.moveTo(px, py); });
  pen.stroke();
  if (!path.length && !scene.start) return; // where it is, is not known yet
  const [x, y, yaw] = path[path.length - 1] ?? [scene.start[0], scene.start[1], scene.start[2] * Math.PI / 180], [px, py] = at(x, y);
  pen.save(); pen.translate(px, py); pen.rotate(-yaw); pen.fillStyle = c.robot; pen.beginPath(); pen.moveTo(14, 0); pen.lineTo(-10, 9); pen.lineTo(-10, -9); pen.fill(); pen.restore();
}

/** What the simulation shows, worst first. */
function summary(found) {
  const { error, touched, late, refused, seconds } = found;
  if (error) return t("studio.try.failed");
  if (touched !== null && touched !== undefined) return t("studio.try.touched", { s: touched.toFixed(0) });
  if (late) return t("studio.try.late", { s: (seconds ?? 0).toFixed(0) });
  return refused?.length ? t("studio.try.refused") : t("studio.try.fine", { s: (seconds ?? 0).toFixed(0) });
}

/** Calls that the robot answered with a failure; `code` is the program that made them. */
export function Refused({ calls, code }) {
  return calls?.length ? html`<ul>${calls.map((c) => html`<li>${c.function.replace("cyberdog.", "")} (${c.module ? `${c.module}, ` : ""}${t("studio.line", { n: lineShown(c, code) })}): ${robotWord(c.words)}</li>`)}</ul>` : null;
}

/** Where an error was, as the page counts lines. @param {{line: number, body: string}} props */
function Place({ line, body }) {
  const block = program.value.kind === "blocks" && blocksOfLines(body)[line - 1];
  return html`<small>${t("studio.line", { n: lineShown({ line, module: "" }, body) })}</small>${block && html`<${Button} label=${t("studio.failed.show")} onClick=${() => editor.focus(block)} />`}`;
}

function Verdict({ found }) {
  if (!found) return null;
  if (!found.grade) return html`<div class=${`failure ${found.error || found.touched !== null || found.late || found.refused?.length ? "" : "fine"}`} role="status"><b>${summary(found)}</b><${Refused} calls=${found.refused} code=${found.body} />${found.why && html`<small>${said(found.why)}</small>`}${found.error && found.printed !== undefined && html`<small>${found.error}</small>`}${found.line > 0 && html`<${Place} line=${found.line} body=${found.body} />`}</div>`;
  const { stars: count, rows } = found.grade, undone = found.refused?.length > 0 && html`<b>${t("studio.undone")}</b><${Refused} calls=${found.refused} code=${found.body} />`;
  return html`<div class=${`failure ${count ? "fine" : ""}`} role="status"><b>${count ? t("studio.passed") : t("studio.not.passed")} <${Stars} count=${count} /></b>
    <ul>${rows.filter((r) => !r.passed).map((r) => html`<li>${r.star ? "☆ " : "✗ "}${said(r)}</li>`)}</ul>${found.line > 0 && html`<${Place} line=${found.line} body=${found.body} />`}${undone}</div>`;
}

export function Missions() {
  const m = mission();
  if (!m) {
    return html`<ul class="rows missions">${missions.value.map((one) => html`<li><span class="grow"><b>${said(one.title)}</b><small>${said(one.task)}</small></span><${Stars} count=${earned(one.id)} />
      <${Button} label=${t("studio.begin")} onClick=${() => begin(one)} /></li>`)}</ul>${!missions.value.length && html`<p class="muted">${t("studio.missions.none")}</p>`}`;
  }
  return html`<h2>${said(m.title)} <${Stars} count=${earned(m.id)} /></h2><p>${said(m.task)}</p>
    <div class="buttons">${trying.value ? html`<${Button} icon="stop" label=${t("studio.stop")} onClick=${callOff} />` : html`<${Button} kind="main" icon="play" verb="program" label=${t("studio.attempt")} onClick=${() => attempt(m.id)} />`}
      ${hints.value < m.hints.length && html`<${Button} label=${t("studio.hint")} onClick=${() => { hints.value += 1; }} />`}<${Button} label=${t("studio.missions.all")} onClick=${() => { rename({ lesson: undefined }); outcome.value = null; allowHere(); }} /></div>
    ${m.hints.slice(0, hints.value).map((h) => html`<p class="hinted">${said(h)}</p>`)}
    <${Verdict} found=${outcome.value} /><${Chart} scene=${m} />`;
}

/** A program tried on a copy of the world, beside the robot's own map. */
export function Simulate() {
  if (program.value.lesson) return null;
  return html`<div class="buttons">${trying.value ? html`<${Button} icon="stop" label=${t("studio.stop")} onClick=${callOff} />` : html`<${Button} icon="eye" verb="program" label=${t("studio.try")} onClick=${() => attempt("")} />`}</div>
    ${(trying.value || trace.value.length > 1) && html`<${Chart} scene=${{ boxes: [], goals: [], start: null }} />`}<${Verdict} found=${outcome.value} />`;
}
