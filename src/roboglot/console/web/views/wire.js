// The wire view: every request, reply and push of all doors as they happen, and each of them to copy.
import { useEffect, useRef } from "preact/hooks";
import { batch, computed, effect, signal } from "@preact/signals";
import { Button, fetched, html, say, t } from "../base.js";
import { clock, connections, current, exchanges, hello, missed } from "../link.js";

// One row: [number, stamp, door, connection, client, direction, operation, status, refusal, ms, bytes, excerpt]
const [NUMBER, STAMP, DOOR, CONNECTION, CLIENT, DIRECTION, OPERATION, STATUS, REFUSAL, MS, BYTES, EXCERPT] = Array(12).keys();
const SHOWN_MAX = 400; // rows in the page at a time
const FORMS = { slamware: ["curl", "python"], robomaster: ["nc", "python"], cyberdog: ["grpcurl", "python"], visual: ["websocat", "python"] };

const door = signal("");
const text = signal("");
const refusedOnly = signal(false);
const pushes = signal(true);
const paused = signal(/** @type {any[][] | null} */ (null));
const opened = signal(0);
effect(() => { void current.value; void connections.value; batch(() => { paused.value = null; opened.value = 0; }); }); // rows of another robot
const helpings = signal(1); // of them

const doors = computed(() => [...new Set([...Object.keys(FORMS), ...exchanges.value.map((row) => row[DOOR]), door.value])].filter(Boolean));
const most = computed(() => SHOWN_MAX * helpings.value);
const found = computed(() => {
  const needle = text.value.trim().toLowerCase(), rows = paused.value ?? exchanges.value, newest = [];
  const fits = (row) => (!door.value || row[DOOR] === door.value) && (!refusedOnly.value || row[REFUSAL]) && (pushes.value || row[DIRECTION] !== "push")
    && (!needle || [CLIENT, CONNECTION, OPERATION, EXCERPT, REFUSAL].some((i) => row[i].toLowerCase().includes(needle)));
  for (let i = rows.length - 1; i >= 0 && newest.length <= most.value; i--) if (fits(rows[i])) newest.push(rows[i]);
  return newest.reverse();
});
const shown = computed(() => found.value.slice(-most.value));

/** What the server says of a message; a refusal is said. @param {string} what @param {object} [wish] */
async function over(what, wish) {
  try { return await fetched(`/api/robots/${current.value}/wire/${what}`, wish); } catch (error) { say(t("refused", { why: error.message }), true); return null; }
}

/** Loaded with the first message that is opened, so that a click is still one when it copies. @type {Promise<any> | null} */
let copies = null;

async function copy(number, form) {
  const { copied } = await copies;
  if (await copied(over(`${number}/${form}`))) say(t("copied", { form }));
}

async function sendAgain(number) {
  const words = await over(`${number}/resend`, {});
  if (words === null) return undefined;
  const [status, answer] = words.answers[0] ?? ["", ""];
  return say(t("wire.resent", { status, answer: answer.slice(0, 120) }));
}

