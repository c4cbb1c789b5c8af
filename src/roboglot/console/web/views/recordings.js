// The recordings in the data folder: play back, compare, download, delete; and the one that is being made.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, duration, fetched, html, language, say, t } from "../base.js";
import { connections, current, recording } from "../link.js";
import { Recording } from "./recording.js";

const LOOK = 3000; // ms, while one is being made
const all = signal(/** @type {any[] | null} */ (null));
const failure = signal("");
const shown = signal(""); // the file whose command is shown
const first = signal(""); // the file that another is to be compared with

async function refresh() {
  try { all.value = await fetched("/api/recordings"); failure.value = ""; } catch (error) { failure.value = error.message; }
}

async function remove(file) {
  if (!confirm(t("recordings.sure", { file }))) return;
  try { await fetched("/api/recording", { do: "delete", file }); } catch (error) { say(t("refused", { why: error.message }), true); }
  await refresh();
}

async function copy(text) {
  try { await navigator.clipboard.writeText(text); say(t("recordings.copied")); } catch { prompt(t("copy.by.hand"), text); }
}

/** The robot of both that is compared: the one that is shown, if they have it. */
const robotOf = (one, other) => { const both = one.robots.filter((r) => other.robots.includes(r)); return both.includes(current.value) ? current.value : both[0] ?? ""; };

function Compared({ one }) {
  const other = all.value?.find((r) => r.file === first.value);
  if (!other) return html`<${Button} label=${t("recordings.compare")} of=${one.file} onClick=${() => { first.value = one.file; }} />`;
  if (other === one) return html`<${Button} label=${t("recordings.compare")} of=${one.file} on=${true} onClick=${() => { first.value = ""; }} />`;
  const robot = robotOf(other, one), path = [other.file, "compared", one.file, robot].filter(Boolean).map(encodeURIComponent).join("/");
  return html`<a class="button main" target="_blank" rel="noopener" href=${`/api/recordings/${path}`} aria-label=${`${t("recordings.with")}: ${one.file}`}>${t("recordings.with")}</a>`;
}

function Row({ one }) {
  const megabytes = (one.bytes / 1e6).toFixed(1), several = one.parts.length > 1;
  const when = new Date(one.at * 1000).toLocaleString(language.value === "zh" ? "zh-CN" : "en-GB", { dateStyle: "medium", timeStyle: "short" });
  const length = one.running ? t("recordings.running") : one.seconds === null ? t("recordings.cut") : duration(one.seconds);
  return html`<li class="card"><h2>${one.file}</h2>
    <p class=${one.seconds === null && !one.running ? "warned" : "muted"}>${[when, length, `${megabytes} MB`, one.robots.length && `${t("robot")} ${one.robots.join(", ")}`, one.world].filter(Boolean).join(" · ")}</p>
    ${!one.running && html`<div class="buttons"><${Button} icon="play" label=${t("recordings.play")} of=${one.file} on=${shown.value === one.file} onClick=${() => { shown.value = shown.value === one.file ? "" : one.file; }} />
      ${all.value && all.value.filter((r) => !r.running).length > 1 && html`<${Compared} one=${one} />`}
      ${one.parts.map((part, i) => html`<a class="button" href=${`/api/recordings/${encodeURIComponent(part.file)}`} download=${part.file} aria-label=${`${t("recordings.download")}: ${part.file}`}>${t("recordings.download")}${several ? ` ${i + 1}` : ""}</a>`)}
      <${Button} kind="danger" label=${t("remove")} of=${one.file} verb="record" onClick=${() => remove(one.file)} /></div>`}
    ${shown.value === one.file && html`<p>${t("recordings.play.hint")}</p><pre>${one.play}</pre><div class="buttons"><${Button} icon="copy" label=${t("recordings.copy")} onClick=${() => copy(one.play)} /></div>`}</li>`;
}

export function Recordings() {
  const on = recording.value;
  useEffect(() => { refresh(); if (!on) return undefined; const timer = setInterval(refresh, LOOK); return () => clearInterval(timer); }, [on, connections.value]);
  return html`<section class="robots recordings" aria-label=${t("view.recordings")}><div class="bar"><h1>${t("view.recordings")}</h1></div>
    <${Recording} />
    ${failure.value ? html`<p class="warned">${t("refused", { why: failure.value })}</p>` : all.value && !all.value.length ? html`<p class="muted">${t("recordings.none")}</p>` : null}
    ${first.value && html`<p role="status">${t("recordings.choose", { file: first.value })}</p>`}
    <ul>${(all.value ?? []).map((one) => html`<${Row} key=${one.file} one=${one} />`)}</ul></section>`;
}
