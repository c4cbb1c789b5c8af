// The maps that the robot keeps by name: save, load, forget; and the map in use as a file.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, html, say, t } from "../base.js";
import { ask, command, current } from "../link.js";

const kept = signal(/** @type {string[]} */ ([]));

async function refresh() {
  kept.value = await ask(current.value, "maps").catch(() => []);
}

async function change(verb, values, done) {
  if ((await command(verb, values)) !== undefined) say(done);
  await refresh();
}

export function Maps() {
  useEffect(() => { refresh(); }, [current.value]);
  const save = () => { const map = prompt(t("map.name")); if (map) change("save_map", { map }, t("map.saved", { map })); };
  return html`<div class="card"><h3>${t("maps")}</h3>
    ${kept.value.length ? html`<ul class="list">${kept.value.map((map) => html`<li><span>${map}</span>
      <${Button} label=${t("map.load")} verb="load_map" onClick=${() => change("load_map", { map }, t("map.loading", { map }))} />
      <${Button} label=${t("remove")} verb="remove_map" onClick=${() => { if (confirm(t("map.remove.sure", { map }))) change("remove_map", { map }, t("map.removed", { map })); }} /></li>`)}</ul>` : html`<p class="muted">${t("maps.none")}</p>`}
    <div class="buttons"><${Button} label=${t("map.save")} verb="save_map" onClick=${save} />
      <a class="button" href=${`/api/robots/${current.value}/map.zip`} download="map.zip">${t("map.export")}</a></div></div>`;
}