function Line({ row, slowest }) {
  const open = opened.value === row[NUMBER], asks = row[DIRECTION] === "request";
  const toggle = () => { copies ??= import("../copies.js").catch((error) => { copies = null; throw error; }); opened.value = open ? 0 : row[NUMBER]; };
  const share = row[MS] && slowest ? Math.max(2, Math.log1p(row[MS]) / Math.log1p(slowest) * 100) : 0;
  return html`<li class=${`${row[DIRECTION]} ${row[REFUSAL] ? "refused" : ""} ${open ? "open" : ""}`}>
    <button type="button" class="line" aria-expanded=${String(open)} onClick=${toggle}>
      <time>${row[STAMP].toFixed(2)}</time><span class=${`door ${row[DOOR]}`}>${row[DOOR]}</span>
      <span class="way" title=${t(`way.${row[DIRECTION]}`)}>${{ request: "→", reply: "←", push: "⇠" }[row[DIRECTION]]}<span class="unseen">${t(`way.${row[DIRECTION]}`)}</span></span>
      <b>${row[OPERATION] || t("wire.unknown")}</b>
      <span class="excerpt">${row[REFUSAL] || row[EXCERPT].slice(0, 160)}</span>
      <span class="status">${row[STATUS]}</span>
      <span class="timing">${row[DIRECTION] === "reply" && html`<i style=${{ width: `${share}%` }}></i>${row[MS]} ms`}</span>
    </button>
    ${open && html`<div class="opened"><p><small>${row[CLIENT]} · ${row[CONNECTION]} · ${t("bytes", { n: row[BYTES] })}</small></p>
      ${row[REFUSAL] && html`<p class="warned">${t("wire.refused", { why: row[REFUSAL] })}</p>`}
      <pre tabindex="0">${pretty(row[EXCERPT])}</pre>
      ${asks && FORMS[row[DOOR]] && html`<div class="buttons">${FORMS[row[DOOR]].map((form) => html`<${Button} icon="copy" label=${t("copy.as", { form })} onClick=${() => copy(row[NUMBER], form)} />`)}
        <${Button} icon="play" label=${t("wire.resend")} verb="resend" onClick=${() => sendAgain(row[NUMBER])} /></div>`}</div>`}
  </li>`;
}

/** JSON with line breaks; anything else as it is. @param {string} words */
function pretty(words) {
  const cut = words.indexOf("\n\n"), [head, body] = cut > 0 ? [words.slice(0, cut + 2), words.slice(cut + 2)] : ["", words];
  try { return head + JSON.stringify(JSON.parse(body), null, 2); } catch { return words; }
}

export function Wire() {
  const list = useRef(null);
  const rows = shown.value;
  useEffect(() => { if (!paused.value && list.current) list.current.scrollTop = list.current.scrollHeight; }, [rows]);
  const slowest = rows.reduce((most, row) => Math.max(most, row[MS]), 0);
  return html`<section class="wire" aria-label=${t("view.wire")}>
    <div class="filters" role="search">
      <label><span class="unseen">${t("wire.door")}</span><select value=${door.value} onChange=${(e) => { door.value = e.target.value; }}>
        <option value="">${t("wire.all")}</option>${doors.value.map((d) => html`<option value=${d}>${d}</option>`)}</select></label>
      <label class="grow"><span class="unseen">${t("wire.filter")}</span><input type="search" placeholder=${t("wire.filter")} value=${text.value} onInput=${(e) => { text.value = e.target.value; }} /></label>
      <${Button} label=${t("wire.refusedonly")} on=${refusedOnly.value} onClick=${() => { refusedOnly.value = !refusedOnly.value; }} />
      <${Button} label=${t("wire.pushes")} on=${pushes.value} onClick=${() => { pushes.value = !pushes.value; }} />
      <${Button} icon=${paused.value ? "play" : "pause"} label=${t(paused.value ? "wire.goon" : "wire.pause")} onClick=${() => { helpings.value = 1; paused.value = paused.value ? null : exchanges.value; }} />
    </div>
    <p class="muted count">${t("wire.count", { n: rows.length, time: clock.value.toFixed(0) })}${missed.value ? ` · ${t("wire.missed", { n: missed.value })}` : ""}</p>
    ${rows.length ? html`<ol class="lines" ref=${list} tabindex="0" aria-label=${t("wire.lines")}>${paused.value && found.value.length > rows.length && html`<li><${Button} label=${t("wire.earlier")} onClick=${() => { helpings.value++; }} /></li>`}
      ${rows.map((row) => html`<${Line} key=${row[NUMBER]} row=${row} slowest=${slowest} />`)}</ol>`
      : html`<div class="empty"><h2>${t("wire.empty")}</h2><p>${t("wire.try")}</p><${Try} /></div>`}
  </section>`;
}

function Try() {
  const doors = (hello.value?.doors[current.value] ?? []).filter(([, , line]) => line && line.length < 140);
  return html`<ul class="try">${doors.map(([label, , line]) => html`<li><b>${label}</b><code>${line}</code></li>`)}</ul>`;
}
