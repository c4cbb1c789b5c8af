// The class: join by a code, hand in; the teacher's grid of what each pupil's program does.
import { effect, signal } from "@preact/signals";
import { Button, html, kept, person, say, t } from "../base.js";
import { choose, hello } from "../link.js";
import { ask, listen, online, open, send } from "./link.js";
import { results } from "./missions.js";
import { program, python, show, whole } from "./program.js";
import { failure, failureWords, lit, module, phase } from "./runner.js";

const EVERY = 700; // ms between two reports of a pupil at least
const code = kept("studio.class", ""), role = kept("studio.role", "");
export const group = signal(/** @type {any} */ (null)); // joined, as a pupil
export const grid = signal(/** @type {any} */ (null)); // of a teacher

const stars = () => Object.values(results()).reduce((sum, n) => sum + n, 0);
const doing = () => ({ phase: phase.value, lit: litWords(), program: program.value.name.slice(0, 100), error: String(failureWords.value ?? "").slice(0, 280), mission: program.value.lesson ?? "", stars: stars() });
function litWords() {
  const block = window.studio?.editor.workspace?.getBlockById(lit.value);
  return (module.value || (block ? block.toString(60) : "")).slice(0, 200);
}

async function wish(message) { try { return send({ type: "class", ...message }); } catch (error) { say(error.message, true); return false; } }
const joinAs = (given, name) => wish({ do: "join", code: given, name });
const teach = (given, name) => wish({ do: "open", code: given, name });

listen((message) => {
  switch (message.type) {
    case "joined": {
      group.value = message; code.value = message.code; role.value = "pupil"; person.value = message.name;
      const robots = hello.value?.robots ?? [];
      if (robots.length > 1) { choose(robots[message.number % robots.length].name); open(); }
      report(); break;
    }
    case "grid": grid.value = message; code.value = message.code; role.value = "teacher"; break;
    case "handed": say(t("studio.handed")); break;
    case "refused": if (!message.id) say(t("refused", { why: message.why }), true);
  }
});
effect(() => { // back in the class after a reload
  if (online.value === "lost") { group.value = null; grid.value = null; }
  if (online.value !== "open" || !code.peek()) return;
  if (role.peek() === "pupil") joinAs(code.peek(), person.peek()); else if (role.peek() === "teacher") teach(code.peek(), "");
});

let timer = 0;
function report() { clearTimeout(timer); timer = window.setTimeout(() => { if (group.value) wish({ do: "doing", doing: doing(), style: JSON.stringify(whole()) }); }, EVERY); }
effect(() => { void phase.value; void lit.value; void failure.value; void program.value; if (group.value) report(); });

function leave() { wish({ do: "leave" }); group.value = null; grid.value = null; code.value = ""; role.value = ""; }

async function look(name) {
  try {
    const found = await ask({ type: "class", do: "look", name });
    if (!found.style) { say(t("studio.class.nothing")); return; }
    const given = JSON.parse(found.style);
    show({ ...given, id: undefined, name: `${name}: ${given.name}`.slice(0, 60), lesson: undefined });
  } catch (error) { say(t("refused", { why: error.message }), true); }
}

function exported() {
  const cell = (text) => { const plain = String(text).replace(/^[=+@-]/, "'$&"); return `"${plain.replaceAll('"', '""')}"`; };
  const rows = [["name", "robot", "stars", "handed in", "mission", "error"], ...grid.value.pupils.map((p) => [p.name, p.robot, p.stars, p.handed ? "yes" : "no", p.mission, p.error])];
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([`\ufeff${rows.map((row) => row.map(cell).join(",")).join("\n")}\n`], { type: "text/csv" }));
  link.download = `class-${grid.value.code}.csv`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function Teacher() {
  const { pupils, name } = grid.value;
  return html`<h2>${name || t("studio.tab.group")} <code class="code">${grid.value.code}</code></h2><p class="muted">${t("studio.class.tell")}</p>
    <div class="buttons"><${Button} kind="danger" icon="stop" label=${t("stop.all")} onClick=${() => wish({ do: "stop_all" })} /><${Button} label=${t("studio.class.export")} onClick=${exported} /><${Button} label=${t("studio.class.leave")} onClick=${leave} /></div>
    ${pupils.length ? html`<ul class="rows pupils">${pupils.map((p) => html`<li key=${p.name} class=${p.error ? "bad" : ""}><span class="grow"><b>${p.name}${p.here ? "" : ` (${t("studio.class.away")})`}</b>
        <small>${p.robot} · ${t(`studio.phase.${p.phase}`)}${p.lit ? ` · ${p.lit}` : ""}</small><small>${p.program}${p.error ? ` · ${p.error}` : ""}</small></span>
        <span>${p.stars} ★${p.handed ? ` · ${t("studio.class.handed")}` : ""}</span><${Button} label=${t("studio.class.look")} onClick=${() => look(p.name)} /></li>`)}</ul>` : html`<p class="muted">${t("studio.class.empty")}</p>`}`;
}

export function Group() {
  if (grid.value) return html`<${Teacher} />`;
  if (group.value) {
    return html`<h2>${group.value.class || t("studio.tab.group")}</h2><p>${t("studio.class.in", { name: group.value.name, code: group.value.code })}</p>
      <div class="buttons"><${Button} kind="main" label=${t("studio.class.hand")} onClick=${() => { if (python().trim()) wish({ do: "hand_in", doing: doing(), style: JSON.stringify(whole()) }); else say(t("studio.empty")); }} /><${Button} label=${t("studio.class.leave")} onClick=${leave} /></div>`;
  }
  const joins = (e) => { e.preventDefault(); const f = new FormData(e.target); joinAs(String(f.get("code")), String(f.get("name"))); };
  const opens = (e) => { e.preventDefault(); teach("", String(new FormData(e.target).get("name"))); };
  return html`<form class="card" onSubmit=${joins}><h3>${t("studio.class.join")}</h3><label class="field"><span>${t("studio.class.code")}</span><input name="code" required maxlength="12" autocapitalize="characters" autocomplete="off" /></label>
      <label class="field"><span>${t("studio.class.name")}</span><input name="name" required maxlength="40" autocomplete="nickname" /></label><div class="buttons"><button class="button main">${t("studio.class.join")}</button></div></form>
    <form class="card" onSubmit=${opens}><h3>${t("studio.class.open")}</h3><label class="field"><span>${t("studio.class.called")}</span><input name="name" maxlength="40" /></label><div class="buttons"><button class="button">${t("studio.class.open")}</button></div></form>`;
}
