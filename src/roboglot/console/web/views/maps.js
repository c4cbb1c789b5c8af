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

const merging = signal(""); // the map whose place is asked for

function Merge() {
  const merge = (event) => {
    event.preventDefault();
    const form = new FormData(event.target), [x, y, degrees] = ["x", "y", "degrees"].map((name) => Number(form.get(name)));
    change("merge_map", { map: merging.value, x, y, yaw: degrees * Math.PI / 180 }, t("map.merged", { map: merging.value }));
    merging.value = "";
  };
  return html`<form class="inline" onSubmit=${merge}><p class="muted">${t("map.merge.hint", { map: merging.value })}</p>
    ${[["x", "x / m"], ["y", "y / m"], ["degrees", "°"]].map(([name, label]) => html`<label>${label} <input name=${name} type="number" step="any" defaultValue="0" required /></label>`)}
    <${Button} type="submit" kind="main" label=${t("map.merge")} verb="merge_map" /><${Button} label=${t("cancel")} onClick=${() => { merging.value = ""; }} /></form>`;
}

export function Maps() {
  useEffect(() => { refresh(); }, [current.value]);
  const save = async () => {
    const map = prompt(t("map.name"))?.trim();
    if (map) await refresh(); // another page may have stored one since
    if (map && (!kept.value.includes(map) || confirm(t("map.replace.sure", { map })))) await change("save_map", { map }, t("map.saved", { map }));
  };
  return html`<div class="card"><h3>${t("maps")}</h3>
    ${kept.value.length ? html`<ul class="list">${kept.value.map((map) => html`<li><span>${map}</span>
      <${Button} label=${t("map.load")} of=${map} verb="load_map" onClick=${() => { if (confirm(t("map.load.sure", { map }))) change("load_map", { map }, t("map.loading", { map })); }} />
      <${Button} label=${t("map.merge")} of=${map} verb="merge_map" on=${merging.value === map} onClick=${() => { merging.value = merging.value === map ? "" : map; }} />
      <${Button} label=${t("remove")} of=${map} verb="remove_map" onClick=${() => { if (confirm(t("map.remove.sure", { map }))) change("remove_map", { map }, t("map.removed", { map })); }} /></li>`)}</ul>` : html`<p class="muted">${t("maps.none")}</p>`}
    ${merging.value && html`<${Merge} />`}
    <div class="buttons"><${Button} label=${t("map.save")} verb="save_map" onClick=${save} />
      <a class="button" href=${`/api/robots/${current.value}/map.zip`} download="map.zip">${t("map.export")}</a></div></div>`;
}
