// The live view: map, tools to send the robot somewhere, and beside it what it is, does and has done.
import { signal } from "@preact/signals";
import { Button, Icon, can, doing, duration, fixed, html, lacks, person, robotWord, say, t } from "../base.js";
import { MapView } from "../map.js";
import { command, current, introduce, me, poses, simulated, stale, state, wanted, you } from "../link.js";
import { Drive } from "./drive.js";
import { later } from "./later.js";
import { Recording } from "./recording.js";

const tool = signal("go");
const drag = signal(/** @type {any} */ (null));
const route = signal(/** @type {number[][]} */ ([]));
const measure = signal(/** @type {any} */ (null));
const tab = signal("state");

const heading = (from, to) => Math.atan2(to[1] - from[1], to[0] - from[0]);

async function go(points, yaw) {
  const values = yaw === undefined ? { points } : { points, yaw };
  if ((await command("go_to", values)) !== undefined) say(t("going"));
}

const TOOLS = {
  go: {
    drag: (from, to) => { drag.value = [from, Math.hypot(to[0] - from[0], to[1] - from[1]) > 0.15 ? to : null]; },
    done: (from, to) => { drag.value = null; go([from], to ? heading(from, to) : undefined); },
    drop: () => { drag.value = null; },
  },
  route: { drag: () => {}, done: (from) => { route.value = [...route.value, from]; }, drop: () => {} },
  pan: null,
  ruler: { drag: (from, to) => { measure.value = [from, to]; }, done: () => {}, drop: () => {} },
};
const NEEDS = { go: "go_to", route: "go_to" };
const used = () => (can(NEEDS[tool.value]) && !lacks(NEEDS[tool.value]) ? tool.value : "pan");
const ICONS = { go: "goal", route: "route", pan: "hand", ruler: "ruler" };

function Tools() {
  return html`<div class="tools" role="toolbar" aria-label=${t("tools")}>
    ${Object.keys(TOOLS).map((name) => html`<${Button} compact icon=${ICONS[name]} label=${t(`tool.${name}`)} verb=${NEEDS[name]} on=${used() === name}
      onClick=${() => { tool.value = name; measure.value = null; route.value = []; }} />`)}
    ${used() === "route" && route.value.length > 0 && html`<${Button} kind="main" icon="play" label=${t("route.go", { n: route.value.length })} verb="go_to"
      onClick=${() => { go(route.value); route.value = []; }} />`}
  </div>
  <p class="hint">${t(`tool.${used()}.hint`)}</p>`;
}

function Row({ name, children, kind = "" }) {
  return html`<div class=${`row ${kind}`}><dt>${name}</dt><dd>${children}</dd></div>`;
}

const bag = (/** @type {string} */ words) => words.split(" ").sort().join();

function Faults() {
  const faults = state.value.faults;
  if (!faults.length) return stale.value ? null : html`<p class="allwell">${t("faults.none")}</p>`;
  return html`<ul class="faults">${faults.map((f) => html`<li class=${f.level.toLowerCase()}><${Icon} name="alert" size=${18} />
    <span><b>${robotWord(f.name)}</b>${bag(robotWord(f.message)) !== bag(robotWord(f.name)) && html`<small>${robotWord(f.message)}</small>`}</span></li>`)}</ul>`;
}

/** Seconds that are known to the minute. @param {number} seconds */
const minutes = (seconds) => (seconds >= 3600 ? duration(seconds) : t("time.whole", { m: Math.round(seconds / 60) }));

function Control() {
  const control = state.value.control, mine = control.taken_by && control.taken_by === you.value;
  const who = control.taken_by || control.holder;
  const word = control.taken_by ? (mine ? t("control.mine") : t("control.taken", { who: robotWord(who) })) : who ? t("control.moves", { who, doing: robotWord(control.doing) }) : t("control.free");
  return html`<div class="card"><h3>${t("control")}</h3><p class=${control.taken_by && !mine ? "warned" : ""}>${word}</p>
    ${!me.value.name && html`<label class="field"><span>${t("control.name")}</span><input value=${person.value} maxlength="40" autocomplete="nickname"
      onChange=${(e) => { person.value = e.target.value.trim() || person.value; introduce(); }} /></label>`}
    <div class="buttons">
      ${!mine && html`<${Button} label=${t("control.take")} verb="take_control" onClick=${() => command("take_control")} />`}
      ${control.taken_by && html`<${Button} label=${t("control.release")} verb="release_control" onClick=${() => command("release_control")} />`}
      ${mine && html`<${Button} label=${t("control.give")} verb="give_control" onClick=${() => { const to = prompt(t("control.give.to")); if (to) command("give_control", { to }); }} />`}
    </div></div>`;
}

