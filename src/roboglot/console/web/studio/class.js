// The class: join by a code, hand in; the teacher's grid of what each pupil's program does. Where several worlds share
// the class, a pupil's page goes on to the console of the world that is theirs.
import { effect, signal } from "@preact/signals";
import { Button, elsewhere, html, kept, language, person, say, sent, t, translated } from "../base.js";
import { saveAs } from "../copies.js";
import { choose, hello } from "../link.js";
import { ask, listen, online, open, send } from "./link.js";
import { results } from "./missions.js";
import { program, python, show, whole } from "./program.js";
import { failure, line, lit, module, phase } from "./runner.js";

const EVERY = 700, SLOWLY = 3000, AGAIN = 2000; // ms between two reports of a pupil, at least and at most; until another try
const code = kept("studio.class", ""), role = kept("studio.role", "");
export const group = signal(/** @type {any} */ (null)); // joined, as a pupil
export const grid = signal(/** @type {any} */ (null)); // of a teacher
const maps = signal(/** @type {Record<string, string>} */ ({ __proto__: null })); // of pupils, by their names

const stars = () => Object.values(results()).reduce((sum, n) => sum + n, 0);
const doing = () => ({ phase: phase.value, lit: litWords(), program: program.value.name.slice(0, 100), error: wrong(), mission: program.value.lesson ?? "", stars: stars() });
/** In both languages: the teacher's page may have another one. */
const wrong = () => { const { en, zh, text } = failure.value ?? {}; return en ? `${en.slice(0, 140)}\n${zh.slice(0, 140)}` : String(text ?? "").slice(0, 280); };
const inOwnWords = (/** @type {string} */ error) => { const [en, zh = translated(en)] = error.split("\n"); return language.value === "zh" ? zh : en; };
function litWords() {
  const block = window.studio?.editor.workspace?.getBlockById(lit.value);
  return (module.value || (block ? block.toString(60) : program.value.kind === "text" && line.value ? t("studio.line", { n: line.value }) : "")).slice(0, 200);
}

let due = /** @type {any} */ (null); // to join or to teach, as soon as there is a link
/** @param {any} message */
function wish(message) {
  if (send({ type: "class", ...message }) || message.do === "doing") return;
  if (!/join|open/.test(message.do)) { say(t("refused", { why: t("link.lost") }), true); return; }
  due = message;
  say(t("studio.later"), true);
}
/** @param {string} given @param {string} name @param {object} [more] */
const joinAs = (given, name, more) => wish({ do: "join", code: given, name, ...more });
const mine = () => (python().trim() ? JSON.stringify(whole()) : "");
const teach = (given, name) => wish({ do: "open", code: given, name });

listen((message) => {
  switch (message.type) {
    case "joined": {
      group.value = message; code.value = message.code; role.value = "pupil"; person.value = message.name;
      const robots = hello.value?.robots ?? [];
      if (robots.length > 1) { choose(robots[message.number % robots.length].name); open(); }
      if (message.style) show({ ...JSON.parse(message.style), id: undefined });
      report(); break;
    }
    case "elsewhere": code.value = ""; role.value = ""; location.assign(elsewhere(message)); break;
    case "ended": group.value = null; grid.value = null; code.value = ""; role.value = ""; say(t("studio.class.over")); break;
    case "left": group.value = null; grid.value = null; setTimeout(back, AGAIN); break;
    case "map": maps.value = { __proto__: null, ...maps.value, [message.name]: message.png }; break;
    case "grid": grid.value = message; code.value = message.code; role.value = "teacher"; break;
    case "stopped": say(t("stopped.all", { n: message.robots })); break;
    case "handed": say(t("studio.handed")); break;
    case "refused": if (!message.id) say(t("refused", { why: message.why }), true);
  }
});
let carry = Boolean(sent.get("class") && sent.get("name")); // from the page of another world, or from the log-in page
if (carry) {
  code.value = String(sent.get("class")).slice(0, 12); person.value = String(sent.get("name")).slice(0, 40); role.value = "pupil";
  kept("studio.tab", "").value = "group"; // before the page itself reads it
  history.replaceState(null, "", location.pathname);
}

/** In the class again after a reload, or when it is there again. */
function back() {
  if (online.peek() !== "open") return;
  if (due) { const now = due; due = null; wish(now); return; }
  if (!code.peek()) return;
  if (role.peek() === "pupil") { joinAs(code.peek(), person.peek(), { carry }); carry = false; } else if (role.peek() === "teacher") teach(code.peek(), "");
}
effect(() => {
  if (online.value === "lost") { group.value = null; grid.value = null; }
  if (online.value === "open") back();
});

let timer = 0;
/** Report the work soon; changes until then do not delay it. */
function report() { timer ||= window.setTimeout(() => { timer = 0; if (group.value) wish({ do: "doing", doing: doing(), style: JSON.stringify(whole()) }); }, EVERY); }
effect(() => { void phase.value; void lit.value; void line.value; void failure.value; void program.value; if (group.value) report(); });

