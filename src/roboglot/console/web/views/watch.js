// Watches a recording: the robot on its map as it was, what it did and said beside it, and a line of time below.
import { useEffect, useRef } from "preact/hooks";
import { effect, signal } from "@preact/signals";
import { Button, Icon, duration, fetched, fixed, html, robotWord, t, theme } from "../base.js";
import { Chart, palette, picture } from "../chart.js";
import { Excerpts, lastAt, moveAt, trail } from "../excerpts.js";
import { pointers, zoom } from "../map.js";

const SPEEDS = [1, 2, 4, 8, 16];
const TRAIL = 30; // s
const SCAN_OLD = 1; // s after which a scan is no longer what the robot sees
const ROWS = 60, BEATS = 4; // rows that are shown, and how often they are looked at, a second
const RADIUS = 0.25; // m

/** A time in the recording, as clocks show it. @param {number} seconds */
function time(seconds) {
  const whole = Math.floor(seconds), two = (/** @type {number} */ n) => String(n).padStart(2, "0");
  return `${whole >= 3600 ? `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}` : Math.floor(whole / 60)}:${two(whole % 60)}`;
}

/** One recording that is watched. */
class Player {
  /** @param {string} file */
  constructor(file) {
    this.file = file;
    this.outline = signal(/** @type {{seconds: number, robots: string[], filmed: string[], marks: {at: number, text: string}[]} | null} */ (null));
    this.failure = signal("");
    this.robot = signal("");
    this.at = signal(0);
    this.beat = signal(0); // changes with `at`, less often
    this.speed = signal(1);
    this.playing = signal(false);
    this.waits = signal(false); // for an excerpt
    this.view = signal({ x: 0, y: 0, scale: 40 });
    this.follows = signal(true);
    this.excerpts = /** @type {Excerpts | null} */ (null);
    this.open();
  }

  async open() {
    try {
      const outline = await fetched(`/api/recordings/${encodeURIComponent(this.file)}/watch`);
      this.outline.value = outline;
      this.choose(outline.robots[0] ?? "");
      this.playing.value = true;
    } catch (error) { this.failure.value = error.message; }
  }

  /** @param {string} robot */
  choose(robot) {
    this.excerpts = new Excerpts(this.file, robot, this.outline.value?.seconds ?? 0);
    this.robot.value = robot;
    this.seek(this.at.value);
  }

  /** @param {number} at s */
  seek(at) {
    this.at.value = Math.min(Math.max(at, 0), this.outline.value?.seconds ?? 0);
    this.beat.value += 1;
  }

  /** What is there of the moment that is shown. */
  get scene() {
    const { now, before } = this.excerpts?.around(this.at.value, this.speed.value) ?? { now: null, before: null };
    return { now, all: [before, now].filter((one) => one !== null) };
  }

  /** Let time pass; it waits for what is not there yet.
   * @param {number} seconds of the machine's time; below 0 at first, as a frame may have begun before it was asked for */
  pass(seconds) {
    const { seconds: end } = this.outline.value ?? { seconds: 0 };
    this.waits.value = !this.excerpts?.failure.value && !this.scene.now;
    if (!this.playing.value || !this.scene.now) return;
    const at = this.at.value, next = Math.min(at + Math.min(Math.max(seconds, 0), 0.25) * this.speed.value, end);
    this.at.value = next;
    if (Math.floor(next / this.speed.value * BEATS) !== Math.floor(at / this.speed.value * BEATS)) this.beat.value += 1;
    if (next === end) this.playing.value = false;
  }

  toggle() {
    if (!this.playing.value && this.at.value >= (this.outline.value?.seconds ?? 0)) this.seek(0);
    this.playing.value = !this.playing.value;
  }
}

const watched = signal(/** @type {Player | null} */ (null));
/** The file that is watched; empty: none. */
export const watchedFile = () => watched.value?.file ?? "";

let bitmap = { map: null, theme: "", image: null };

/** @param {HTMLCanvasElement} canvas @param {Player} player */
function paint(canvas, player) {
  const c = /** @type {any} */ (palette()), chart = new Chart(canvas, player.view.value), at = player.at.value;
  const { all } = player.scene, map = lastAt(all.flatMap((one) => one.maps), at);
  chart.clear(c.bg);
  if (map) {
    if (bitmap.map !== map || bitmap.theme !== theme.value) bitmap = { map, theme: theme.value, image: picture(map, c) };
    if (bitmap.image) chart.bitmap(bitmap.image, map);
  }
  chart.mesh(c.grid);
  chart.line(trail(all, at - TRAIL, at), { stroke: c.path, width: 3 });
  const scan = lastAt(all.flatMap((one) => one.scans), at);
  if (scan && at - scan.at < SCAN_OLD * player.speed.value) chart.scan(scan, c.scan);
  const here = place(player);
  if (here) chart.robot(here, RADIUS, { fill: c.bg, stroke: c.robot });
}

