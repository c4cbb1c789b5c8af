// The time of a simulated world: how fast it passes, whether it passes at all; and the world as a file.
import { Button, html, t } from "../base.js";
import { changeWorld, clock, hello, pace } from "../link.js";

const SPEEDS = [0.25, 0.5, 1, 2, 5, 10];
const STEPS = [0.1, 1, 10]; // s

function Seed() {
  const { seed } = pace.value;
  return html`<div class="card"><h3>${t("seed")}</h3><p class="muted">${t("seed.hint")}</p>
    <form class="inline" onSubmit=${(e) => { e.preventDefault(); changeWorld("reseed", { seed: Number(new FormData(e.target).get("seed")) }); }}>
      <label class="grow"><span class="unseen">${t("seed")}</span><input name="seed" type="number" min="0" max="2147483647" step="1" required key=${seed} defaultValue=${seed} /></label>
      <${Button} type="submit" label=${t("seed.change")} verb="reseed" /></form></div>`;
}

export function Clock() {
  const { paused, speed, lockstep, behind } = pace.value;
  if (lockstep) return html`<div class="card"><h3>${t("clock")}</h3><p>${t("clock.lockstep")}</p></div>`;
  return html`<div class="card"><h3>${t("clock")}</h3>
      <p class="time" aria-live="off">${t("clock.is", { time: clock.value.toFixed(1), speed })}</p>
      <div class="buttons"><${Button} kind="main" icon=${paused ? "play" : "pause"} label=${t(paused ? "clock.resume" : "clock.pause")} verb="pause_clock" onClick=${() => changeWorld(paused ? "resume_clock" : "pause_clock")} />
        ${STEPS.map((seconds) => html`<${Button} label=${t("clock.step", { seconds })} verb="step_clock" onClick=${() => changeWorld("step_clock", { seconds })} />`)}</div>
      <h3>${t("clock.speed")}</h3>
      <div class="buttons">${SPEEDS.map((each) => html`<${Button} label=${`× ${each}`} on=${each === speed} verb="set_clock_speed" onClick=${() => changeWorld("set_clock_speed", { speed: each })} />`)}</div>
      <p class="muted">${t(behind > 1 ? "clock.behind" : "clock.hint", { behind: behind | 0 })}</p></div>
    <div class="card"><h3>${t("world.file")}</h3><p>${t("world.named", { world: hello.value.world, seed: pace.value.seed })}</p>
      <div class="buttons"><a class="button" href="/api/world.toml" download="world.toml">${t("world.save")}</a></div>
      <p class="muted">${t("world.hint")}</p></div>
    <${Seed} />`;
}
