// The frame of the page: header, views, messages.
import { render } from "preact";
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, Icon, html, lacks, language, loadWords, notice, place, robotWord, t, theme } from "./base.js";
import { age, changeWorld, choose, command, connect, current, hello, me, pace, recording, signOut, state, status, stopRobot, want } from "./link.js";
import { Live } from "./views/live.js";
import { later } from "./views/later.js";

const SignIn = later(() => import("./views/sign.js").then((m) => m.SignIn));
const Wire = later(() => import("./views/wire.js").then((m) => m.Wire));
const World = later(() => import("./views/world.js").then((m) => m.World));
const Robots = later(() => import("./views/robots.js").then((m) => m.Robots));
const Recordings = later(() => import("./views/recordings.js").then((m) => m.Recordings));
const Class = later(() => import("./views/class.js").then((m) => m.Class));

const VIEWS = { live: ["map", Live], wire: ["wire", Wire], world: ["world", World], robots: ["robots", Robots], recordings: ["dot", Recordings], class: ["school", Class] };
const named = () => (Object.hasOwn(VIEWS, location.hash.slice(2)) ? location.hash.slice(2) : "live");
const view = signal(named());
addEventListener("hashchange", () => { view.value = named(); });

function Stop() {
  return html`<button type="button" class="stop" onClick=${stopRobot} title=${lacks("stop") || t("stop.hint")} aria-disabled=${lacks("stop") ? "true" : undefined}>
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

function Person() {
  if (me.value.name) return html`<${Button} kind="plain" icon="leave" label=${me.value.name} title=${t("sign.out.of", { name: me.value.name })} onClick=${signOut} />`;
  return me.value.asks && status.value === "open" ? html`<${Button} kind="plain" icon="person" label=${t("sign.in")} onClick=${() => { status.value = "out"; }} />` : null;
}

function Header() {
  const robots = hello.value?.robots ?? [];
  return html`<header>
    <a class="brand" href="#/live"><img src="/icon.svg" alt="" width="28" height="28" /><b>roboglot</b></a>
    ${robots.length > 0 && html`<label class="robot"><span>${t("robot")}</span>
      <select value=${current.value} onChange=${(e) => choose(e.target.value)}>
        ${robots.map((r) => html`<option>${r.name}</option>`)}
      </select></label>`}
    <${Link} /><${Charge} /><${Pace} />${recording.value && html`<span class="chip bad" title=${t("record")}>● REC</span>`}
    <span class="grow"></span><${Person} />
    <button type="button" class="button plain" lang=${language.value === "zh" ? "en" : "zh-CN"}
      onClick=${() => { language.value = language.value === "zh" ? "en" : "zh"; }}>${language.value === "zh" ? "EN" : "中文"}</button>
    <${Button} compact kind="plain" icon=${theme.value === "dark" ? "sun" : "moon"} label=${t("theme")}
      onClick=${() => { theme.value = theme.value === "dark" ? "light" : "dark"; }} />
    ${robots.length > 0 && html`<${Stop} />`}
  </header>`;
}

function Nav() {
  return html`<nav aria-label=${t("views")}>${Object.entries(VIEWS).filter(([name]) => (name === "class" ? hello.value?.teacher : name !== "recordings" || hello.value?.all)).map(([name, [icon]]) => html`
    <a class=${name === "recordings" ? "seldom" : ""} href=${`#/${name}`} aria-current=${view.value === name ? "page" : undefined}><${Icon} name=${icon} size=${22} /><span>${t(`view.${name}`)}</span></a>`)}
    <a href="/studio/"><${Icon} name="blocks" size=${22} /><span>${t("view.studio")}</span></a></nav>`;
}

function Pace() {
  const { paused, speed } = pace.value;
  if (!paused && speed === 1) return null;
  return html`<span class="chip" title=${t("clock.speed")}>${paused ? t("clock.stands") : `× ${speed}`}</span>`;
}

/** Do what a banner offers; it goes then, and the keyboard is to have a place. @param {() => unknown} act */
function settle(act) { act(); /** @type {HTMLElement | null} */ (document.querySelector(".stop"))?.focus(); }

function Banner() {
  if (status.value === "lost") return html`<div class="banner bad" role="alert">${t("link.gone")}</div>`;
  if (pace.value.paused) return html`<div class="banner warn" role="status">${t("clock.paused")}
    <${Button} label=${t("clock.resume")} verb="resume_clock" onClick=${() => settle(() => changeWorld("resume_clock"))} /></div>`;
  const safety = state.value?.safety;
  if (safety?.emergency_stop) return html`<div class="banner bad" role="alert"><${Icon} name="alert" />${t("estop.on")}
    <${Button} label=${t("estop.release")} verb="emergency_stop" onClick=${() => settle(() => command("emergency_stop", { engage: false }))} /></div>`;
  const held = state.value?.orders?.held;
  if (held) return html`<div class="banner warn" role="status">${robotWord(held)}
    <${Button} label=${t("resume")} verb="resume_orders" onClick=${() => settle(() => command("resume_orders"))} /></div>`;
  if (safety?.power && safety.power !== "awake") return html`<div class="banner warn" role="status">${t("power.is", { mode: robotWord(safety.power) })}</div>`;
  return null;
}

function Notice() {
  return html`<div class=${`notice ${notice.value.bad ? "bad" : ""}`} role="status" aria-live="polite">${notice.value.text}</div>`;
}

function App() {
  useEffect(() => {
    const key = (event) => { if (event.key === "Escape" && !event.repeat) stopRobot(); };
    addEventListener("keydown", key);
    return () => removeEventListener("keydown", key);
  }, []);
  useEffect(() => want({ wire: view.value === "wire" }), [view.value]);
  const [, Shown] = VIEWS[view.value];
  if (status.value === "out") return html`<${Header} /><main class="lone"><${SignIn} /></main><${Notice} />`;
  return html`<${Header} /><${Nav} /><main>${!["robots", "recordings"].includes(view.value) && html`<h1 class="unseen">${t(`view.${view.value}`)} · ${t("robot.named", { name: current.value })}</h1>`}<${Banner} />${hello.value?.robots.length ? html`<${Shown} />` : html`<p class="empty">${t(hello.value ? "robots.hidden" : `link.${status.value}`)}</p>`}</main><${Notice} />`;
}

await loadWords();
render(html`<${App} />`, place());
connect();