/** @param {Player} player @returns {number[] | null} x, y, yaw of the robot in its map */
function place(player) {
  for (const { moves } of player.scene.all.slice().reverse()) {
    const found = moveAt(moves, player.at.value);
    if (found >= 0) return [...moves.slice(found + 1, found + 4)];
  }
  return null;
}

/** @param {{player: Player}} props */
function Picture({ player }) {
  const element = useRef(null);
  useEffect(() => {
    const canvas = /** @type {HTMLCanvasElement} */ (/** @type {unknown} */ (element.current));
    let due = 0, drawn = 0, last = performance.now();
    const draw = () => { drawn = 0; paint(canvas, player); };
    const redraw = () => { drawn ||= requestAnimationFrame(draw); };
    const run = (/** @type {number} */ now) => { player.pass((now - last) / 1000); last = now; due = requestAnimationFrame(run); };
    due = requestAnimationFrame(run);
    pointers(canvas, () => null, player);
    const stop = effect(() => {
      [player.at.value, player.robot.value, player.speed.value, theme.value, player.excerpts?.arrived.value].length;
      const here = place(player), view = player.view.value;
      if (player.follows.value && here && (Math.abs(here[0] - view.x) > 0.01 || Math.abs(here[1] - view.y) > 0.01)) player.view.value = { ...view, x: here[0], y: here[1] };
      redraw();
    });
    const watcher = new ResizeObserver(redraw);
    watcher.observe(canvas);
    return () => { stop(); watcher.disconnect(); cancelAnimationFrame(due); cancelAnimationFrame(drawn); };
  }, [player]);
  return html`<section class="map" aria-label=${t("map")}><canvas ref=${element} tabindex="-1" role="img" aria-label=${t("watch.canvas")}></canvas>
    <div class="mapkeys"><${Button} compact icon="plus" label=${t("zoom.in")} onClick=${() => zoom(1.4, null, player.view)} />
      <${Button} compact icon="minus" label=${t("zoom.out")} onClick=${() => zoom(1 / 1.4, null, player.view)} />
      <${Button} compact icon="follow" label=${t("follow")} on=${player.follows.value} onClick=${() => { player.follows.value = !player.follows.value; }} /></div>
    <${Time} player=${player} /></section>`;
}

/** @param {{player: Player}} props */
function Time({ player }) {
  const seconds = player.outline.value?.seconds ?? 0, at = player.at.value;
  return html`<div class="player"><${Button} compact kind="main" icon=${player.playing.value ? "pause" : "play"} label=${t(player.playing.value ? "pause" : "watch.play")} onClick=${() => player.toggle()} />
    <input type="range" min="0" max=${seconds} step="0.1" value=${at} aria-label=${t("watch.time")} aria-valuetext=${duration(at)} onInput=${(/** @type {any} */ e) => player.seek(Number(e.target.value))} />
    <span class="time">${time(at)} / ${time(seconds)}</span>
    <select aria-label=${t("clock.speed")} value=${player.speed.value} onChange=${(/** @type {any} */ e) => { player.speed.value = Number(e.target.value); player.seek(player.at.value); }}>
      ${SPEEDS.map((each) => html`<option value=${each}>× ${each}</option>`)}</select></div>`;
}

/** What a row of the list says: its head, a badge, the small print, and what went wrong. @param {any} row */
function sentence(row) {
  switch (row.kind) {
    case "action": return { head: robotWord(row.name), badge: robotWord(row.status.toUpperCase()), kind: row.status, small: row.client || t("itself"), bad: row.reason && robotWord(row.reason) };
    case "message": return { head: row.operation, badge: row.status, kind: "", small: `${row.door} ${row.direction === "request" ? "→" : "←"} ${row.text}`, bad: row.refusal };
    case "event": return { head: row.name, badge: "", kind: "", small: row.text, bad: "" };
    case "left_out": return { head: t("watch.left.out", { n: row.count }), badge: "", kind: "", small: "", bad: "" };
    default: return { head: `● ${row.text}`, badge: "", kind: "", small: "", bad: "" };
  }
}

/** @param {any} row */
function Row({ row }) {
  const { head, badge, kind, small, bad } = sentence(row);
  return html`<li><b>${head}</b>${badge ? html`<span class=${`badge ${kind}`}>${badge}</span>` : html`<span></span>`}<small>${time(row.at)}${small && ` · ${small}`}</small>${bad && html`<em>${bad}</em>`}</li>`;
}

/** Rows until a moment, each once, the newest last: an excerpt begins with what was so before it. @param {any[]} rows @param {number} at */
function distinct(rows, at) {
  const seen = new Set(), doing = new Map();
  return rows.filter((row) => {
    const key = JSON.stringify(row);
    if (row.at > at || seen.has(key)) return false;
    seen.add(key);
    if (row.kind !== "action") return true;
    const same = doing.get(row.id) === row.status;
    doing.set(row.id, row.status);
    return !same;
  });
}

