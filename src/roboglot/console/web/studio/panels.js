// What stands beside the blocks: Python, output, variables and readings, the robot.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { effect, signal } from "@preact/signals";
import { Button, html, language, robotWord, t } from "../base.js";
import { MapView } from "../map.js";
import { connections, current, state, want } from "../link.js";
import { blocksOfLines } from "./blocks.js";
import { inWords } from "./bubbles.js";
import * as editor from "./editor.js";
import { body, continueAsText, marks, program } from "./program.js";
import { cut, done, failure, line, lineOf, lit, phase, halt, printed, problems, ran, readings, refused, textBreaks, textOf, variables } from "./runner.js";
import { Refused, Simulate } from "./missions.js";
import { makeText } from "./text.js";

const WORD = /('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")|(#.*)|\b(def|while|for|in|if|elif|else|return|import|from|break|continue|pass|try|except|global|and|or|not|lambda|True|False|None)\b|\b(\d[\d.]*)\b/g;

/** A line of Python in colours. @param {string} text */
function coloured(text) {
  const parts = [];
  let at = 0;
  for (const found of text.matchAll(WORD)) {
    parts.push(text.slice(at, found.index));
    const kind = found[1] ? "string" : found[2] ? "comment" : found[3] ? "keyword" : "number";
    parts.push(html`<span class=${`tok-${kind}`}>${found[0]}</span>`);
    at = found.index + found[0].length;
  }
  return [...parts, text.slice(at)];
}

/** Mark the lines of the lit block; a light changes many times a second, so nothing is rebuilt for it.
 * @param {HTMLElement | null} list @param {string} block */
function mark(list, block) {
  for (const old of list?.querySelectorAll(".here") ?? []) if (/** @type {any} */ (old).dataset.of !== block) old.classList.remove("here");
  if (block) for (const line of list?.querySelectorAll(`[data-of="${CSS.escape(block)}"]`) ?? []) line.classList.add("here");
}

/** The Python of the blocks: each line leads to its block, its number to a breakpoint. */
function Lines() {
  const place = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => effect(() => mark(place.current, lit.value)));
  const code = editor.code.value, owners = blocksOfLines(code), seen = new Set();
  const rows = code.split("\n").map((text, i) => ({ text, owner: owners[i], number: i + 1, mark: text.includes("cyberdog.task.block('") }))
    .filter((row) => marks.value || !row.mark);
  while (rows.length && !rows[rows.length - 1].text.trim()) rows.pop();
  const wrong = new Map(problems.value.map((p) => [p.line, p[language.value] ?? p.en]));
  if (!code.trim()) return html`<p class="muted pad8">${t("studio.python.none")}</p>`;
  return html`<ol class="python" ref=${place} aria-label=${t("studio.tab.python")}>${rows.map((row, i) => {
    const first = row.owner && !seen.has(row.owner);
    if (row.owner) seen.add(row.owner);
    const classes = [row.owner && row.owner === editor.selected.value ? "chosen" : "", wrong.has(row.number) ? "wrong" : ""].join(" ");
    return html`<li key=${row.number} class=${classes} data-of=${row.owner} title=${wrong.get(row.number)}>
      ${first ? html`<button type="button" class=${`gutter ${editor.breaks.value.includes(row.owner) ? "on" : ""}`} aria-pressed=${String(editor.breaks.value.includes(row.owner))}
        aria-label=${t("studio.break.line", { n: i + 1 })} onClick=${() => editor.toggleBreak(row.owner)}>${i + 1}</button>` : html`<span class="gutter">${i + 1}</span>`}
      <code onClick=${() => row.owner && editor.focus(row.owner)}>${coloured(row.text) || " "}</code></li>`;
  })}</ol>`;
}

export function Python() {
  if (program.value.kind === "text") return html`<p class="muted pad8">${t("studio.text.why")}</p><${Output} />`;
  return html`<div class="bar8"><label class="check"><input type="checkbox" checked=${marks.value} onChange=${(e) => { marks.value = e.target.checked; }} /> ${t("studio.python.marks")}</label>
    <${Button} label=${t("studio.python.take")} onClick=${() => { if (!editor.isEmpty() && confirm(t("studio.python.take.sure"))) continueAsText(); }} /></div><${Lines} />`;
}

