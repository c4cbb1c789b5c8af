// The frame of the studio: header, what runs the program, blocks or text, panels beside them.
import { render } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { computed, effect, signal, untracked } from "@preact/signals";
import { Button, Icon, PATHS, html, kept, lacks, language, loadWords, notice, place, robotWord, say, t, theme } from "../base.js";
import { TEACHER, choose, connect as connectRobot, current, hello, me, state, status, want } from "../link.js";
import { loadTable } from "./blocks.js";
import { Group } from "./class.js";
import { Help, Keys, Library, Schedule, shown } from "./dialogs.js";
import * as editor from "./editor.js";
import { connect, online, open, opened, unopened } from "./link.js";
import { Inside } from "./modules.js";
import { Missions, allowHere, forget, loadMissions, missions } from "./missions.js";
import { Output, Python, RobotPanel, TextEditor, Values } from "./panels.js";
import { body, changed, handOver, keepNow, list, program, rename, restore, stored, unnamed } from "./program.js";
import * as runner from "./runner.js";
import * as text from "./text.js";

Object.assign(PATHS, { // the studio's own icons
  step: "M5 5v14l9-7zM18 5v14",
  over: "M4 12a8 8 0 0115-4M20 3v5h-5M12 18h.01",
  out: "M12 15V4M8 8l4-4 4 4M5 20h14",
  undo: "M9 7L4 12l5 5M4 12h11a5 5 0 010 10h-3",
  redo: "M15 7l5 5-5 5M20 12H9a5 5 0 000 10h3",
  folder: "M3 6h7l2 3h9v10H3z",
  star: "M12 3l2.8 5.8 6.2.9-4.5 4.4 1 6.2-5.5-3-5.5 3 1-6.2L3 9.7l6.2-.9z",
});
const TABS = { python: Python, output: Output, values: Values, robot: RobotPanel, missions: Missions, group: Group };
export const tab = kept("studio.tab", "python", new RegExp(`^(${Object.keys(TABS).join("|")})$`));
const whole = signal(matchMedia("(min-width: 900px)").matches ? "both" : "blocks"); // on a phone one at a time
const sought = signal(""), hits = signal(0);

function Stop() {
  const why = lacks("stop");
  return html`<button type="button" class="stop" aria-disabled=${why ? "true" : undefined} onClick=${() => runner.halt()} title=${why || t("studio.halt.hint")}>
    <${Icon} name="stop" size=${18} /><span>${t("stop")}</span><kbd>Esc</kbd></button>`;
}

function Header() {
  const robots = hello.value?.robots ?? [];
  const looks = ["plain", "contrast", "dyslexia"];
  const skip = (e) => { e.preventDefault(); editor.toToolbox(); };
  return html`<header>${program.value.kind === "blocks" && html`<a class="unseen skip" href="#blocks" onClick=${skip}>${t("studio.skip")}</a>`}
    <a class="brand" href="/" title=${t("studio.console")}><img src="/icon.svg" alt="" width="28" height="28" /><b>${t("studio")}</b></a>
    <label class="robot"><span>${t("robot")}</span>
      <select value=${current.value} onChange=${(e) => { choose(e.target.value); open(); }}>${robots.map((r) => html`<option>${r.name}</option>`)}</select></label>
    <label class="name"><span class="unseen">${t("studio.name")}</span><input value=${program.value.name} placeholder=${unnamed(program.value.id)} maxlength="60" onChange=${(e) => rename({ name: e.target.value })} /></label>
    <span class="stored muted" role="status" title=${stored.value && t(`studio.stored.${stored.value}`)}>${stored.value && t(`studio.stored.${stored.value}`)}</span>
    <span class="grow"></span>
    <label class="looks"><span class="unseen">${t("studio.look")}</span><select value=${editor.look.value} onChange=${(e) => { editor.look.value = e.target.value; }}>${looks.map((l) => html`<option value=${l}>${t(`studio.look.${l}`)}</option>`)}</select></label>
    <button type="button" class="button plain" lang=${language.value === "zh" ? "en" : "zh-CN"} onClick=${() => { language.value = language.value === "zh" ? "en" : "zh"; }}>${language.value === "zh" ? "EN" : "中文"}</button>
    <${Button} compact kind="plain" icon=${theme.value === "dark" ? "sun" : "moon"} label=${t("theme")} onClick=${() => { theme.value = theme.value === "dark" ? "light" : "dark"; }} />
    <${Stop} />
  </header>`;
}

