// Driving by hand: a pad that must be held, keys, a gamepad; and panels for what else this body has.
import { useEffect, useRef } from "preact/hooks";
import { effect, signal } from "@preact/signals";
import { Button, fixed, html, lacks, robotWord, t, translated } from "../base.js";
import { command, current, drive, padRefused, state } from "../link.js";
import { later } from "./later.js";

const Camera = later(() => import("./camera.js").then((m) => m.Camera));
const PERIOD = 80; // ms between two velocities
const hand = signal({ x: 0, y: 0, yaw: 0, held: false });
const share = signal(0.35);
const keys = new Set();
const KEYS = { w: [1, 0, 0], s: [-1, 0, 0], a: [0, 0, 1], d: [0, 0, -1], q: [0, 1, 0], e: [0, -1, 0], arrowup: [1, 0, 0], arrowdown: [-1, 0, 0], arrowleft: [0, 0, 1], arrowright: [0, 0, -1] };
let timer = 0, changes = 0;

/** Drive so from now on; nothing at all lets go. @param {number} x @param {number} y @param {number} yaw */
function push(x, y, yaw) {
  const held = Boolean(x || y || yaw);
  if (held ? lacks("drive") : !hand.value.held) return;
  hand.value = { x, y, yaw, held };
  const send = () => drive(hand.value.x * share.value, hand.value.y * share.value, hand.value.yaw * share.value * 0.6);
  send();
  clearInterval(timer);
  if (held) timer = window.setInterval(send, PERIOD);
}
const letGo = () => { keys.clear(); push(0, 0, 0); };

function fromKeys() {
  const sum = /** @type {[number, number, number]} */ ([0, 0, 0]);
  for (const key of keys) KEYS[key].forEach((v, i) => { sum[i] += v; });
  const [x, y, yaw] = sum.map((v) => Math.max(-1, Math.min(1, v)));
  push(x, y, yaw);
}

function useKeys() {
  useEffect(() => {
    const taking = (event) => (event.key.startsWith("Arrow") ? "input, select, textarea, [role=tab]" : "input:not([type=range]), select, textarea");
    const typing = (event) => event.target.closest(taking(event)) || event.ctrlKey || event.metaKey || event.altKey;
    const down = (event) => {
      const key = event.key.toLowerCase();
      if (key === "meta") letGo(); // a Mac hides other releases
      if (!(key in KEYS) || typing(event)) return;
      event.preventDefault();
      if (!event.repeat) { keys.add(key); fromKeys(); }
    };
    const up = (event) => { if (keys.delete(event.key.toLowerCase())) fromKeys(); };
    const hidden = () => { if (document.hidden) letGo(); };
    addEventListener("keydown", down);
    addEventListener("keyup", up);
    addEventListener("blur", letGo);
    addEventListener("pagehide", letGo);
    document.addEventListener("visibilitychange", hidden);
    return () => {
      removeEventListener("keydown", down);
      removeEventListener("keyup", up);
      removeEventListener("blur", letGo);
      removeEventListener("pagehide", letGo);
      document.removeEventListener("visibilitychange", hidden);
      letGo();
    };
  }, []);
}

function useGamepad() {
  useEffect(() => {
    let driving = false, waits = Boolean(changes++); // another robot is driven once the stick was let go
    const leave = effect(() => { void current.value; return () => { driving = false; waits = true; }; });
    const look = setInterval(() => {
      const pad = navigator.getGamepads?.().find(Boolean);
      if (!pad) return;
      const axis = (i) => (Math.abs(pad.axes[i] ?? 0) > 0.15 ? -pad.axes[i] : 0);
      const [x, y, yaw] = [axis(1), axis(0), axis(2)];
      if (!(x || y || yaw)) waits = false;
      if (waits) return;
      if (x || y || yaw) { driving = true; push(x, y, yaw); } else if (driving) { driving = false; push(0, 0, 0); }
    }, PERIOD);
    return () => { leave(); clearInterval(look); };
  }, []);
}

function Pad() {
  const element = useRef(null);
  const follow = (event) => {
    if (!event.currentTarget.hasPointerCapture(event.pointerId)) return;
    const box = element.current.getBoundingClientRect();
    const [u, v] = [(event.clientX - box.left) / box.width * 2 - 1, (event.clientY - box.top) / box.height * 2 - 1];
    const far = Math.max(1, Math.hypot(u, v));
    push(-v / far, 0, -u / far);
  };
  const { x, yaw, held } = hand.value;
  return html`<div class=${`pad ${held ? "held" : ""}`} ref=${element} role="group" aria-label=${t("pad")} tabindex="0" aria-disabled=${lacks("drive") ? "true" : undefined}
      onPointerDown=${(e) => { e.currentTarget.setPointerCapture(e.pointerId); follow(e); }} onPointerMove=${follow}
      onPointerUp=${letGo} onPointerCancel=${letGo} onLostPointerCapture=${letGo} onContextMenu=${(e) => e.preventDefault()}>
    <i class="knob" style=${{ transform: `translate(${-yaw * 62}px, ${-x * 62}px)` }}></i>
    <span class="n">▲</span><span class="s">▼</span><span class="w">↺</span><span class="e">↻</span></div>`;
}

function Slider({ name, min, max, step, value, onChange, verb, said }) {
  return html`<label class="field"><span>${name} <output>${said}</output></span>
    <input type="range" min=${min} max=${max} step=${step} value=${value} aria-valuetext=${said} disabled=${Boolean(lacks(verb))} title=${lacks(verb)} onChange=${(e) => onChange(Number(e.target.value))} /></label>`;
}

