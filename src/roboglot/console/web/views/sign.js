// The log-in page: a name and a password, a token, or a name and the code of a class.
import { signal } from "@preact/signals";
import { Button, html, person, t } from "../base.js";
import { chosen, connect, hello, me, status } from "../link.js";

const WAYS = { password: ["name", "password"], token: ["token"], code: ["name", "code"] };
const way = signal(/** @type {keyof typeof WAYS} */ (new URLSearchParams(location.search).has("code") ? "code" : "password"));
const wrong = signal("");
const busy = signal(false);

async function signIn(event) {
  event.preventDefault();
  const given = Object.fromEntries(new FormData(event.target));
  busy.value = true;
  try {
    const reply = await fetch("/api/sign_in", { method: "POST", body: JSON.stringify(given) });
    const words = await reply.json();
    if (!reply.ok) throw new Error(words.error);
    if (words.robot) chosen.value = words.robot;
    if (given.name) person.value = String(given.name);
    wrong.value = "";
    status.value = "opening";
    const next = new URLSearchParams(location.search).get("to");
    if (next === "studio") location.assign("/studio/"); else connect();
  } catch (error) { wrong.value = error.message; } finally { busy.value = false; }
}

const KINDS = { name: ["text", "username"], password: ["password", "current-password"], token: ["password", "off"], code: ["text", "off"] };

export function SignIn() {
  const code = new URLSearchParams(location.search).get("code") ?? "";
  return html`<form class="card sign" onSubmit=${signIn}><h1>${t("sign.title")}</h1><p class="muted">${t("sign.hint")}</p>
    <div class="buttons" role="group" aria-label=${t("sign.way")}>${Object.keys(WAYS).map((name) => html`
      <${Button} label=${t(`sign.by.${name}`)} on=${way.value === name} onClick=${() => { way.value = /** @type {keyof typeof WAYS} */ (name); wrong.value = ""; }} />`)}</div>
    ${WAYS[way.value].map((name) => html`<label class="field" key=${`${way.value}-${name}`}><span>${t(`sign.${name}`)}</span>
      <input name=${name} type=${KINDS[name][0]} autocomplete=${KINDS[name][1]} defaultValue=${name === "code" ? code : ""} autocapitalize="off" spellcheck=${false} required /></label>`)}
    ${wrong.value && html`<p class="warned" role="alert">${wrong.value}</p>`}
    <div class="buttons"><${Button} type="submit" kind="main" label=${t(busy.value ? "sign.busy" : "sign.in")} disabled=${busy.value} />
      ${hello.value && !me.value.name && html`<${Button} label=${t("cancel")} onClick=${() => { status.value = "open"; }} />`}</div></form>`;
}
