// The log-in page: a name and a password, a token, or a name and the code of a class.
import { useEffect } from "preact/hooks";
import { signal } from "@preact/signals";
import { Button, elsewhere, fetched, html, person, sent as asked, t, translated } from "../base.js";
import { chosen, connect, hello, me, status } from "../link.js";

const WAYS = { password: ["name", "password"], token: ["token"], code: ["name", "code"] };
const shown = { code: asked.get("code") ?? asked.get("class") ?? "", name: asked.get("name") ?? "" };
const way = signal(/** @type {keyof typeof WAYS} */ (shown.code ? "code" : "password"));
const wrong = signal("");
const busy = signal(false);

/** @param {Record<string, string>} given */
async function signIn(given) {
  busy.value = true;
  try {
    const words = await fetched("/api/sign_in", given);
    if (words.elsewhere) { location.assign(elsewhere(words)); return; }
    if (words.robot) chosen.value = words.robot;
    if (given.name) person.value = given.name;
    wrong.value = "";
    status.value = "opening";
    if (words.studio) location.assign(elsewhere({ page: location.origin, code: words.studio, name: given.name }));
    else if (asked.get("to") === "studio") location.assign("/studio/");
    else connect();
  } catch (error) { wrong.value = error.message; } finally { busy.value = false; }
}

const KINDS = { name: ["text", "username"], password: ["password", "current-password"], token: ["password", "off"], code: ["text", "off"] };

export function SignIn() {
  useEffect(() => { if (asked.get("class") && shown.name) signIn(shown); }, []); // sent by the log-in page of another world
  const submit = (event) => { event.preventDefault(); signIn(/** @type {any} */ (Object.fromEntries(new FormData(event.target)))); };
  return html`<form class="card sign" onSubmit=${submit}><h1>${t("sign.title")}</h1>${(me.value.ended || asked.has("ended")) && html`<p class="warned" role="status">${t("sign.ended")}</p>`}<p class="muted">${t("sign.hint")}</p>
    <div class="buttons" role="group" aria-label=${t("sign.way")}>${Object.keys(WAYS).map((name) => html`
      <${Button} label=${t(`sign.by.${name}`)} on=${way.value === name} onClick=${() => { way.value = /** @type {keyof typeof WAYS} */ (name); wrong.value = ""; }} />`)}</div>
    ${WAYS[way.value].map((name) => html`<label class="field" key=${`${way.value}-${name}`}><span>${t(`sign.${name}`)}</span>
      <input name=${name} type=${KINDS[name][0]} autocomplete=${KINDS[name][1]} defaultValue=${way.value === "code" ? shown[name] : ""} autocapitalize="off" spellcheck=${false} required /></label>`)}
    ${wrong.value && html`<p class="warned" role="alert">${translated(wrong.value)}</p>`}
    <div class="buttons"><${Button} type="submit" kind="main" label=${t(busy.value ? "sign.busy" : "sign.in")} disabled=${busy.value} />
      ${hello.value && !me.value.name && html`<${Button} label=${t("cancel")} onClick=${() => { status.value = "open"; }} />`}</div></form>`;
}