function State() {
  const { about, battery, place, safety, drawings, faults } = state.value, pose = poses.value[current.value];
  if (about.recorded) return html`<div class="card"><h3>${t("condition")}</h3><p>${t("recorded.hint", { file: about.recorded })}</p></div>`;
  return html`<${Control} />
    <div class="card"><h3>${t("condition")}</h3><${Faults} />${stale.value && html`<p class="warned">${t("link.stale")}</p>`}<dl>
      ${battery && html`<${Row} name=${t("battery")} kind=${battery.low ? "bad" : ""}>${Math.round(battery.charge * 100)} %${battery.charging ? ` · ${t("charging")}` : ""}
        <small>${[battery.volts && `${battery.volts} V`, battery.amperes && `${battery.amperes} A`, battery.remaining && t("battery.left", { time: minutes(battery.remaining) })].filter(Boolean).join(" · ")}</small><//>`}
      ${pose && html`<${Row} name=${t("pose")}>x ${fixed(pose[0])} · y ${fixed(pose[1])} m · ${Math.round(pose[2] * 180 / Math.PI)}°<//>
      ${!stale.value && pose[3] !== null && html`<${Row} name=${t("speed")}>${Math.hypot(pose[3], pose[4]).toFixed(2)} m/s · ${Math.round(pose[5] * 180 / Math.PI)}°/s<//>`}`}
      ${place.quality !== null && html`<${Row} name=${t("place.fit")} kind=${place.lost ? "bad" : ""}>${place.lost ? t("place.lost", { why: robotWord(place.lost) }) : `${Math.round(place.quality * 100)} %`}<//>`}
      ${place.floor !== null && html`<${Row} name=${t("floor")}>${place.floor}<//>`}
      ${safety.docked !== null && html`<${Row} name=${t("dock")}>${safety.docked ? t("docked") : t("undocked")}<//>`}
      <${Row} name=${t("model")}>${about.maker} ${about.model}<small>${about.serial} · ${t("firmware")} ${about.firmware}</small><//>
    </dl>
    <div class="buttons">
      <${Button} icon="dock" label=${safety.docked ? t("undock") : t("dock.go")} verb="dock" onClick=${() => command(safety.docked ? "undock" : "dock")} />
      <${Button} kind="danger" icon="alert" label=${t("estop")} verb="emergency_stop" aria-disabled=${safety.emergency_stop ? "true" : undefined}
        onClick=${() => { if (!safety.emergency_stop) command("emergency_stop", { engage: true }); }} />
    </div></div>
    <details class="card"><summary>${t("list")}</summary>
      <p>${pose && t("list.robot", { name: current.value, x: fixed(pose[0], 1), y: fixed(pose[1], 1), yaw: Math.round(pose[2] * 180 / Math.PI) })}</p>
      <ul class="list">${drawings.places.map((p) => html`<li><span>${p.name}</span><small>${fixed(p.pose[0], 1)}, ${fixed(p.pose[1], 1)}</small>
        <${Button} label=${t("go")} of=${p.name} verb="go_to" onClick=${() => go([[p.pose[0], p.pose[1]]], p.pose[2])} /></li>`)}</ul>
      <p>${t("list.drawn", { lines: drawings.lines.length, areas: drawings.areas.length, docks: new Set([...drawings.docks.map((d) => d.pose), place.home].filter(Boolean).map(String)).size })}</p>
      ${can("go_to") && html`<form class="inline" onSubmit=${(e) => { e.preventDefault(); const f = new FormData(e.target); go([[Number(f.get("x")), Number(f.get("y"))]]); }}>
        <label>x <input name="x" type="number" step="0.1" required /></label><label>y <input name="y" type="number" step="0.1" required /></label>
        <${Button} type="submit" label=${t("go")} verb="go_to" /></form>`}
    </details>`;
}

function Running({ action }) {
  const f = action.feedback, navigating = f && typeof f === "object" && "stage" in f;
  const words = navigating ? `${robotWord(f.stage)} · ${f.meters.toFixed(1)} m${f.seconds ? ` · ${duration(f.seconds)}` : ""}` : typeof f === "string" ? robotWord(f) : "";
  return html`<li class="running"><b>${robotWord(action.name)}</b><span class="badge">${robotWord(action.status)}</span>
    <small>${action.client || t("itself")} · ${duration(action.seconds)}${words ? ` · ${words}` : ""}</small>
    <div class="buttons">
      <${Button} compact icon=${action.status === "PAUSED" ? "play" : "pause"} label=${action.status === "PAUSED" ? t("resume") : t("pause")} verb="pause"
        onClick=${() => command(action.status === "PAUSED" ? "resume" : "pause", { action: action.id })} />
      <${Button} compact icon="stop" label=${t("cancel")} verb="cancel" onClick=${() => command("cancel", { action: action.id })} /></div></li>`;
}

function Actions() {
  const { actions, history, refused } = state.value;
  return html`<div class="card"><h3>${t("actions.now")}</h3>
      ${actions.length ? html`<ul class="actions">${actions.map((a) => html`<${Running} key=${a.id} action=${a} />`)}</ul>` : html`<p class="muted">${doing(state.value) || t("actions.none")}</p>`}
      ${refused && html`<p class="warned">${t("actions.refused", { who: refused.client, doing: robotWord(refused.doing), why: refused.reason })}</p>`}</div>
    ${state.value.orders?.list.length ? html`<${Orders} />` : null}
    <div class="card"><h3>${t("actions.before")}</h3>
      ${history.length ? html`<ol class="actions">${history.map((a) => html`<li key=${a.id}><b>${robotWord(a.name)}</b><span class=${`badge ${a.status.toLowerCase()}`}>${robotWord(a.status)}</span>
        <small>${a.client || t("itself")} · ${duration(a.seconds)}</small>${a.reason && html`<em>${robotWord(a.reason)}</em>`}</li>`)}</ol>` : html`<p class="muted">${t("actions.nothing")}</p>`}</div><${Recording} />`;
}

const Orders = later(() => import("./orders.js").then((m) => m.Orders));
const plots = () => import("./plots.js").then((m) => m.Plots);
const note = () => { setTimeout(() => plots().catch(note), 2000); }; // from then on; without a server later
note();
const TABS = { state: State, drive: Drive, actions: Actions, plots: later(plots) };

/** After a mouse, arrow keys are the panel's: they drive there. */
export function Tabs({ tabs, chosen, label }) {
  const move = (event) => {
    const names = Object.keys(tabs), step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    chosen.value = names[(names.indexOf(chosen.value) + step + names.length) % names.length];
    event.currentTarget.querySelector(`#tab-${chosen.value}`).focus();
  };
  return html`<div class="tabs" role="tablist" aria-label=${label} onKeyDown=${move}>${Object.keys(tabs).map((name) => html`
    <button type="button" role="tab" id=${`tab-${name}`} aria-selected=${String(chosen.value === name)} aria-controls="panel" tabindex=${chosen.value === name ? 0 : -1}
      onClick=${(e) => { chosen.value = name; if (e.detail) document.getElementById("panel")?.focus({ preventScroll: true }); }}>${t(`tab.${name}`)}</button>`)}</div>`;
}

export function Live() {
  const overlay = { arrow: drag.value, spots: route.value, measure: measure.value };
  const Shown = TABS[tab.value];
  return html`<div class="split">
    <${MapView} tool=${TOOLS[used()]} overlay=${overlay}><${Tools} />
      ${simulated.value && wanted.value.truth && html`<p class="legend">${t("truth.legend")}</p>`}<//>
    <aside><${Tabs} tabs=${TABS} chosen=${tab} label=${t("panels")} />
      <div id="panel" class="panel" role="tabpanel" aria-labelledby=${`tab-${tab.value}`} tabindex="0"><h2 class="unseen">${t(`tab.${tab.value}`)}</h2>${state.value ? html`<${Shown} />` : html`<p class="muted">${t("link.opening")}</p>`}</div></aside>
  </div>`;
}
