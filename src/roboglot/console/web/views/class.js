// The class: pupils join by a code and get a robot each; the teacher sees who is where, locks, resets, gives back.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, doing, fetched, html, say, t, translated } from "../base.js";
import { choose, states } from "../link.js";

const LOOK = 1000; // ms between two looks at who is there
const group = signal(/** @type {any} */ (null)), failure = signal("");

/** @param {object} [wish] */
async function ask(wish) {
  try { group.value = await fetched("/api/class", wish); failure.value = ""; } catch (error) { if (wish) say(t("refused", { why: error.message }), true); else failure.value = error.message; }
}

function Open() {
  const open = (event) => { event.preventDefault(); const form = new FormData(event.target); ask({ do: "open", name: form.get("name"), minutes: Number(form.get("minutes")) }); };
  return html`<form class="card sign" onSubmit=${open}><h1>${t("class.open")}</h1><p class="muted">${t("class.hint")}</p>
    <label class="field"><span>${t("class.name")}</span><input name="name" maxlength="40" required /></label>
    <label class="field"><span>${t("class.minutes")}</span><input name="minutes" type="number" min="1" max="600" defaultValue="90" required /></label>
    <div class="buttons"><${Button} type="submit" kind="main" label=${t("class.open")} /></div></form>`;
}

function Pupil({ pupil }) {
  const state = states.value[pupil.robot], own = { pupil: pupil.identity };
  return html`<li class=${`tile ${pupil.here ? "" : "warning"}`}><h2>${pupil.name}<small>${t("robot.named", { name: pupil.robot })} · ${t(pupil.here ? "class.here" : "class.away")}</small></h2>
    <p>${pupil.locked ? t("class.locked") : doing(state) || t("task.none")}${state?.battery ? ` · ${Math.round(state.battery.charge * 100)} %` : ""}</p>
    <div class="buttons"><${Button} kind="main" label=${t("show")} of=${pupil.name} onClick=${() => { choose(pupil.robot); location.hash = "#/live"; }} />
      <${Button} label=${t(pupil.locked ? "class.unlock" : "class.lock")} of=${pupil.name} on=${pupil.locked} onClick=${() => ask({ do: pupil.locked ? "unlock" : "lock", ...own })} />
      <${Button} label=${t("class.reset")} of=${pupil.name} onClick=${() => ask({ do: "reset", ...own })} />
      <${Button} label=${t("class.back")} of=${pupil.name} onClick=${() => ask({ do: "give_back", ...own })} /></div></li>`;
}

export function Class() {
  useEffect(() => { ask(); const timer = setInterval(() => { if (!document.hidden) ask(); }, LOOK); return () => clearInterval(timer); }, []);
  if (!group.value) return failure.value && html`<p class="empty">${t("refused", { why: translated(failure.value) })}</p>`;
  if (!group.value.code) return html`<section class="robots" aria-label=${t("view.class")}><${Open} /></section>`;
  const { code, name, pupils, minutes } = group.value, locked = pupils.length > 0 && pupils.every((p) => p.locked);
  return html`<section class="robots" aria-label=${t("view.class")}><div class="bar"><div><h1>${t("class.named", { name })} <output class="code">${code}</output></h1>
      <p class="muted">${t("class.join", { address: `${location.host}/?code=${code}` })} · ${t("class.left", { minutes })}</p></div>
      <div class="buttons"><${Button} label=${t(locked ? "class.unlock.all" : "class.lock.all")} on=${locked} onClick=${() => ask({ do: locked ? "unlock" : "lock" })} />
        <${Button} label=${t("class.reset.all")} onClick=${() => ask({ do: "reset" })} />
        <${Button} kind="danger" label=${t("class.close")} onClick=${() => { if (confirm(t("class.close.sure"))) ask({ do: "close" }); }} /></div></div>
    ${pupils.length ? html`<ul class="tiles">${pupils.map((p) => html`<${Pupil} key=${p.identity} pupil=${p} />`)}</ul>` : html`<p class="empty">${t("class.none")}</p>`}</section>`;
}