/** CodeMirror for a program that is text. */
export function TextEditor() {
  const place = useRef(null), made = useRef(/** @type {any} */ (null));
  useEffect(() => {
    let gone = false;
    makeText(place.current).then((editor) => { if (gone) editor.destroy(); else made.current = editor; });
    return () => { gone = true; made.current?.destroy(); };
  }, [program.value.id]);
  useEffect(() => { made.current?.set(body.value); }, [body.value]);
  useEffect(() => { made.current?.refresh(); });
  void problems.value; void textBreaks.value; void lit.value; void line.value; void phase.value; void language.value;
  return html`<div class="text" ref=${place}></div>`;
}

export function Failure() {
  const found = failure.value;
  return html`${found && html`<div class="failure" role="group"><b>${found[language.value] || found.en || t("studio.failed")}</b><small>${textOf(found)}</small>
      ${found.block && html`<${Button} label=${t("studio.failed.show")} onClick=${() => editor.focus(found.block)} />`}</div>`}
    ${refused.value.length > 0 && html`<div class="failure" role="status"><b>${t("studio.undone")}</b><${Refused} calls=${refused.value} code=${ran()} /></div>`}`;
}

export function Output() {
  const end = useRef(null), lines = printed.value.filter((e) => e.key !== failure.value?.key); // that one stands above
  const closed = done.value && !failure.value && !cut.value && phase.value === "idle"
  useEffect(() => {
    const box = end.current?.parentElement;
    if (box) box.scrollTop = box.scrollHeight;
  }, [printed.value.length]);
  return html`<${Failure} />
    <ol class="printed" aria-label=${t("studio.tab.output")} aria-live="polite">${lines.map((e) => html`<li key=${e.key} class=${e.level}>${lineOf(e) || " "}</li>`)}${closed ? html`<li class="note">${t("studio.output.end")}</li>` : !lines.length && !failure.value && html`<li class="muted">${t("studio.output.none")}</li>`}</ol><span ref=${end}></span>`;
}

export function Values() {
  const held = Object.entries(variables.value);
  return html`<h3>${t("studio.variables")}</h3>
    ${held.length ? html`<dl class="values">${held.map(([name, text]) => html`<div key=${name}><dt>${name}</dt><dd>${text}</dd></div>`)}</dl>` : html`<p class="muted">${t("studio.variables.none")}</p>`}
    <h3>${t("studio.readings")}</h3>
    ${readings.value.length ? html`<ol class="readings">${readings.value.map((r) => html`<li key=${r.key}><button type="button" onClick=${() => r.block && editor.focus(r.block)}>${r.function.replace("cyberdog.", "")}</button><span title=${r.value}>${inWords(r.refused || r.value)}</span></li>`)}</ol>` : html`<p class="muted">${t("studio.readings.none")}</p>`}`;
}

const film = signal(false);
export function RobotPanel() {
  const has = state.value?.parts?.includes("camera");
  useEffect(() => { want({ moving: true }); return () => want({ moving: false }); }, []);
  return html`<${Simulate} /><div class="world"><${MapView} tool=${null} overlay=${null} /></div>
    ${has && html`<div class="buttons"><${Button} on=${film.value} label=${t(film.value ? "camera.close" : "camera.open")} onClick=${() => { film.value = !film.value; }} /></div>`}
    ${has && film.value && html`<figure class="film" key=${`${current.value} ${connections.value}`}><img src=${`/api/robots/${encodeURIComponent(current.value)}/camera.mjpeg`} alt=${t("camera.alt")} /></figure>`}
    ${state.value?.faults?.length > 0 && html`<ul class="faults">${state.value.faults.map((f) => html`<li class=${f.level.toLowerCase()}>${robotWord(f.message)}</li>`)}</ul>`}
    <div class="buttons"><${Button} kind="danger" verb="stop" icon="stop" label=${t("stop")} title=${t("studio.halt.hint")} onClick=${() => halt()} /></div>`;
}
