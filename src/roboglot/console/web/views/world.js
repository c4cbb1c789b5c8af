// The workshop: change a simulated world, and draw on the robot's map.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, can, html, lacks, robotWord, say, t } from "../base.js";
import { MapView, floorShown as floor, toWorld } from "../map.js";
import { changeWorld, command, current, hello, poses, simulated, state, truth, want } from "../link.js";
import { Clock } from "./clock.js";
import { Tabs } from "./live.js";
import { Maps } from "./maps.js";

const tool = signal("box");
const shape = signal(/** @type {any} */ (null));
const tab = signal("people");
const kind = signal("low_battery");
const someone = signal("");
const REACH = 0.5; // m from the middle of what is taken

const facing = (from, to) => (to ? Math.atan2(to[1] - from[1], to[0] - from[0]) : 0);
const arrow = (from, to) => { shape.value = { arrow: [from, Math.hypot(to[0] - from[0], to[1] - from[1]) > 0.15 ? to : null] }; };
const drop = () => { shape.value = null; };
const inWorld = (from, to) => { const [x, y, yaw] = toWorld([from[0], from[1], facing(from, to)]); return { x, y, yaw }; };

async function draw(verb, values) { if ((await command(verb, values)) !== undefined) say(t("drawn")); }

const put = (verb) => ({ drag: arrow, drop, done: (from, to) => { drop(); changeWorld(verb, { ...inWorld(from, to), floor: floor() }); } });

const chosenPerson = () => { const names = Object.keys(truth.value?.people ?? {}); return names.includes(someone.value) ? someone.value : names[0]; };

/** What stands within reach of a place in the world, and how it is put elsewhere. */
function under({ x, y }) {
  const numbered = (name) => ({ number: Number(name), floor: floor() });
  const kinds = { boxes: { verb: "move_box", what: numbered }, tags: { verb: "move_tag", what: numbered },
    things: { verb: "move_thing", what: (thing) => ({ thing }) }, people: { verb: "place_person", what: (person) => ({ person }) } };
  let nearest = null, best = REACH;
  for (const [group, { verb, what }] of Object.entries(kinds)) for (const [name, p] of Object.entries(truth.value?.[group] ?? {})) {
    const away = Math.hypot(p[0] - x, p[1] - y);
    if (p[3] === floor() && away < best) { best = away; nearest = { verb, what: what(name) }; }
  }
  return nearest;
}

const WORLD_TOOLS = {
  box: put("add_box"),
  visitor: put("add_person"),
  person: { drag: arrow, drop, done: (from) => { drop(); const { x, y } = inWorld(from, null), person = chosenPerson();
    if (person) changeWorld("move_person", { person, x, y }); else say(t("people.none"), true); } },
  tag: { drag: arrow, drop, done: (from, to) => { drop(); const text = prompt(t("tag.text"), "0");
    if (text) changeWorld("add_tag", { text, kind: /^\d+$/.test(text) ? "april" : "qr", ...inWorld(from, to), floor: floor() }); } },
  sound: { drag: arrow, drop, done: (from) => { drop(); const { x, y } = inWorld(from, null); changeWorld("make_sound", { x, y, floor: floor() }); } },
  move: { drag: arrow, drop, done: (from, to) => { drop(); const held = to && under(inWorld(from, null));
    if (held) { const { x, y } = inWorld(to, null); changeWorld(held.verb, { ...held.what, x, y }); }
    else changeWorld("place_robot", { robot: current.value, ...inWorld(from, to), floor: floor() }); } },
};
const MAP_TOOLS = {
  place: { drag: arrow, drop, done: (from, to) => { drop(); const name = prompt(t("place.name")); if (name) draw("add_place", { name, x: from[0], y: from[1], yaw: facing(from, to) }); } },
  wall: { drag: (from, to) => { shape.value = { line: [from, to] }; }, drop, done: (from, to) => { drop(); if (to) draw("add_line", { kind: "wall", start: from, end: to }); } },
  track: { drag: (from, to) => { shape.value = { line: [from, to] }; }, drop, done: (from, to) => { drop(); if (to) draw("add_line", { kind: "track", start: from, end: to }); } },
  area: { drag: (from, to) => { shape.value = { rectangle: [from, to] }; }, drop, done: (from, to) => { drop(); if (to) draw("add_area", rectangle(from, to)); } },
};
const NEEDS = { box: "add_box", tag: "add_tag", sound: "make_sound", visitor: "add_person", person: "move_person", move: "place_robot", place: "add_place", wall: "add_line", track: "add_line", area: "add_area" };
const ICONS = { box: "box", tag: "keys", sound: "bolt", visitor: "person", person: "route", move: "move", place: "place", wall: "wall", track: "route", area: "fit" };