const filming = signal(false); // whether the camera's pictures are shown

/** What the camera saw: a new picture each second of the page's time. @param {{player: Player}} props */
function Film({ player }) {
  player.beat.value; // looked at again when it changes
  const step = player.speed.value, at = Math.floor(player.at.peek() / step) * step;
  const path = `${player.excerpts?.path}/${at * 1000}/camera.jpg`;
  return html`<details class="card" open=${filming.value} onToggle=${(/** @type {any} */ e) => { filming.value = e.target.open; }}><summary>${t("camera")}</summary>
    ${filming.value && html`<div class="screen"><img alt=${t("watch.camera")} src=${path} onLoad=${(/** @type {any} */ e) => { e.target.hidden = false; }} onError=${(/** @type {any} */ e) => { e.target.hidden = true; }} /></div>`}</details>`;
}

const messages = signal(true); // whether they are listed, too

/** @param {{player: Player}} props */
function Happened({ player }) {
  player.beat.value; player.excerpts?.arrived.value; // looked at again when these change
  const at = player.at.peek(), rows = distinct(player.scene.all.flatMap((one) => one.rows), at);
  const last = (/** @type {string} */ kind) => rows.findLast((row) => row.kind === kind);
  const battery = last("battery"), faults = last("faults")?.faults ?? [], here = place(player);
  const actions = [...new Map(rows.filter((row) => row.kind === "action").map((row) => [row.id, row])).values()]; // each as it is by then
  const running = actions.findLast((action) => ["accepted", "executing", "canceling"].includes(action.status));
  const listed = rows.filter((row) => !["battery", "faults"].includes(row.kind) && (messages.value || row.kind !== "message")).slice(-ROWS).reverse();
  return html`<div class="card"><h2>${t("condition")}</h2>
      ${faults.length > 0 && html`<ul class="faults">${faults.map((/** @type {any} */ f) => html`<li class=${f.level.toLowerCase()}><${Icon} name="alert" size=${18} /><span><b>${robotWord(f.name)}</b></span></li>`)}</ul>`}
      <dl><div class="row"><dt>${t("actions.now")}</dt><dd>${running ? robotWord(running.name) : t("actions.none")}</dd></div>
      ${battery && html`<div class="row"><dt>${t("battery")}</dt><dd>${Math.round(battery.charge * 100)} %${battery.charging ? ` · ${t("charging")}` : ""}</dd></div>`}
      ${here && html`<div class="row"><dt>${t("pose")}</dt><dd>x ${fixed(here[0])} · y ${fixed(here[1])} m · ${Math.round(here[2] * 180 / Math.PI)}°</dd></div>`}</dl></div>
    <div class="card"><h2>${t("watch.happened")}</h2><div class="buttons"><${Button} label=${t("watch.messages")} on=${messages.value} onClick=${() => { messages.value = !messages.value; }} /></div>
      ${listed.length ? html`<ol class="actions">${listed.map((row) => html`<${Row} key=${JSON.stringify(row)} row=${row} />`)}</ol>` : html`<p class="muted">${t("watch.nothing")}</p>`}</div>`;
}

/** @param {string} file empty: leave */
export function watch(file) { watched.value = file ? new Player(file) : null; }

export function Watch() {
  const player = watched.value;
  useEffect(() => () => watch(""), []);
  if (!player) return null;
  const outline = player.outline.value, why = player.failure.value || player.excerpts?.failure.value;
  return html`<div class="split watch">${outline ? html`<${Picture} player=${player} />` : html`<section class="map"></section>`}
    <aside><div class="panel" tabindex="0"><div class="card"><h1>${player.file}</h1>
        <p class=${why ? "warned" : "muted"} role="status">${why ? t("refused", { why }) : !outline || player.waits.value ? t("watch.reading") : t("watch.hint")}</p>
        ${outline && outline.robots.length > 1 && html`<label class="field"><span>${t("robot")}</span><select value=${player.robot.value} onChange=${(/** @type {any} */ e) => player.choose(e.target.value)}>${outline.robots.map((name) => html`<option>${name}</option>`)}</select></label>`}
        <div class="buttons"><${Button} label=${t("watch.all")} onClick=${() => watch("")} /></div></div>
      ${outline && outline.marks.length > 0 && html`<div class="card"><h2>${t("watch.marks")}</h2><ul class="list">${outline.marks.map((mark) => html`<li><${Button} label=${time(mark.at)} of=${mark.text} onClick=${() => player.seek(mark.at)} /><span>${mark.text}</span></li>`)}</ul></div>`}
      ${outline?.filmed.includes(player.robot.value) && html`<${Film} player=${player} />`}
      ${outline && html`<${Happened} player=${player} />`}</div></aside></div>`;
}
