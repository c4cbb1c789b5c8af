// Plots of the last ten minutes of robot time: noted while the page is open, drawn by uPlot once they are looked at.
import { useEffect, useRef } from "preact/hooks";
import { effect, signal } from "@preact/signals";
import { fixed, html, language, t, theme } from "../base.js";
import { palette } from "../chart.js";
import { age, clock, current, poses, stale, state } from "../link.js";

const PERIOD = 500; // ms
const NOTED_MAX = 1200; // a robot
const HEIGHT = 130; // px
const SHORTEST = 10; // s of the axis, at least
const STEPS = [1, 2, 5, 10, 20, 30, 60, 120]; // s between labels

/** What is noted of a robot; each chart shows one or two of them. @type {Record<string, () => number | null>} */
const SOURCES = {
  speed: () => { const p = poses.value[current.value]; return p && p[3] !== null ? Math.hypot(p[3], p[4]) : null; },
  turning: () => { const p = poses.value[current.value]; return p && p[5] !== null ? p[5] * 180 / Math.PI : null; },
  battery: () => { const b = state.value?.battery; return b && !stale.value ? b.charge * 100 : null; },
  fit: () => { const q = state.value?.place?.quality; return stale.value || q === null || q === undefined ? null : q * 100; },
  amperes: () => stale.value ? null : state.value?.battery?.amperes ?? null,
  link: () => age.value,
};
const CHARTS = [["speed", "m/s", null], ["turning", "°/s", null], ["battery", "%", [0, 100]], ["fit", "%", [0, 100]], ["amperes", "A", null], ["link", "ms", null]];

const noted = /** @type {Map<string, Record<string, (number | null)[]>>} */ (new Map());
const drawn = signal(0);

function note() {
  const robot = current.value, now = clock.value;
  if (!robot || !poses.value[robot]) return;
  let rows = noted.get(robot);
  if (!rows || now < Number(rows.time.at(-1))) { // another robot, or a restarted server
    rows = Object.fromEntries(["time", ...Object.keys(SOURCES)].map((name) => [name, []]));
    noted.set(robot, rows);
  }
  if (rows.time.at(-1) === now) return; // time stands still
  rows.time.push(now);
  for (const [name, source] of Object.entries(SOURCES)) rows[name].push(source());
  if (rows.time.length > NOTED_MAX) for (const row of Object.values(rows)) row.shift();
  drawn.value += 1;
}
setInterval(note, PERIOD);

/** uPlot and its style sheet, loaded once. @type {Promise<any> | null} */
let library = null;
function plotting() {
  library ??= new Promise((resolve, reject) => {
    const sheet = Object.assign(document.createElement("link"), { rel: "stylesheet", href: "/vendor/uplot.css" });
    sheet.onload = () => import("uplot").then((loaded) => resolve(loaded.default), reject);
    sheet.onerror = reject;
    document.head.append(sheet);
  });
  return library;
}

/** Labels at the newest value, and in whole steps before it. */
function backwards(_plot, _axis, from, to, step) {
  const found = [];
  for (let at = to; at >= from; at -= step) found.unshift(at);
  return found;
}

/** @param {any} uPlot @param {HTMLElement} place @param {string} name @param {number[] | null} range */
function made(uPlot, place, name, range) {
  const c = /** @type {any} */ (palette()), axis = { stroke: c.ink, grid: { stroke: c.grid, width: 1 }, ticks: { stroke: c.grid, width: 1 } };
  const ago = (plot, values) => values.map((v) => `${Math.round(v - (plot.data[0].at(-1) ?? 0))} s`);
  return new uPlot({
    width: place.clientWidth, height: HEIGHT, legend: { show: false }, cursor: { show: false }, padding: [8, 8, 0, 0],
    scales: { x: { time: false, range: (plot, from, to) => { const [times] = plot.data, last = times.at(-1) ?? to; return [Math.min(times[0] ?? from, last - SHORTEST), last]; } }, y: { range: range ?? ((_, low, high) => [Math.min(low, 0), Math.max(high, 1)]) } },
    axes: [{ ...axis, values: ago, incrs: STEPS, splits: backwards, space: 60, size: 26 }, { ...axis, size: 46 }],
    series: [{}, { stroke: c.path, width: 2, points: { show: false } }],
  }, columns(name), place);
}

const columns = (name) => { const rows = noted.get(current.value); return rows ? [rows.time, rows[name]] : [[], []]; };

function Plot({ name, unit, range }) {
  const place = useRef(/** @type {any} */ (null));
  useEffect(() => {
    let plot = null, stop = () => {}, gone = false;
    const watcher = new ResizeObserver(() => { if (place.current) plot?.setSize({ width: place.current.clientWidth, height: HEIGHT }); });
    plotting().then((uPlot) => {
      if (gone || !place.current) return; // closed while it was loading
      plot = made(uPlot, place.current, name, range);
      watcher.observe(place.current);
      stop = effect(() => { void drawn.value; void current.value; plot.setData(columns(name)); });
    }, () => {});
    return () => { gone = true; stop(); watcher.disconnect(); plot?.destroy(); };
  }, [theme.value, language.value]);
  void drawn.value;
  const newest = columns(name)[1].at(-1), said = newest === null || newest === undefined ? "–" : `${fixed(newest, { speed: 2, amperes: 1 }[name] ?? 0)} ${unit}`;
  return html`<div class="card plot" data-plot=${name}><h3>${t(`plot.${name}`)}<b>${said}</b></h3><div ref=${place} role="img" aria-label=${`${t(`plot.${name}`)}: ${said}`}></div></div>`;
}

export function Plots() {
  void drawn.value;
  const rows = noted.get(current.value), there = CHARTS.filter(([name]) => rows?.[/** @type {string} */ (name)].some((v) => v !== null));
  return html`${there.map(([name, unit, range]) => html`<${Plot} key=${name} name=${name} unit=${unit} range=${range} />`)}
    <p class="muted">${t(there.length ? "plots.hint" : "plots.none")}</p>`;
}
