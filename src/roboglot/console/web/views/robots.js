// All robots at a glance: charge, task, trouble, who has them; one click into one, one to stop them all.
import { useEffect, useState } from "preact/hooks";
import { Button, Icon, doing, fixed, html, robotWord, say, t, translated } from "../base.js";
import { ask, choose, hello, poses, states, status } from "../link.js";

/** Why a robot is not for this person to stop; empty: it is. */
const lacking = (robot) => (robot.rights.includes("drive") ? "" : t("right.missing", { right: t("right.drive") }));

async function stopAll() {
  const names = hello.value.robots.map((r) => r.name);
  const results = await Promise.allSettled(names.map((name) => ask(name, "stop")));
  const failed = names.flatMap((name, i) => (results[i].status === "rejected" ? `${name} (${translated(results[i].reason.message)})` : []));
  say(failed.length ? t("stopped.not", { names: failed.join(", ") }) : t("stopped.all", { n: names.length }), failed.length > 0);
}

const LOOK = 5000; // ms between two looks at the maps

function Thumbnail({ name }) {
  const [beat, next] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => { if (!document.hidden) next((n) => n + 1); }, LOOK);
    return () => clearInterval(timer);
  }, []);
  return html`<img class="thumbnail" loading="lazy" src=${`/api/robots/${name}/map.png?beat=${beat}`} alt=${t("robot.map", { name })} />`;
}

function Tile({ robot }) {
  const state = states.value[robot.name], pose = poses.value[robot.name];
  if (!state) return html`<li class="tile"><h2>${robot.name}</h2></li>`;
  const { battery, faults, control, safety, about } = state;
  const worst = ["FATAL", "ERROR", "WARNING"].find((level) => faults.some((f) => f.level === level));
  const lost = status.value === "lost";
  const open = () => { choose(robot.name); location.hash = "#/live"; };
  return html`<li class=${`tile ${worst ? worst.toLowerCase() : lost ? "warning" : ""}`}>
    ${pose && !lost && state.parts.includes("mapping") && html`<${Thumbnail} name=${robot.name} />`}<h2>${t("robot.named", { name: robot.name })}<small>${about.recorded || `${about.maker} ${about.model}`}</small></h2>
    ${lost && html`<p class="warned">${t("link.stale")}</p>`}<dl><div class="row"><dt>${t("battery")}</dt><dd class=${battery?.low ? "bad" : ""}>${battery ? `${Math.round(battery.charge * 100)} %` : "–"}${battery?.charging ? ` · ${t("charging")}` : ""}</dd></div>
      <div class="row"><dt>${t("task")}</dt><dd>${doing(state) || (safety.docked ? t("docked") : t("task.none"))}</dd></div>
      <div class="row"><dt>${t("control")}</dt><dd>${robotWord(control.taken_by || control.holder) || t("control.nobody")}</dd></div>
      <div class="row"><dt>${t("pose")}</dt><dd>${pose ? `${fixed(pose[0], 1)}, ${fixed(pose[1], 1)} m` : "–"}</dd></div></dl>
    ${safety.emergency_stop ? html`<p class="warned"><${Icon} name="alert" size=${16} />${t("estop.on")}</p>` : faults.length ? html`<p class="warned"><${Icon} name="alert" size=${16} />${robotWord(faults[0].name)}${faults.length > 1 ? ` +${faults.length - 1}` : ""}</p>` : !lost && html`<p class="allwell">${t("faults.none")}</p>`}
    <div class="buttons"><${Button} kind="main" label=${t("show")} of=${robot.name} onClick=${open} /><${Button} icon="stop" label=${t("stop")} of=${robot.name} why=${lacking(robot)} onClick=${() => ask(robot.name, "stop").catch((e) => say(e.message, true))} /></div></li>`;
}

export function Robots() {
  return html`<section class="robots" aria-label=${t("view.robots")}><div class="bar"><h1>${t("robots.all", { n: hello.value.robots.length, world: hello.value.world })}</h1>
    <${Button} kind="danger" icon="stop" label=${t("stop.all")} why=${hello.value.robots.every(lacking) ? lacking(hello.value.robots[0]) : ""} onClick=${stopAll} /></div>
    <ul class="tiles">${hello.value.robots.map((robot) => html`<${Tile} key=${robot.name} robot=${robot} />`)}</ul></section>`;
}
