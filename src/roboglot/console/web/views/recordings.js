// The recordings in the data folder: watch, play back, compare, download, delete; and the one that is being made.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, duration, fetched, html, language, say, t } from "../base.js";
import { copied } from "../copies.js";
import { connections, current, recording } from "../link.js";
import { Recording } from "./recording.js";
import { Watch, watch, watchedFile } from "./watch.js";

const LOOK = 3000; // ms, while one is being made
const all = signal(/** @type {any[] | null} */ (null));
const failure = signal("");
const shown = signal(""); // the file whose command is shown
const first = signal(""); // the file that another is to be compared with
const compared = signal({ path: "", done: false }); // the comparison that is made, or can be seen

async function refresh() {
  try { all.value = await fetched("/api/recordings"); failure.value = ""; } catch (error) { failure.value = error.message; }
}

async function remove(file) {
  if (!confirm(t("recordings.sure", { file }))) return;
  try { await fetched("/api/recording", { do: "delete", file }); } catch (error) { say(t("refused", { why: error.message }), true); }
  if (first.value === file) first.value = "";
  await refresh();
}

async function copy(text) {
  if (await copied(text)) say(t("recordings.copied"));
}

/** Have a comparison made; a refusal is said on this page. The server keeps the last one for the page that opens it. @param {string} path */
async function compare(path) {
  compared.value = { path, done: false };
  try { await fetched(path); } catch (error) {
    if (compared.value.path === path) compared.value = { path: "", done: false };
    say(t("refused", { why: error.message }), true);
    return;
  }
  if (compared.value.path === path) compared.value = { path, done: true };
}

/** The robot of both that is compared: the one that is shown, if they have it. */
const robotOf = (one, other) => { const both = one.robots.filter((r) => other.robots.includes(r)); return both.includes(current.value) ? current.value : both[0] ?? ""; };

function Compared({ one }) {
  const other = all.value?.find((r) => r.file === first.value);
  if (!other) return html`<${Button} label=${t("recordings.compare")} of=${one.file} onClick=${() => { first.value = one.file; }} />`;
  if (other === one) return html`<${Button} label=${t("recordings.compare")} of=${one.file} on=${true} onClick=${() => { first.value = ""; }} />`;
  const robot = robotOf(other, one), path = `/api/recordings/${[other.file, "compared", one.file, robot].filter(Boolean).map(encodeURIComponent).join("/")}`;
  const mine = compared.value.path === path;
  if (mine && compared.value.done) return html`<a class="button main" target="_blank" rel="noopener" href=${path} aria-label=${`${t("recordings.show")}: ${one.file}`}>${t("recordings.show")}</a>`;
  return html`<${Button} kind="main" label=${t(mine ? "recordings.comparing" : "recordings.with")} of=${one.file} disabled=${mine} onClick=${() => compare(path)} />`;
}

function Row({ one }) {
  const megabytes = (one.bytes / 1e6).toFixed(1), several = one.parts.length > 1;
  const when = new Date(one.at * 1000).toLocaleString(language.value === "zh" ? "zh-CN" : "en-GB", { dateStyle: "medium", timeStyle: "short" });
  const length = one.running ? t("recordings.running") : one.seconds === null ? t("recordings.cut") : duration(one.seconds);
  return html`<li class="card"><h2>${one.file}</h2>
    <p class=${(one.seconds === null && !one.running) || one.damage ? "warned" : "muted"}>${[when, one.damage ? t("recordings.damaged", { why: one.damage }) : length, !one.running && `${megabytes} MB`, one.robots.length && `${t("robot")} ${one.robots.join(", ")}`, one.world].filter(Boolean).join(" · ")}</p>
    ${!one.running && html`<div class="buttons">${!one.damage && html`<${Button} kind="main" icon="play" label=${t("recordings.watch")} of=${one.file} onClick=${() => watch(one.file)} /><${Button} label=${t("recordings.play")} of=${one.file} on=${shown.value === one.file} onClick=${() => { shown.value = shown.value === one.file ? "" : one.file; }} />`}
      ${!one.damage && all.value && all.value.filter((r) => !r.running && !r.damage).length > 1 && html`<${Compared} one=${one} />`}
      ${one.parts.map((part, i) => html`<a class="button" href=${`/api/recordings/${encodeURIComponent(part.file)}`} download=${part.file} aria-label=${`${t("recordings.download")}: ${part.file}`}>${t("recordings.download")}${several ? ` ${i + 1}` : ""}</a>`)}
      <${Button} kind="danger" label=${t("remove")} of=${one.file} verb="record" onClick=${() => remove(one.file)} /></div>`}
    ${shown.value === one.file && html`<p>${t("recordings.play.hint")}</p><pre>${one.play}</pre><div class="buttons"><${Button} icon="copy" label=${t("recordings.copy")} onClick=${() => copy(one.play)} /></div>`}</li>`;
}

export function Recordings() {
  const on = recording.value;
  useEffect(() => { refresh(); if (!on) return undefined; const timer = setInterval(refresh, LOOK); return () => clearInterval(timer); }, [on, connections.value]);
  if (watchedFile()) return html`<${Watch} />`;
  return html`<section class="robots recordings" aria-label=${t("view.recordings")}><div class="bar"><h1>${t("view.recordings")}</h1></div>
    <${Recording} />
    ${failure.value ? html`<p class="warned">${t("refused", { why: failure.value })}</p>` : all.value && !all.value.length ? html`<p class="muted">${t("recordings.none")}</p>` : null}
    ${first.value && html`<p role="status">${t("recordings.choose", { file: first.value })}</p>`}
    <ul>${(all.value ?? []).map((one) => html`<${Row} key=${one.file} one=${one} />`)}</ul></section>`;
}
