// Windows over the page: the library, versions and files; the schedule of a program in plain words.
import { effect, signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { Button, html, lacks, notice, say, t } from "../base.js";
import { asked, table, words } from "./blocks.js";
import * as editor from "./editor.js";
import { frame, listen } from "./link.js";
import { openModule, removeModule } from "./modules.js";
import { download, fresh, list, listed, openStored, program, python, remove, saveFrame, upload } from "./program.js";
import { operate } from "./runner.js";
import { Versions } from "./versions.js";

const SOON = 150; // ms after news of a program until the list is asked for
export const shown = signal("");
const close = () => { shown.value = ""; asked.value = null; };

/** @param {{title: string, children?: any}} props */
function Dialog({ title, children }) {
  const place = useRef(/** @type {any} */ (null));
  useEffect(() => { place.current?.showModal(); }, []);
  return html`<dialog ref=${place} class="window" aria-label=${title} onClose=${close} onKeyDown=${(e) => e.stopPropagation()}>
    <div class="bar8"><h2 class="grow">${title}</h2><${Button} label=${t("studio.close")} onClick=${close} /></div>${children}
    <div class=${`notice ${notice.value.bad ? "bad" : ""}`} role="status" aria-live="polite">${notice.value.text}</div></dialog>`; // the page below says nothing meanwhile
}

async function opening(id) { try { await openStored(id); close(); } catch (error) { say(error.message, true); } }
const STATES = ["error", "wait_run", "run_wait", "run", "suspend", "shutdown"];

const runs = (/** @type {any} */ { operate: state }) => state === "run" || state === "suspend";
/** @param {any[]} all */
const runningFirst = (all) => [...all].sort((a, b) => Number(runs(b)) - Number(runs(a)) || (a.describe || a.id).localeCompare(b.describe || b.id, document.documentElement.lang, { numeric: true }));

function Row({ item }) {
  const state = STATES.includes(item.operate) ? t(`studio.state.${item.operate}`) : item.operate;
  return html`<li class=${item.id === program.value.id ? "chosen" : ""}><span class="grow"><b>${item.describe || item.id}</b><small>${state}${item.condition && item.condition !== "now" ? ` · ${plainly(item.mode, item.condition)}` : ""}</small></span>
    <${Button} verb="program" label=${t("studio.open")} onClick=${() => opening(item.id)} />
    ${item.operate === "suspend" && html`<${Button} verb="program" label=${t("studio.recover")} onClick=${() => operate("recover", item.id).then(list)} />`}
    ${["run", "suspend", "run_wait"].includes(item.operate) ? html`<${Button} verb="program" kind="danger" label=${t("studio.stop")} onClick=${() => operate("shutdown", item.id).then(list)} />`
      : html`<${Button} verb="program" kind="danger" label=${t("studio.delete")} onClick=${() => { if (confirm(t("studio.delete.sure", { name: item.describe || item.id }))) remove(item.id).catch((error) => say(error.message, true)); }} />`}</li>`;
}

export function Library() {
  useEffect(() => {
    let due = 0;
    const look = () => list().catch((error) => say(error.message, true));
    const leave = listen(({ type, frame: news }) => { if (type === "frame" && news.feedback?.type === "task" && !news.block) { clearTimeout(due); due = window.setTimeout(look, SOON); } });
    look();
    return () => { clearTimeout(due); leave(); };
  }, []);
  return html`<${Dialog} title=${t("studio.programs")}>
    <div class="buttons"><${Button} icon="plus" label=${t("studio.new.blocks")} onClick=${() => { fresh("blocks"); close(); }} /><${Button} icon="plus" label=${t("studio.new.text")} onClick=${() => { fresh("text"); close(); }} />
      <label class="button">${t("studio.file.open")}<input type="file" class="unseen" accept=".json,.py,.txt" onChange=${async (e) => { try { await upload(e.target.files[0]); close(); } catch (error) { say(t("studio.file.bad", { why: error.message }), true); } }} /></label></div>
    <h3>${t("studio.file.save")}</h3>
    <div class="buttons"><${Button} label=${t("studio.file.json")} onClick=${() => download("json")} /><${Button} label=${t("studio.file.py")} onClick=${() => download("py")} />
      ${program.value.kind === "blocks" && html`<${Button} label=${t("studio.file.style")} onClick=${() => download("style")} />`}</div>
    <h3>${t("studio.on.robot")}</h3>
    ${listed.value.length ? html`<ul class="rows">${runningFirst(listed.value).map((item) => html`<${Row} key=${item.id} item=${item} />`)}</ul>` : html`<p class="muted">${lacks("program") || t("studio.on.robot.none")}</p>`}
    ${editor.modules.value.length > 0 && html`<h3>${t("studio.toolbox.modules")}</h3><ul class="rows">${editor.modules.value.map((m) => html`<li><span class="grow"><b>${m.condition}</b><small>${m.describe}</small></span>
      <${Button} verb="program" label=${t("studio.open")} onClick=${() => openModule(m).then(close, (error) => say(error.message, true))} />
      <${Button} verb="program" kind="danger" label=${t("studio.delete")} onClick=${() => { if (confirm(t("studio.delete.sure", { name: m.condition }))) removeModule(m).catch((error) => say(error.message, true)); }} /></li>`)}</ul>`}
    <${Versions} done=${close} />
  <//>`;
}

const mode = signal("single"), condition = signal("now");

const upTo = (/** @type {string | undefined} */ text, /** @type {number} */ most) => /^\d{1,2}$/.test(text ?? "") && Number(text) <= most;
const clockTime = (/** @type {string} */ hour, /** @type {string} */ minute) => `${hour.padStart(2, "0")}:${minute.padStart(2, "0")}`;

/** What comes again and again, in words; "" for what has none. @param {string} when */
function again(when) {
  if (when === "@reboot") return t("studio.when.reboot");
  const [minute, hour, day, month, week, ...more] = when.split(/\s+/), [, step] = /^\*\/(\d+)$/.exec(minute) ?? [];
  if (more.length || day !== "*" || month !== "*" || !/^(\*|[0-7]([-,][0-7])*)$/.test(week ?? "")) return "";
  if (hour === "*" && week === "*") {
    if (minute === "*") return t("studio.when.minute");
    if (step && 60 % Number(step) === 0) return t("studio.when.minutes", { n: step }).replace(/\b1 (\w+)s\b/, "1 $1");
    return upTo(minute, 59) ? t("studio.when.hour", { minute }) : "";
  }
  if (!upTo(minute, 59) || !upTo(hour, 23)) return "";
  const at = clockTime(hour, minute);
  return week === "*" ? t("studio.when.daily", { at }) : t("studio.when.weekly", { at, days: week.replaceAll(",", t("studio.when.and")).replace(/\d/g, (d) => t(`studio.day.${Number(d) % 7}`)) });
}

/** What comes once, in words; "" for what has none. @param {string} when */
function once(when) {
  if (when === "now") return t("studio.when.now");
  const [, n, unit] = /^now\s*\+\s*(\d+)\s*(minutes|hours|days|weeks|months|years)$/.exec(when) ?? [];
  if (n) return t("studio.when.later", { n, unit: t(`studio.unit.${unit}`) }).replace(/\b(1 \w+)s\b/, "$1");
  const [hour, minute] = when.split(":");
  return /^\d{1,2}:\d\d$/.test(when) && upTo(hour, 23) && upTo(minute, 59) ? t("studio.when.at", { at: when }) : "";
}

/** A condition in words; what is none that we know stands as it is written. @param {string} how @param {string} text */
export function plainly(how, text) {
  const when = text.trim();
  return (how === "cycle" ? again(when) : once(when)) || (when && t("studio.when.other", { when }));
}

async function plan(run) {
  try {
    const saved = await saveFrame();
    if (saved.feedback.state) throw new Error(saved.feedback.describe);
    if (run) {
      const { feedback } = await frame({ type: "task", operate: "run", target_id: [program.value.id], mode: mode.value, condition: condition.value });
      if (feedback.state) throw new Error(feedback.describe);
      say(t("studio.planned", { when: plainly(mode.value, condition.value) }));
    }
    close();
  } catch (error) { say(t("refused", { why: error.message }), true); }
}

export function Schedule() {
  const ready = mode.value === "single" ? ["now", "now + 5 minutes", "now + 1 hours", "08:00"] : ["*/5 * * * *", "0 * * * *", "30 7 * * *", "0 8 * * 1-5", "@reboot"];
  return html`<${Dialog} title=${t("studio.schedule")}>
    <div class="buttons"><${Button} on=${mode.value === "single"} label=${t("studio.once")} onClick=${() => { mode.value = "single"; condition.value = "now"; }} />
      <${Button} on=${mode.value === "cycle"} label=${t("studio.again")} onClick=${() => { mode.value = "cycle"; condition.value = "*/5 * * * *"; }} /></div>
    <div class="buttons chips" role="group" aria-label=${t("studio.schedule")}>${ready.map((text) => html`<${Button} on=${condition.value === text} label=${plainly(mode.value, text)} onClick=${() => { condition.value = text; }} />`)}</div>
    <label class="field"><span>${t("studio.condition")}</span><input value=${condition.value} maxlength="100" onInput=${(e) => { condition.value = e.target.value; }} /></label>
    <p role="status"><b>${plainly(mode.value, condition.value)}</b></p>
    <div class="buttons"><${Button} verb="program" kind="main" label=${t("studio.plan")} onClick=${() => { if (python().trim()) plan(true); else say(t("studio.empty")); }} /></div><//>`;
}

/** What a function does, and what it takes; what a block of the language does. */
export function Help() {
  const f = asked.value;
  const code = f.code ?? `${f.key}${f.attribute ? "" : `(${f.parameters.map((p) => p.name).join(", ")})`}`;
  const range = (p) => (p.kind === "choice" ? p.choices.map((name) => words(table.members[name])).join(", ") : p.minimum !== undefined ? `${p.minimum} … ${p.maximum} ${p.unit}` : p.unit);
  return html`<${Dialog} title=${words(f)}><p>${words(f.about)}</p>${code && html`<pre class="printed">${code}</pre>`}
    <dl class="values">${f.parameters.map((p) => html`<div><dt>${words(p)} (${p.name})</dt><dd>${range(p)}</dd></div>`)}</dl><//>`;
}
effect(() => { if (asked.value) shown.value = "help"; });

const KEYS = [["F5", "run"], ["F8", "step"], ["F10", "over"], ["Shift+F8", "out"], ["F6", "pause"], ["Shift+F5", "stop"], ["F9", "break"], ["T", "toolbox"], ["Enter", "edit"], ["M", "move"], ["I", "speak"], ["Ctrl+S", "save"], ["Ctrl+Z", "undo"], ["Ctrl+Enter", "menu"], ["Esc", "halt"]];
export function Keys() {
  return html`<${Dialog} title=${t("studio.keys")}><dl class="values">${KEYS.map(([key, name]) => html`<div><dt><kbd>${key}</kbd></dt><dd>${t(`studio.key.${name}`)}</dd></div>`)}</dl><//>`;
}