/** Where a program is held, in words: read aloud at each step. */
function held() {
  if (runner.phase.value !== "paused" || runner.module.value || runner.unknown.value) return "";
  if (program.value.kind === "text") return runner.line.value ? ` · ${t("studio.line", { n: runner.line.value })}` : "";
  const block = runner.lit.value && editor.workspace?.getBlockById(runner.lit.value);
  return block ? ` · ${block.toString(60)}` : "";
}

const undo = (/** @type {boolean} */ redo) => (program.value.kind === "text" ? text.undo(redo) : editor.undo(redo));

function Bar() {
  const others = runner.others.value.length;
  const phase = runner.phase.value, busy = phase === "running" || phase === "starting";
  const word = runner.unknown.value ? t("studio.phase.unknown") : phase === "idle" ? t(`studio.phase.${runner.failure.value ? "failed" : runner.refused.value.length && !runner.cut.value ? "undone" : runner.done.value ? "ended" : "idle"}`) : `${t(`studio.phase.${phase}`)}${runner.module.value ? ` · ${t("studio.phase.module", { name: runner.module.value })}` : ""}${runner.older.value ? ` · ${t("studio.phase.older")}` : ""}`;
  return html`<div class="controls" role="toolbar" aria-label=${t("studio.controls")}>
    <${Button} kind="main" verb="program" icon="play" label=${t(phase === "paused" ? "studio.go" : "studio.run")} title="F5" disabled=${busy || online.value !== "open"} onClick=${() => runner.run()} />
    <${Button} verb="program" icon="pause" label=${t("studio.pause")} title="F6" disabled=${phase !== "running"} onClick=${() => runner.pause()} />
    <${Button} verb="program" icon="step" label=${t("studio.step")} title="F8" disabled=${busy || online.value !== "open"} onClick=${() => runner.step()} />
    <${Button} compact verb="program" icon="over" label=${t("studio.over")} title=${`${t("studio.over")} (F10)`} disabled=${phase !== "paused"} onClick=${() => runner.step("over")} /><${Button} compact verb="program" icon="out" label=${t("studio.out")} title=${`${t("studio.out")} (Shift+F8)`} disabled=${phase !== "paused"} onClick=${() => runner.step("out")} />
    <${Button} verb="program" icon="stop" label=${t("studio.stop")} title="Shift+F5" disabled=${phase === "idle"} onClick=${() => runner.stop()} />
    ${program.value.kind === "blocks" && html`<${Button} compact icon="dot" label=${t("studio.break.on")} title="F9" onClick=${() => editor.toggleBreak()} />`}
    <span class=${`phase ${runner.unknown.value ? "unknown" : phase} ${runner.failure.value || (phase === "idle" && runner.refused.value.length && !runner.cut.value) ? "failed" : ""}`} role="status" aria-live="polite" title=${`${word}${held()}${runner.older.value ? `. ${t("studio.older")}` : ""}`}>${word}${held()}</span>
    <span class="unseen" role="status" aria-live="polite">${others > 0 && t("studio.others", { n: others })}</span>
    <span class="grow"></span>
    ${program.value.kind === "blocks" && html`<label class="search"><span class="unseen">${t("studio.search")}</span><input type="search" placeholder=${t("studio.search")} value=${sought.value} onInput=${(e) => { sought.value = e.target.value; hits.value = editor.search(e.target.value); }} onKeyDown=${(e) => { if (/^(Enter|ArrowDown)$/.test(e.key) && sought.value && hits.value) { e.preventDefault(); e.stopPropagation(); editor.toToolbox(true); } }} /></label>
      <span class="unseen" role="status" aria-live="polite">${sought.value && t("studio.search.count", { n: hits.value })}</span>`}
    <${Button} compact icon="undo" label=${t("studio.undo")} onClick=${() => undo(false)} /><${Button} compact icon="redo" label=${t("studio.redo")} onClick=${() => undo(true)} />
    <${Button} icon="folder" label=${t("studio.programs")} title=${others ? t("studio.others", { n: others }) : t("studio.programs")} aria-label=${others ? `${t("studio.programs")}. ${t("studio.others", { n: others })}` : t("studio.programs")} onClick=${() => { shown.value = "library"; }}>${others > 0 && html`<b class="count" aria-hidden="true">${others}</b>`}<//>
    <${Button} compact icon="clock" label=${t("studio.schedule")} onClick=${() => { shown.value = "schedule"; }} />
    <${Button} compact icon="keys" label=${t("studio.keys")} onClick=${() => { shown.value = "keys"; }} />
  </div>`;
}