function rectangle([x0, y0], [x1, y1]) {
  const middle = (y0 + y1) / 2;
  return { kind: "forbidden", start: [Math.min(x0, x1), middle], end: [Math.max(x0, x1), middle], half_width: Math.max(0.05, Math.abs(y1 - y0) / 2) };
}

function People() {
  return html`<div class="card"><h3>${t("robot.hands")}</h3><div class="buttons">
      <${Button} label=${t("hands.push")} verb="push" onClick=${() => changeWorld("push", { robot: current.value, x: 8 })} />
      <${Button} label=${t("hands.lift")} verb="lift" onClick=${() => changeWorld("lift", { robot: current.value, up: true })} />
      <${Button} label=${t("hands.letgo")} verb="lift" onClick=${() => changeWorld("lift", { robot: current.value, up: false })} />
      <${Button} label=${t("hands.plug")} verb="plug_in" onClick=${() => changeWorld("plug_in", { robot: current.value, wire: true })} />
      <${Button} label=${t("hands.unplug")} verb="plug_in" onClick=${() => changeWorld("plug_in", { robot: current.value, wire: false })} /></div></div>
    ${hello.value.whole ? html`<${Figures} />` : html`<p class="muted">${t("world.hidden")}</p>`}`;
}

function Figures() {
  const names = Object.keys(truth.value?.people ?? {}), boxes = Object.keys(truth.value?.boxes ?? {}), tags = Object.entries(truth.value?.tags ?? {});
  const chosen = chosenPerson();
  return html`<div class="card"><h3>${t("people")}</h3>${names.length ? html`<ul class="list">${names.map((name) => html`<li>
      <${Button} label=${name} on=${chosen === name} onClick=${() => { someone.value = name; tool.value = "person"; }} />${chosen === name && html`
      <${Button} label=${t("people.resume")} of=${name} verb="resume_person" onClick=${() => changeWorld("resume_person", { person: name })} />
      <${Button} label=${t("say")} of=${name} verb="person_says" onClick=${() => { const text = prompt(t("say.text")); if (text) changeWorld("person_says", { person: name, text }); }} />
      <${Button} label=${t("remove")} of=${name} verb="remove_person" onClick=${() => changeWorld("remove_person", { person: name })} />`}</li>`)}</ul>` : html`<p class="muted">${t("people.none")}</p>`}</div>
    <div class="card"><h3>${t("boxes")}</h3>${boxes.length ? html`<ul class="list">${boxes.map((number) => html`<li><span>${t("box.number", { number })}</span>
      <${Button} label=${t("remove")} of=${t("box.number", { number })} verb="remove_box" onClick=${() => changeWorld("remove_box", { number: Number(number) })} /></li>`)}</ul>` : html`<p class="muted">${t("boxes.none")}</p>`}</div>
    <div class="card"><h3>${t("tags")}</h3>${tags.length ? html`<ul class="list">${tags.map(([number, p]) => html`<li><span>${p[4]}</span>
      <${Button} label=${t("remove")} of=${p[4]} verb="remove_tag" onClick=${() => changeWorld("remove_tag", { number: Number(number) })} /></li>`)}</ul>` : html`<p class="muted">${t("tags.none")}</p>`}</div>`;
}

function Faults() {
  const kinds = hello.value.fault_kinds, chosen = kinds.find((k) => k.name === kind.value) ?? kinds[0], active = truth.value?.faults ?? [];
  const inject = (event) => {
    event.preventDefault();
    const form = new FormData(event.target), options = {};
    for (const [name, fallback] of Object.entries(chosen.options)) {
      const given = String(form.get(`option-${name}`) ?? "").trim();
      if (given && given !== String(fallback)) options[name] = Number.isNaN(Number(given)) ? given : Number(given);
    }
    const seconds = Number(form.get("duration"));
    changeWorld("inject_fault", { kind: chosen.name, robot: chosen.of_robot ? current.value : null, options, ...(seconds > 0 ? { duration: seconds } : {}) });
  };
  return html`<form class="card" onSubmit=${inject}><h3>${t("fault.new")}</h3>
      <label class="field"><span>${t("fault.kind")}</span><select value=${chosen.name} onChange=${(e) => { kind.value = e.target.value; }}>
        ${kinds.map((k) => html`<option value=${k.name}>${robotWord(k.name)}</option>`)}</select></label>
      ${Object.entries(chosen.options).map(([name, fallback]) => html`<label class="field" key=${`${chosen.name}-${name}`}><span>${t(`option.${name}`)}</span>
        <input name=${`option-${name}`} defaultValue=${fallback ?? ""} placeholder=${fallback === null ? t("fault.chosen") : ""} /></label>`)}
      <label class="field"><span>${t("fault.seconds")}</span><input name="duration" type="number" min="0" step="1" placeholder=${t("fault.forever")} /></label>
      <${Button} type="submit" kind="main" label=${t("fault.inject")} verb="inject_fault" /></form>
    <div class="card"><h3>${t("fault.active")}</h3>${active.length ? html`<ul class="list">${active.map((f) => html`<li><span>${robotWord(f.kind)}<small>${f.robot ?? t("building")}</small></span>
      <${Button} label=${t("fault.clear")} of=${`${robotWord(f.kind)}, ${f.robot ?? t("building")}`} verb="clear_fault" onClick=${() => changeWorld("clear_fault", { number: f.number })} /></li>`)}</ul>` : html`<p class="muted">${t("fault.none")}</p>`}</div>`;
}

