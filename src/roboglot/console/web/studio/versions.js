// Earlier versions of the program: when each was kept, what has changed since, and back to it.
import { signal } from "@preact/signals";
import { Button, html, t } from "../base.js";
import { back, plain, python, versions } from "./program.js";

const LINES_MAX = 600; // of two texts that are compared line by line
const compared = signal(0); // the version, by its time

const linesOf = (/** @type {string} */ code) => plain(code).split("\n").map((line) => line.trimEnd()).filter(Boolean);

/** Lines that went and came, in order; null if there are too many. @param {string[]} old @param {string[]} now */
export function difference(old, now) {
  if (old.length > LINES_MAX || now.length > LINES_MAX) return null;
  const common = Array.from({ length: old.length + 1 }, () => new Uint16Array(now.length + 1));
  for (let i = old.length - 1; i >= 0; i--) for (let j = now.length - 1; j >= 0; j--) common[i][j] = old[i] === now[j] ? common[i + 1][j + 1] + 1 : Math.max(common[i + 1][j], common[i][j + 1]);
  const found = /** @type {{sign: "+" | "−", text: string}[]} */ ([]);
  for (let i = 0, j = 0; i < old.length || j < now.length;) {
    if (i < old.length && j < now.length && old[i] === now[j]) { i += 1; j += 1; } else if (j === now.length || (i < old.length && common[i + 1][j] >= common[i][j + 1])) found.push({ sign: "−", text: old[i++] });
    else found.push({ sign: "+", text: now[j++] });
  }
  return found;
}

/** What has changed since then. @param {{body: string}} props */
function Changes({ body }) {
  const found = difference(linesOf(body), linesOf(python()));
  if (!found?.length) return html`<p class="muted" role="status">${t(found ? "studio.versions.same" : "studio.versions.long")}</p>`;
  return html`<ol class="printed changes" role="status" aria-label=${t("studio.versions.compare")}>${found.map(({ sign, text }) => html`<li class=${sign === "+" ? "came" : "went"}>${sign} ${text}</li>`)}</ol>`;
}

/** @param {{saved: number}} version */
const when = ({ saved }) => new Date(saved).toLocaleString(document.documentElement.lang);

/** @param {{done: () => void}} props */
export function Versions({ done }) {
  const old = versions();
  if (!old.length) return null;
  return html`<h3>${t("studio.versions")}</h3><ul class="rows">${old.map((/** @type {any} */ v) => html`<li key=${v.saved}><span class="grow"><b>${when(v)}</b><small>${v.name || t("studio.untitled")} · ${t("studio.versions.lines", { n: linesOf(v.body).length })}</small></span>
      <${Button} label=${t("studio.versions.compare")} of=${when(v)} on=${compared.value === v.saved} onClick=${() => { compared.value = compared.value === v.saved ? 0 : v.saved; }} />
      <${Button} label=${t("studio.open")} of=${when(v)} onClick=${() => { back(v); done(); }} />
      ${compared.value === v.saved && html`<${Changes} body=${v.body} />`}</li>`)}</ul>`;
}
