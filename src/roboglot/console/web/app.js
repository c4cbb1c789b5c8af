// The frame of the page: header with what must always be seen, the four views, messages.
import { render } from "preact";
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, Icon, html, language, loadWords, notice, robotWord, t, theme } from "./base.js";
import { age, changeWorld, choose, command, connect, current, hello, pace, state, status, want } from "./link.js";
import { Live } from "./views/live.js";
import { Robots } from "./views/robots.js";
import { Wire } from "./views/wire.js";
import { World } from "./views/world.js";

const VIEWS = { live: ["map", Live], wire: ["wire", Wire], world: ["world", World], robots: ["robots", Robots] };
const named = () => (location.hash.slice(2) in VIEWS ? location.hash.slice(2) : "live");
const view = signal(named());
addEventListener("hashchange", () => { view.value = named(); });

function Stop() {
  return html`<button type="button" class="stop" onClick=${() => command("stop")} title=${t("stop.hint")}>
    <${Icon} name="stop" size=${18} /><span>${t("stop")}</span><kbd>Esc</kbd></button>`;
}

function Link() {
  const ms = age.value;
  const word = status.value === "open" ? (ms === null ? "…" : `${Math.max(1, Math.round(ms))} ms`) : t(`link.${status.value}`);
  const late = status.value !== "open" ? "bad" : ms !== null && ms > 250 ? "warn" : "good";
  return html`<span class=${`link ${late}`} title=${t("link.title")}><i></i>${word}</span>`;
}

function Charge() {
  const battery = state.value?.battery;
  if (!battery) return null;
  return html`<span class=${`chip charge ${battery.low ? "bad" : ""}`} title=${t("battery")}>
    <${Icon} name=${battery.charging ? "bolt" : "battery"} size=${18} />${Math.round(battery.charge * 100)} %</span>`;
}

function Header() {
  const robots = hello.value?.robots ?? [];
  return html`<header>
    <a class="brand" href="#/live"><img src="/icon.svg" alt="" width="28" height="28" /><b>roboglot</b></a>
    <label class="robot"><span class="unseen">${t("robot")}</span>
      <select value=${current.value} onChange=${(e) => choose(e.target.value)}>
        ${robots.map((r) => html`<option value=${r.name}>${t("robot.named", { name: r.name })}</option>`)}
      </select></label>
    <${Link} /><${Charge} /><${Pace} />
    <span class="grow"></span>
    <button type="button" class="button plain" lang=${language.value === "zh" ? "en" : "zh-CN"}
      onClick=${() => { language.value = language.value === "zh" ? "en" : "zh"; }}>${language.value === "zh" ? "EN" : "中文"}</button>
    <${Button} compact kind="plain" icon=${theme.value === "dark" ? "sun" : "moon"} label=${t("theme")}
      onClick=${() => { theme.value = theme.value === "dark" ? "light" : "dark"; }} />
    <${Stop} />
  </header>`;
}

function Nav() {
  return html`<nav aria-label=${t("views")}>${Object.entries(VIEWS).map(([name, [icon]]) => html`
    <a href=${`#/${name}`} aria-current=${view.value === name ? "page" : undefined}><${Icon} name=${icon} size=${22} /><span>${t(`view.${name}`)}</span></a>`)}
    <a href="/studio/"><${Icon} name="blocks" size=${22} /><span>${t("view.studio")}</span></a></nav>`;
}

function Pace() {
  const { paused, speed } = pace.value;
  if (!paused && speed === 1) return null;
  return html`<span class="chip" title=${t("clock.speed")}>${paused ? t("clock.stands") : `× ${speed}`}</span>`;
}

function Banner() {
  if (status.value === "lost") return html`<div class="banner bad" role="alert">${t("link.gone")}</div>`;
  if (pace.value.paused) return html`<div class="banner warn" role="status">${t("clock.paused")}
    <${Button} label=${t("clock.resume")} onClick=${() => changeWorld("resume_clock")} /></div>`;
  const safety = state.value?.safety;
  if (safety?.emergency_stop) return html`<div class="banner bad" role="alert"><${Icon} name="alert" />${t("estop.on")}
    <${Button} label=${t("estop.release")} onClick=${() => command("emergency_stop", { engage: false })} /></div>`;
  if (safety?.power && safety.power !== "awake") return html`<div class="banner warn" role="status">${t("power.is", { mode: robotWord(safety.power) })}</div>`;
  return null;
}

function App() {
  useEffect(() => {
    const key = (event) => { if (event.key === "Escape" && !event.repeat) command("stop"); };
    addEventListener("keydown", key);
    return () => removeEventListener("keydown", key);
  }, []);
  useEffect(() => want({ wire: view.value === "wire" }), [view.value]);
  const [, Shown] = VIEWS[view.value];
  return html`<${Header} /><${Nav} /><main>${view.value !== "robots" && html`<h1 class="unseen">${t(`view.${view.value}`)} · ${t("robot.named", { name: current.value })}</h1>`}<${Banner} />${hello.value ? html`<${Shown} />` : html`<p class="empty">${t(`link.${status.value}`)}</p>`}</main>
    <div class=${`notice ${notice.value.bad ? "bad" : ""}`} role="status" aria-live="polite">${notice.value.text}</div>`;
}

await loadWords();
render(html`<${App} />`, document.getElementById("app"));
connect();