const percent = (part) => `${Math.round(part * 100)} %`;
const degrees = (rad) => Math.round(rad * 180 / Math.PI);
const radians = (deg) => deg * Math.PI / 180;

const COLOURS = { red: "#ff3b30", green: "#34c759", blue: "#0a84ff", yellow: "#ffd60a", white: "#ffffff" };

const PANELS = {
  legs: (body) => html`<div class="card"><h3>${t("legs")}</h3><p>${robotWord(body.posture)}</p><div class="buttons">
    <${Button} label=${t("stand")} verb="stand" onClick=${() => command("stand")} /><${Button} label=${t("lie")} verb="lie_down" onClick=${() => command("lie_down")} /></div></div>`,
  gimbal: (body) => html`<div class="card"><h3>${t("gimbal")}</h3>
    <${Slider} name=${t("pitch")} said=${`${degrees(body.gimbal.pitch)}°`} min=${degrees(body.gimbal_reach[0])} max=${degrees(body.gimbal_reach[1])} step="1" value=${degrees(body.gimbal.pitch)} verb="aim" onChange=${(v) => command("aim", { pitch: radians(v) })} />
    <${Slider} name=${t("yaw")} said=${`${degrees(body.gimbal.yaw)}°`} min=${degrees(body.gimbal_reach[2])} max=${degrees(body.gimbal_reach[3])} step="1" value=${degrees(body.gimbal.yaw)} verb="aim" onChange=${(v) => command("aim", { yaw: radians(v) })} />
    <div class="buttons"><${Button} label=${t("recenter")} verb="recenter_gimbal" onClick=${() => command("recenter_gimbal")} /></div></div>`,
  arm: (body) => html`<div class="card"><h3>${t("arm")}</h3><p>x ${fixed(body.arm.x)} · z ${fixed(body.arm.z)} m</p><div class="buttons">
    ${/** @type {[string, number, number][]} */ ([["arm.out", 0.02, 0], ["arm.in", -0.02, 0], ["arm.up", 0, 0.02], ["arm.down", 0, -0.02]]).map(([key, x, z]) => html`<${Button} label=${t(key)} verb="move_arm" onClick=${() => command("move_arm", { x, z })} />`)}
    <${Button} label=${t("recenter")} verb="recenter_arm" onClick=${() => command("recenter_arm")} /></div></div>`,
  gripper: (body) => html`<div class="card"><h3>${t("gripper")}</h3><p>${robotWord(body.gripper)}</p><div class="buttons">
    <${Button} label=${t("grip.open")} verb="grip" onClick=${() => command("grip", { close: false })} /><${Button} label=${t("grip.close")} verb="grip" onClick=${() => command("grip", { close: true })} /></div></div>`,
  blaster: (body) => html`<div class="card"><h3>${t("blaster")}</h3><p>${t("beads", { n: body.ammo })}</p><div class="buttons"><${Button} kind="danger" label=${t("fire")} verb="fire" onClick=${() => command("fire")} /></div></div>`,
  light: () => html`<div class="card"><h3>${t("light")}</h3><div class="buttons">
    ${Object.entries(COLOURS).map(([name, c]) => html`<button type="button" class="swatch" aria-label=${t(`colour.${name}`)} title=${t(`colour.${name}`)} style=${{ background: c }} aria-disabled=${lacks("shine") ? "true" : undefined} onClick=${() => shine(c)}></button>`)}
    <${Button} label=${t("light.off")} verb="shine" onClick=${() => shine("#000000")} /></div></div>`,
  speaker: (body) => html`<div class="card"><h3>${t("speaker")}</h3>
    <form class="inline" onSubmit=${(e) => { e.preventDefault(); const text = new FormData(e.target).get("text"); if (text) command("say", { text }); }}>
      <label class="grow"><span class="unseen">${t("say.text")}</span><input name="text" maxlength="200" placeholder=${t("say.text")} /></label><${Button} type="submit" label=${t("say")} verb="say" /></form>
    <${Slider} name=${t("volume")} said=${percent(body.volume)} min="0" max="1" step="0.05" value=${body.volume} verb="volume" onChange=${(to) => command("volume", { to })} /></div>`,
};

function shine(colour) {
  const value = parseInt(colour.slice(1), 16);
  command("shine", { red: value >> 16, green: (value >> 8) & 255, blue: value & 255 });
}

export function Drive() {
  useKeys();
  useGamepad();
  useEffect(() => effect(() => { void current.value; return letGo; }), []); // at once: what is held was meant for the other robot
  const { parts, body, about } = state.value;
  return html`${parts.includes("driving") && html`<div class="card"><h3>${t("pad.title")}</h3><${Pad} />
      ${(lacks("drive") || padRefused.value) && html`<p class="warned">${lacks("drive") || translated(padRefused.value)}</p>`}
      <${Slider} name=${t("pad.speed", { speed: fixed(about.speed * share.value) })} said=${percent(share.value)} min="0.05" max="1" step="0.05" value=${share.value} onChange=${(v) => { share.value = v; }} />
      <p class="muted">${t("pad.hint")}</p></div>`}
    ${parts.includes("camera") && html`<${Camera} />`}
    ${Object.entries(PANELS).filter(([name]) => parts.includes(name)).map(([, panel]) => panel(body))}`;
}