/** The client that alone may move the robot; empty: this program may, too. */
function holder() {
  const taken = state.value?.control?.taken_by ?? "";
  return taken && !`visual ${program.value.id} `.startsWith(`${taken} `) ? taken : "";
}

function Banner() {
  if (online.value === "lost" || status.value === "lost") return html`<div class="banner bad" role="alert">${t(runner.phase.value === "idle" ? "studio.lost" : "studio.lost.running")}</div>`;
  if (unopened.value) return html`<div class="banner warn" role="status">${t("studio.unopened", { why: unopened.value })}</div>`;
  const who = holder();
  if (who) return html`<div class="banner warn" role="status">${who === TEACHER ? t("studio.locked") : t("studio.held", { who: robotWord(who) })}</div>`;
  return null;
}

/** What to do where no block stands yet. */
function Start() {
  return html`<div class="start"><p>${t("studio.start")}</p>${!program.value.lesson && html`<${Button} icon="star" label=${t("studio.start.mission")} onClick=${() => { tab.value = "missions"; if (whole.value === "blocks") whole.value = "side"; }} />`}</div>`;
}

function Blocks() {
  const place = useRef(null);
  useEffect(() => { editor.mount(place.current); restore(); runner.check(); }, []);
  return html`<div class="workspace" ref=${place} hidden=${program.value.kind !== "blocks"}></div>${program.value.kind === "text" ? html`<${TextEditor} />` : editor.empty.value && html`<${Start} />`}
    ${program.value.kind === "blocks" && html`<${Inside} name=${runner.phase.value === "idle" ? "" : runner.module.value} block=${runner.module.value && runner.lit.value} />`}`;
}

function Side() {
  const Shown = TABS[tab.value] ?? Python;
  useEffect(() => { // by hand: after scrollIntoView, the Tab key of Chromium 150 goes on from there
    const shown = document.getElementById(`tab-${tab.value}`), box = shown?.parentElement;
    if (!shown || !box) return;
    const at = shown.getBoundingClientRect(), around = box.getBoundingClientRect();
    box.scrollLeft += Math.min(0, at.left - around.left) + Math.max(0, at.right - around.right);
  }, [tab.value]);
  const move = (event) => {
    const names = Object.keys(TABS), by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    tab.value = names[(names.indexOf(tab.value) + by + names.length) % names.length];
    event.currentTarget.querySelector(`#tab-${tab.value}`).focus();
  };
  return html`<aside><div class="tabs" role="tablist" aria-label=${t("panels")} onKeyDown=${move}>${Object.keys(TABS).map((name) => html`
      <button type="button" role="tab" id=${`tab-${name}`} aria-selected=${String(tab.value === name)} aria-controls="panel" tabindex=${tab.value === name ? 0 : -1} onClick=${() => { tab.value = name; }}>${t(`studio.tab.${name}`)}</button>`)}</div>
    <div id="panel" class="panel" role="tabpanel" aria-labelledby=${`tab-${tab.value}`} tabindex="0"><h2 class="unseen">${t(`studio.tab.${tab.value in TABS ? tab.value : "python"}`)}</h2><${Shown} /></div></aside>`;
}

/** Whether the page knows of something to stop: the program, or what anybody else has the robot do. */
const moves = () => runner.phase.value !== "idle" || Boolean(state.value?.actions?.length);

