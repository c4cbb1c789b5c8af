// All worlds of a fleet on one page, once a second; a click opens the world's own console.
import { render } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, Icon, doing, html, language, loadWords, place, robotWord, t, theme } from "../base.js";

const LOOK = 1000; // ms between two looks
const SEEN_MAX = 100; // robots that are asked for at once
const FEW = 8; // robots that need no filter

/** @type {import("@preact/signals").Signal<any[] | null>} */
const worlds = signal(null);
/** @type {import("@preact/signals").Signal<Record<string, any>>} */
const states = signal({});
const beat = signal(0);
const lost = signal(false);
const wanted = signal("");
/** Names of the robots on the screen. @type {Set<string>} */
const seen = new Set();

const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const name = /** @type {HTMLElement} */ (target).dataset.robot ?? "";
    if (isIntersecting) seen.add(name); else seen.delete(name);
  }
});

async function look() {
  if (!document.hidden) {
    try {
      const names = [...seen].slice(0, SEEN_MAX).map(encodeURIComponent).join(",");
      const answer = await fetch(`/api/fleet?seen=${names}`);
      if (!answer.ok) throw new Error(answer.statusText);
      const found = await answer.json();
      worlds.value = found.worlds;
      states.value = { ...states.value, ...found.robots };
      lost.value = false;
      beat.value += 1;
    } catch { lost.value = true; }
  }
  setTimeout(look, LOOK);
}

/** @param {{robot: any, world: any}} props */
function Tile({ robot, world }) {
  const self = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    const tile = self.current;
    if (!tile) return undefined;
    watcher.observe(tile);
    return () => { watcher.unobserve(tile); seen.delete(robot.name); };
  }, [robot.name]);
  const up = world.state === "ready", state = up ? states.value[robot.name] : undefined, known = state && !state.error;
  const worst = known ? ["FATAL", "ERROR", "WARNING"].find((level) => state.faults.some((/** @type {any} */ f) => f.level === level)) : undefined;
  const kind = up ? worst?.toLowerCase() ?? (lost.value ? "warning" : "") : "error";
  return html`<li class=${`tile ${kind}`} ref=${self} data-robot=${robot.name}>
    ${known && !lost.value && state.parts.includes("mapping") && html`<img class="thumbnail" src=${`/api/fleet/${encodeURIComponent(robot.name)}/map.png?beat=${seen.has(robot.name) ? beat.value : 0}`} alt=${t("robot.map", { name: robot.name })} />`}
    <h2>${t("robot.named", { name: robot.name })}<small>${robot.body} · ${robot.address}</small></h2>
    ${lost.value && html`<p class="warned">${t("link.stale")}</p>`}<dl><div class="row"><dt>${t("fleet.world")}</dt><dd>${world.name} · ${up ? t("fleet.pace", { factor: world.factor.toFixed(2) }) : t(`fleet.${world.state}`)}</dd></div>
      ${known && html`<div class="row"><dt>${t("battery")}</dt><dd class=${state.battery?.low ? "bad" : ""}>${state.battery ? `${Math.round(state.battery.charge * 100)} %` : "–"}${state.battery?.charging ? ` · ${t("charging")}` : ""}</dd></div>
      <div class="row"><dt>${t("task")}</dt><dd>${doing(state) || (state.safety.docked ? t("docked") : t("task.none"))}</dd></div>
      <div class="row"><dt>${t("control")}</dt><dd>${robotWord(state.control.taken_by || state.control.holder) || t("control.nobody")}</dd></div>`}</dl>
    ${!up && world.reason ? html`<p class="warned"><${Icon} name="alert" size=${16} />${t("fleet.why", { why: world.reason })}</p>` : null}
    ${state?.error ? html`<p class="muted">${t("fleet.why", { why: state.error })}</p>` : null}
    ${known && (state.safety.emergency_stop ? html`<p class="warned"><${Icon} name="alert" size=${16} />${t("estop.on")}</p>` : state.faults.length ? html`<p class="warned"><${Icon} name="alert" size=${16} />${robotWord(state.faults[0].name)}</p>` : !lost.value && html`<p class="allwell">${t("faults.none")}</p>`)}
    ${up && world.console && html`<div class="buttons"><a class="button main" href=${`${world.console}/?robot=${encodeURIComponent(robot.name)}#/live`} target="_blank" rel="noopener"><span>${t("show")}</span></a></div>`}</li>`;
}

/** Whether a robot fits the filter: by its name, body or address, or its world's name or state. @param {{robot: any, world: any}} row */
function fits({ robot, world }) {
  const words = [robot.name, robot.body, robot.address, world.name, world.state === "ready" ? "" : t(`fleet.${world.state}`)];
  return words.join(" ").toLowerCase().includes(wanted.value.trim().toLowerCase());
}

function Page() {
  const all = worlds.value ?? [], robots = all.flatMap((world) => world.robots.map((/** @type {any} */ robot) => ({ robot, world })));
  const shown = robots.filter(fits);
  const down = all.filter((world) => world.state !== "ready").length;
  return html`<header><a class="brand" href="/fleet/"><img src="/icon.svg" alt="" width="28" height="28" /><b>roboglot</b></a><span class="grow"></span>
      <button type="button" class="button plain" lang=${language.value === "zh" ? "en" : "zh-CN"} onClick=${() => { language.value = language.value === "zh" ? "en" : "zh"; }}>${language.value === "zh" ? "EN" : "中文"}</button>
      <${Button} compact kind="plain" icon=${theme.value === "dark" ? "sun" : "moon"} label=${t("theme")} onClick=${() => { theme.value = theme.value === "dark" ? "light" : "dark"; }} /></header>
    <main class="lone">${lost.value && html`<div class="banner bad" role="alert">${t("fleet.lost")}</div>`}
      <section class="robots" aria-label=${t("view.robots")}><div class="bar"><h1>${t("fleet.all", { robots: robots.length, worlds: all.length })}</h1>
      ${down > 0 && html`<span class="chip bad">${t("fleet.down", { n: down })}</span>`}
      <span class="muted" role="status">${wanted.value.trim() ? t("fleet.shown", { n: shown.length, all: robots.length }) : ""}</span>
      ${robots.length > FEW && html`<label class="filter"><span class="unseen">${t("fleet.filter")}</span><input type="search" placeholder=${t("fleet.filter")} value=${wanted.value} onInput=${(/** @type {any} */ e) => { wanted.value = e.target.value; }} /></label>`}</div>
      <ul class="tiles">${shown.map(({ robot, world }) => html`<${Tile} key=${robot.name} robot=${robot} world=${world} />`)}</ul></section></main>`;
}

loadWords("/words", "/fleet/words").then(() => {
  render(html`<${Page} />`, place());
  look();
});
