// Records all that robots say, hear, see and do: begin, mark, end.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, duration, fetched, html, say, t, translated } from "../base.js";
import { connections, hello, recording } from "../link.js";

const LOOK = 1000; // ms
const known = signal(/** @type {any} */ (null));

/** @param {object} [wish] */
async function ask(wish) {
  try {
    known.value = await fetched("/api/recording", wish);
    return known.value;
  } catch (error) {
    if (wish) say(t("refused", { why: error.message }), true);
    return null;
  }
}

async function end() {
  const words = await ask({ do: "stop" });
  if (words) say(t("record.kept", { file: words.file, megabytes: (words.bytes / 1e6).toFixed(1) }));
}

export function Recording() {
  const on = recording.value;
  useEffect(() => { ask(); if (!on) return undefined; const timer = setInterval(ask, LOOK); return () => clearInterval(timer); }, [on, connections.value]);
  if (!known.value) return null;
  const { seconds, bytes, file, failure } = known.value;
  return html`<div class="card"><h3 aria-level=${location.hash === "#/recordings" ? 2 : 3}>${t("record")}</h3><p class=${failure ? "warned" : "muted"}>${translated(failure) || (on ? t("record.on", { file, time: duration(seconds), megabytes: (bytes / 1e6).toFixed(1) }) : t("record.hint"))}</p>
    <div class="buttons"><${Button} kind=${on ? "danger" : ""} icon=${on ? "stop" : "dot"} label=${t(on ? "record.stop" : "record.start")} verb="record" onClick=${() => (on ? end() : ask({ do: "start" }))} />
      ${on && html`<${Button} label=${t("record.mark")} verb="record" onClick=${() => { const text = prompt(t("record.words")); if (text) ask({ do: "mark", text }); }} />`}
      ${hello.value?.all && location.hash !== "#/recordings" && html`<a class="button" href="#/recordings">${t("view.recordings")}</a>`}</div></div>`;
}