const WINDOWS = { library: Library, schedule: Schedule, keys: Keys, help: Help };
function App() {
  useEffect(() => {
    const keys = { F5: () => runner.run(), F6: () => runner.pause(), F8: (e) => runner.step(e.shiftKey ? "out" : "step"), F10: () => runner.step("over"),
      F9: () => { if (program.value.kind === "blocks") editor.toggleBreak(); } };
    const key = (event) => {
      if (event.key === "Escape" && !event.repeat && !shown.value && !event.defaultPrevented && (moves() || !lacks("stop"))) { runner.halt(); return; }
      if (/^s$/i.test(event.key) && (event.ctrlKey || event.metaKey)) { event.preventDefault(); keepNow(); return; }
      if (event.key === "F5" && event.shiftKey) { event.preventDefault(); runner.stop(); return; }
      if (/^[zy]$/i.test(event.key) && (event.ctrlKey || event.metaKey) && !event.defaultPrevented && program.value.kind === "blocks" && !shown.value
          && !event.target.closest?.("input, textarea, [contenteditable], .blocklyWidgetDiv")) { event.preventDefault(); editor.undo(event.shiftKey || event.key.toLowerCase() === "y"); return; }
      if (keys[event.key] && !event.defaultPrevented && !event.ctrlKey && !(event.key === "F10" && event.shiftKey)) { event.preventDefault(); keys[event.key](event); }
    };
    addEventListener("keydown", key);
    return () => removeEventListener("keydown", key);
  }, []);
  const Window = WINDOWS[shown.value];
  return html`<${Header} /><main class=${`studio-main show-${whole.value}`}><h1 class="unseen">${t("studio")}</h1><${Banner} /><${Bar} />
      <div class="desk"><${Blocks} /><${Side} /></div>
      <div class="switch" role="group" aria-label=${t("views")}><${Button} on=${whole.value === "blocks"} label=${t("studio.show.blocks")} onClick=${() => { whole.value = "blocks"; }} /><${Button} on=${whole.value === "side"} label=${t("studio.show.side")} onClick=${() => { whole.value = "side"; }} /></div>
    </main>${Window && html`<${Window} />`}
    <div class=${`notice ${notice.value.bad ? "bad" : ""}`} role="status" aria-live="polite">${notice.value.text}</div>`;
}

const ENDED_AFTER = 500; // ms
const AWAY_AFTER = 2000; // ms until files are kept for the time without a server: the page itself comes first
const AWAY_AT_LAST = 30_000; // ms; a program that runs comes first, too, until then
await Promise.all([loadWords("/words", "/studio/words"), loadTable()]);
want({ moving: false }); // until a map is shown
render(html`<${App} />`, place());
connectRobot();
connect();
let timer = 0;
effect(() => { if (editor.changes.value) untracked(changed); }); // not when another program is shown
effect(() => { void editor.code.value; void body.value; clearTimeout(timer); timer = window.setTimeout(runner.check, 350); });
effect(() => { void editor.breaks.value; void runner.textBreaks.value; runner.tellStops(); });
effect(() => { if (current.value && online.value === "open") open(program.peek().id); });
const robot = computed(() => opened.value?.robot ?? "");
effect(() => { if (robot.value) list().then(() => editor.modules.value.length && editor.remake()).then(handOver).catch(() => undefined); });
effect(() => { void language.value; runner.show(); });
effect(() => { if (runner.older.value) untracked(() => say(t("studio.older"))); });
let ran = false;
effect(() => { // what was changed meanwhile; at an end that is not its own the robot has yet to hear of it
  const runs = runner.phase.value !== "idle";
  if (ran && !runs) setTimeout(() => handOver().catch(() => undefined), ENDED_AFTER);
  ran = runs;
});
effect(() => { if (status.value === "out") location.assign(`/?to=studio${me.value.ended ? "&ended" : ""}`); }); // a name is needed (again)
let shownId = program.peek().id;
effect(() => {
  const { id } = program.value;
  allowHere();
  if (id === shownId) return;
  shownId = id;
  runner.forget();
  forget();
  open(id); // the answer says what runs
});
loadMissions().catch(() => undefined);
let cut = false;
effect(() => { // a page that was opened without the server
  cut ||= online.value === "lost";
  if (cut && online.value === "open" && !missions.peek().length) loadMissions().catch(() => undefined);
});
addEventListener("pagehide", () => { if (editor.changes.peek()) changed(); });
effect(() => { document.title = t("studio"); });
/** Keep the page's files, on https and this machine. */
function keepForAway() {
  if (runner.phase.value !== "idle" && performance.now() < AWAY_AT_LAST) setTimeout(keepForAway, AWAY_AFTER);
  else navigator.serviceWorker?.register("/studio/worker.js").catch(() => undefined);
}
setTimeout(keepForAway, AWAY_AFTER);
Object.assign(window, { studio: { editor, runner, program, say } }); // for tests and the benchmark