function Drawn() {
  const drawn = state.value.drawings;
  const rows = [
    ...drawn.places.map((p) => [p.name, t("tool.place"), () => command("remove_place", { id: p.id })]),
    ...drawn.lines.map((l) => [`${robotWord(l.kind)} ${l.id}`, t("line"), () => command("remove_drawing", { id: l.id })]),
    ...drawn.areas.map((a) => [`${robotWord(a.kind)} ${a.id}`, t("area"), () => command("remove_drawing", { id: a.id })]),
  ];
  const here = poses.value[current.value];
  return html`<div class="card"><h3>${t("map")}</h3><div class="buttons">
      <${Button} label=${t("place.here")} verb="add_place" onClick=${() => { const name = here && prompt(t("place.name")); if (name) draw("add_place", { name, x: here[0], y: here[1], yaw: here[2] }); }} />
      <${Button} label=${t("home.here")} verb="set_home" onClick=${() => command("set_home")} />
      <${Button} label=${t("relocalize")} verb="relocalize" onClick=${() => command("relocalize")} />
      <${Button} label=${t("mapping")} on=${Boolean(state.value.place.mapping)} verb="mapping" onClick=${() => command("mapping", { on: !state.value.place.mapping })} />
      <${Button} kind="danger" label=${t("map.clear")} verb="clear_map" onClick=${() => { if (confirm(t("map.clear.sure"))) command("clear_map"); }} /></div></div>
    <div class="card"><h3>${t("drawn.title")}</h3>${rows.length ? html`<ul class="list">${rows.map(([name, what, remove]) => html`<li><span>${name}<small>${what}</small></span>
      <${Button} label=${t("remove")} of=${name} verb="remove_drawing" onClick=${remove} /></li>`)}</ul>` : html`<p class="muted">${t("drawn.none")}</p>`}</div><${Maps} />`;
}

export function World() {
  useEffect(() => { want({ truth: simulated.value }); return () => want({ truth: false }); }, [simulated.value]);
  const drawn = can("mapping") && { drawn: Drawn }, tabs = simulated.value ? { people: People, faults: Faults, ...drawn, clock: Clock } : { drawn: Drawn };
  const Shown = tabs[tab.value] ?? Object.values(tabs)[0];
  const tools = Shown === Drawn ? MAP_TOOLS : WORLD_TOOLS;
  const used = [tool.value, ...Object.keys(tools)].find((name) => name in tools && can(NEEDS[name]) && !lacks(NEEDS[name])) ?? "";
  return html`<div class="split">
    <${MapView} tool=${tools[used]} overlay=${shape.value}>
      <div class="tools" role="toolbar" aria-label=${t("tools")}>${Object.keys(tools).map((name) => html`
        <${Button} compact icon=${ICONS[name]} label=${t(`tool.${name}`)} verb=${NEEDS[name]} on=${used === name} onClick=${() => { tool.value = name; }} />`)}</div>
      ${used && html`<p class="hint">${t(`tool.${used}.hint`)}</p>`}<//>
    <aside><${Tabs} tabs=${tabs} chosen=${tab} label=${t("panels")} />
      <div id="panel" class="panel" role="tabpanel" aria-labelledby=${`tab-${tab.value}`} tabindex="0"><h2 class="unseen">${t(`tab.${Object.keys(tabs).find((name) => tabs[name] === Shown)}`)}</h2>${state.value ? html`<${Shown} />` : null}</div></aside>
  </div>`;
}