setInterval(() => { if (group.value && phase.value === "running" && !document.hidden) report(); }, SLOWLY); // the robot moves on

function leave() { wish({ do: "leave" }); group.value = null; grid.value = null; code.value = ""; role.value = ""; }

async function look(name) {
  try {
    const found = await ask({ type: "class", do: "look", name });
    if (!found.style) { say(t("studio.class.nothing")); return; }
    const given = JSON.parse(found.style);
    show({ ...given, id: undefined, name: [name, given.name].filter(Boolean).join(": ").slice(0, 60), lesson: undefined });
  } catch (error) { say(t("refused", { why: error.message }), true); }
}

function exported() {
  const cell = (text) => { const plain = String(text).replace(/^[=+@\t\r-]/, "'$&"); return `"${plain.replaceAll('"', '""')}"`; };
  const rows = [t("studio.class.columns").split("|"), ...grid.value.pupils.map((p) => [p.name, p.world, p.robot, p.stars, t(p.handed ? "studio.yes" : "studio.no"), p.mission, inOwnWords(p.error)])];
  saveAs(new Blob([`\ufeff${rows.map((row) => row.map(cell).join(",")).join("\n")}\n`], { type: "text/csv" }), `class-${grid.value.code}.csv`);
}

function Teacher() {
  const { pupils, name } = grid.value;
  return html`<h2>${name || t("studio.tab.group")} <code class="code">${grid.value.code}</code></h2><p class="muted">${t("studio.class.tell")}</p>
    <div class="buttons"><${Button} kind="danger" icon="stop" label=${t("stop.all")} onClick=${() => wish({ do: "stop_all" })} /><${Button} label=${t("studio.class.export")} onClick=${exported} /><${Button} label=${t("studio.class.leave")} onClick=${leave} /><${Button} label=${t("studio.class.end")} onClick=${() => { if (confirm(t("studio.class.end.sure"))) wish({ do: "close" }); }} /></div>
    ${pupils.length ? html`<ul class="rows pupils">${pupils.map((p) => html`<li key=${p.name} class=${p.error ? "bad" : ""}>${maps.value[p.name] ? html`<img class="map" alt=${t("studio.class.map", { name: p.name })} src=${`data:image/png;base64,${maps.value[p.name]}`} />` : html`<span class="map"></span>`}<span class="grow"><b>${p.name}${p.here ? "" : ` (${t("studio.class.away")})`}</b>
        <small>${[p.world, p.robot, p.robot && t(`studio.phase.${p.phase === "idle" && p.error ? "failed" : p.phase}`), p.lit].filter(Boolean).join(" · ")}</small><small>${[p.program, inOwnWords(p.error)].filter(Boolean).join(" · ")}</small>
        <small class="done">${p.stars} ★${p.handed ? ` · ${t("studio.class.handed")}` : ""}</small></span><${Button} compact icon="eye" label=${t("studio.class.look.at", { name: p.name })} onClick=${() => look(p.name)} /></li>`)}</ul>` : html`<p class="muted">${t("studio.class.empty")}</p>`}`;
}

export function Group() {
  if (grid.value) return html`<${Teacher} />`;
  if (group.value) {
    return html`<h2>${group.value.class || t("studio.tab.group")}</h2><p>${t("studio.class.in", { name: group.value.name, code: group.value.code })}</p>
      <div class="buttons"><${Button} kind="main" label=${t("studio.class.hand")} onClick=${() => { if (python().trim()) wish({ do: "hand_in", doing: doing(), style: JSON.stringify(whole()) }); else say(t("studio.empty")); }} /><${Button} label=${t("studio.class.leave")} onClick=${leave} /></div>`;
  }
  if (code.value && role.value && online.value !== "open") return html`<p class="muted">${t("studio.class.back", { code: code.value })}</p>`;
  const joins = (e) => { e.preventDefault(); const f = new FormData(e.target); joinAs(String(f.get("code")), String(f.get("name")), { style: mine() }); };
  const opens = (e) => { e.preventDefault(); const f = new FormData(e.target); teach(String(f.get("again")), String(f.get("name"))); };
  return html`<form class="card" onSubmit=${joins}><h3>${t("studio.class.join")}</h3><label class="field"><span>${t("studio.class.code")}</span><input name="code" required maxlength="12" autocapitalize="characters" autocomplete="off" /></label>
      <label class="field"><span>${t("studio.class.name")}</span><input name="name" required maxlength="40" autocomplete="nickname" /></label><div class="buttons"><button class="button main">${t("studio.class.join")}</button></div></form>
    <form class="card" onSubmit=${opens}><h3>${t("studio.class.open")}</h3><label class="field"><span>${t("studio.class.called")}</span><input name="name" maxlength="40" /></label>
      <label class="field"><span>${t("studio.class.again")}</span><input name="again" maxlength="12" autocapitalize="characters" autocomplete="off" /></label><div class="buttons"><${Button} type="submit" verb="teach" label=${t("studio.class.open")} /></div></form>`;
}
