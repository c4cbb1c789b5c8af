// The map of the robot that is shown: draws what link.js knows, turns pointers into places of the map.
import { useEffect, useRef } from "preact/hooks";
import { effect, signal } from "@preact/signals";
import { Button, html, t, theme } from "./base.js";
import { Chart, into, outOf, palette, picture } from "./chart.js";
import { current, grid, hello, path, poses, scan, simulated, state, states, truth, want, wanted } from "./link.js";

export const camera = signal({ x: 0, y: 0, scale: 40 });
export const following = signal(true);
const SCALE_MIN = 2, SCALE_MAX = 400, CLICK = 6; // px a metre; px of a click that wanders
let fitted = "";

/** The building in this robot's map, if it is simulated: [x, y, yaw] of the map in the world. */
const anchor = () => state.value?.anchor ?? null;
export const toWorld = (p) => outOf(anchor() ?? [0, 0, 0], p);

/** @param {number} factor @param {number[] | null} [at] @param {typeof camera} [view] */
export function zoom(factor, at = null, view = camera) {
  const { x, y, scale } = view.value;
  const now = Math.min(SCALE_MAX, Math.max(SCALE_MIN, scale * factor));
  const [px, py] = at ?? [x, y];
  view.value = { x: px - (px - x) * scale / now, y: py - (py - y) * scale / now, scale: now };
}

/** Show everything that is known. @param {{width: number, height: number}} size */
export function fit(size) {
  const corners = [];
  const known = grid.value;
  if (known?.width) corners.push(known.origin, [known.origin[0] + known.width * known.resolution, known.origin[1] + known.height * known.resolution]);
  if (anchor() && wanted.value.truth) for (const wall of plan()?.walls ?? []) corners.push(...wall.map((p) => into(anchor(), p)));
  const here = poses.value[current.value];
  if (here) corners.push([here[0] - 2, here[1] - 2], [here[0] + 2, here[1] + 2]);
  if (!corners.length) return;
  const [xs, ys] = [corners.map((p) => p[0]), corners.map((p) => p[1])];
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const scale = Math.min(size.width / (x1 - x0 + 1), size.height / (y1 - y0 + 1));
  camera.value = { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale: Math.min(SCALE_MAX / 4, Math.max(SCALE_MIN, scale)) };
}

const floorChosen = signal(/** @type {number | null} */ (null)); // null: the robot's own
const ownFloor = () => truth.value?.robots[current.value]?.[3] ?? state.value?.place?.floor ?? 0;
/** The floor that is shown, by number. */
export const floorShown = () => floorChosen.value ?? ownFloor();

function plan() {
  return hello.value?.floors.find((f) => f.number === floorShown());
}

function FloorChoice() {
  const floors = hello.value?.floors ?? [];
  if (!simulated.value || floors.length < 2) return null;
  const choose = (event) => {
    floorChosen.value = event.target.value === "" ? null : Number(event.target.value);
    if (floorChosen.value !== null) want({ truth: true });
  };
  return html`<select class="floors" aria-label=${t("floor.shown")} value=${floorChosen.value ?? ""} onChange=${choose}>
    <option value="">${t("floor.own", { floor: ownFloor() })}</option>${floors.map((f) => html`<option value=${f.number}>${t("floor")} ${f.number}${f.name ? ` · ${f.name}` : ""}</option>`)}</select>`;
}

let bitmap = { grid: null, theme: "", image: null };
let colours = { theme: "", value: {} };

/** @param {HTMLCanvasElement} canvas @param {any} overlay */
function paint(canvas, overlay) {
  if (colours.theme !== theme.value) colours = { theme: theme.value, value: palette() };
  const c = /** @type {any} */ (colours.value);
  const chart = new Chart(canvas, camera.value);
  chart.clear(c.bg);
  const elsewhere = floorShown() !== ownFloor(), known = elsewhere ? null : grid.value; // what the robot knows is of its own floor
  if (known && (bitmap.grid !== known || bitmap.theme !== theme.value)) bitmap = { grid: known, theme: theme.value, image: picture(known, c) };
  if (known && bitmap.image) chart.bitmap(bitmap.image, known);
  chart.mesh(c.grid);
  if (wanted.value.truth && anchor()) paintTruth(chart, c);
  if (!elsewhere) {
    paintDrawings(chart, c);
    paintMotion(chart, c);
  }
  if (overlay) paintOverlay(chart, c, overlay);
}

function paintTruth(chart, c) {
  const map = anchor(), floor = floorShown();
  const inMap = (outline) => outline.map((p) => into(map, p));
  for (const outline of plan()?.furniture ?? []) chart.line(inMap(outline), { fill: c.furniture, closed: true });
  for (const outline of plan()?.walls ?? []) chart.line(inMap(outline), { fill: c.plan, closed: true });
  if (!truth.value) return;
  const on = (entries) => Object.entries(entries).filter(([, p]) => p[3] === floor);
  for (const [, b] of on(truth.value.boxes)) {
    const [w, d] = [b[4] / 2, b[5] / 2];
    chart.line([[-w, -d], [w, -d], [w, d], [-w, d]].map((p) => into(map, outOf(b, p))), { fill: c.box, stroke: c.ink, width: 1, closed: true });
  }
  for (const [, p] of on(truth.value.tags)) {
    chart.line([[0, -0.12], [0, 0.12]].map((q) => into(map, outOf(p, q))), { stroke: c.ink, width: 4 });
    chart.text(into(map, p), p[4], c.ink, 10);
  }
  for (const [, p] of on(truth.value.things)) chart.dot(into(map, p), 4, { fill: c.box });
  for (const [name, p] of on(truth.value.people)) {
    chart.dot(into(map, p), Math.max(6, 0.25 * chart.camera.scale), { fill: c.person });
    chart.text(into(map, p), name, c.ink, Math.max(10, 0.3 * chart.camera.scale));
  }
  for (const [name, p] of on(truth.value.robots)) {
    const own = name === current.value;
    const radius = states.value[name]?.about?.radius ?? 0.25;
    chart.robot(into(map, p), radius, { stroke: own ? c.ghost : c.robot, dash: own ? [4, 4] : [], label: own ? "" : name, ink: c.ink });
  }
}

function paintDrawings(chart, c) {
  const drawn = state.value?.drawings;
  if (!drawn) return;
  for (const area of drawn.areas) chart.line(area.points, { fill: c.area, stroke: c.wall, width: 1, dash: [6, 4], closed: true });
  for (const line of drawn.lines) chart.line(line.points, { stroke: line.kind === "wall" ? c.wall : c.track, width: line.kind === "wall" ? 3 : 2, dash: line.kind === "wall" ? [] : [8, 5] });
  const home = state.value?.place?.home;
  for (const pose of [...drawn.docks.map((d) => d.pose), ...(home ? [home] : [])]) {
    chart.line([[-0.3, -0.25], [-0.3, 0.25], [-0.12, 0.25], [-0.12, -0.25]].map((p) => outOf(pose, p)), { fill: c.goal, closed: true });
  }
  for (const place of drawn.places) {
    chart.dot(place.pose, 6, { fill: c.place, stroke: c.bg });
    chart.text(place.pose, place.name, c.ink, 11);
  }
}

function paintMotion(chart, c) {
  const here = poses.value[current.value];
  const way = [];
  for (let i = 0; i < path.value.length; i += 2) way.push([path.value[i], path.value[i + 1]]);
  chart.line(way, { stroke: c.path, width: 3 });
  const goals = (state.value?.actions ?? []).flatMap((a) => a.feedback?.goals ?? []);
  for (const goal of goals) { chart.dot(goal, 9, { stroke: c.goal, width: 3 }); chart.dot(goal, 3, { fill: c.goal }); }
  if (scan.value) chart.scan(scan.value, c.scan);
  if (!here) return;
  const quality = state.value?.place?.quality ?? 1;
  const doubt = state.value?.place?.lost ? 1.5 : 0.12 + (1 - quality) * 0.5; // m, how wide the halo is
  const radius = state.value?.about?.radius ?? 0.25;
  chart.context.globalAlpha = 0.18;
  chart.dot(here, (radius + doubt) * chart.camera.scale, { fill: state.value?.place?.lost ? c.danger : c.robot });
  chart.context.globalAlpha = 1;
  chart.robot(here, radius, { fill: c.bg, stroke: c.robot });
}

function paintOverlay(chart, c, { spots = [], arrow, measure, rectangle, line }) {
  spots.forEach((p, i) => { chart.dot(p, 9, { fill: c.goal }); chart.text(p, String(i + 1), c.ink, 12); });
  if (spots.length > 1) chart.line(spots, { stroke: c.goal, dash: [6, 6] });
  if (arrow) { chart.dot(arrow[0], 8, { stroke: c.goal, width: 3 }); if (arrow[1]) chart.arrow(arrow[0], arrow[1], c.goal); }
  if (line) chart.line(line, { stroke: c.wall, width: 3 });
  if (rectangle) chart.line([rectangle[0], [rectangle[1][0], rectangle[0][1]], rectangle[1], [rectangle[0][0], rectangle[1][1]]], { fill: c.area, stroke: c.wall, closed: true });
  if (measure) {
    chart.line(measure, { stroke: c.ink, width: 2, dash: [5, 4] });
    chart.text(measure[1], `${Math.hypot(measure[1][0] - measure[0][0], measure[1][1] - measure[0][1]).toFixed(2)} m`, c.ink, 10);
  }
}

/** Pointers on the canvas: one is the tool's, two pinch, the right button and the wheel move and zoom.
 * @param {HTMLCanvasElement} canvas @param {() => any} tool @param {{view: typeof camera, follows: typeof following}} [what] moved by them */
export function pointers(canvas, tool, { view, follows } = { view: camera, follows: following }) {
  const held = new Map();
  let began = null, pinch = null, panning = false;
  const place = (event) => {
    const box = canvas.getBoundingClientRect(), { x, y, scale } = view.value;
    return [x + (event.clientX - box.left - box.width / 2) / scale, y - (event.clientY - box.top - box.height / 2) / scale];
  };
  const spread = () => {
    const [a, b] = [...held.values()];
    return { gap: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY), x: (a.clientX + b.clientX) / 2, y: (a.clientY + b.clientY) / 2 };
  };
  const shift = (dx, dy) => {
    follows.value = false;
    const { x, y, scale } = view.value;
    view.value = { x: x - dx / scale, y: y + dy / scale, scale };
  };
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, event);
    if (held.size === 2) { pinch = spread(); began = null; tool()?.drop?.(); return; }
    panning = event.button !== 0 || !tool()?.drag;
    began = { event, at: place(event) };
    if (!panning) tool().drag(began.at, began.at);
  };
  canvas.onpointermove = (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    held.set(event.pointerId, event);
    if (held.size === 2 && pinch) {
      const now = spread();
      zoom(now.gap / pinch.gap, null, view);
      shift(now.x - pinch.x, now.y - pinch.y);
      pinch = now;
    } else if (panning) shift(event.clientX - before.clientX, event.clientY - before.clientY);
    else if (began) tool()?.drag?.(began.at, place(event));
  };
  const end = (event) => {
    held.delete(event.pointerId);
    if (!began || event.type === "pointercancel") { began = null; tool()?.drop?.(); return; }
    const far = Math.hypot(event.clientX - began.event.clientX, event.clientY - began.event.clientY) > CLICK;
    if (!panning) tool()?.done?.(began.at, far ? place(event) : null);
    began = null;
  };
  canvas.onpointerup = canvas.onpointercancel = end;
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.onwheel = (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY * 0.0015), follows.value ? null : place(event), view); };
}

/** `tool`: {drag(from, to), done(from, to | null), drop()}; `overlay`: what it shows. @param {any} props */
export function MapView({ tool, overlay, children }) {
  const element = useRef(null);
  const newest = useRef({ tool, overlay });
  newest.current = { tool, overlay };
  const redraw = useRef(() => {});
  useEffect(() => {
    const canvas = element.current;
    let due = 0;
    const draw = () => { due = 0; paint(canvas, newest.current.overlay); };
    redraw.current = () => { due ||= requestAnimationFrame(draw); };
    pointers(canvas, () => newest.current.tool);
    const stop = effect(() => {
      [grid.value, scan.value, path.value, poses.value, state.value, truth.value, wanted.value, theme.value, hello.value, floorChosen.value].length;
      const here = poses.value[current.value], view = camera.value;
      if (grid.value && fitted !== current.value) { fitted = current.value; fit(canvas.getBoundingClientRect()); }
      if (following.value && here && (Math.abs(here[0] - view.x) > 0.01 || Math.abs(here[1] - view.y) > 0.01) && fitted === current.value) camera.value = { ...view, x: here[0], y: here[1] };
      redraw.current();
    });
    const watcher = new ResizeObserver(redraw.current);
    watcher.observe(canvas);
    return () => { stop(); watcher.disconnect(); cancelAnimationFrame(due); };
  }, []);
  useEffect(() => redraw.current());
  const meters = [100, 50, 20, 10, 5, 2, 1, 0.5, 0.2].find((m) => m * camera.value.scale <= 130) ?? 0.1;
  return html`<section class="map" aria-label=${t("map")}>
    <canvas ref=${element} tabindex="-1" role="img" aria-label=${t("map.canvas")}></canvas>
    ${children}
    <div class="mapkeys">
      <${Button} compact icon="plus" label=${t("zoom.in")} onClick=${() => zoom(1.4)} />
      <${Button} compact icon="minus" label=${t("zoom.out")} onClick=${() => zoom(1 / 1.4)} />
      <${Button} compact icon="follow" label=${t("follow")} on=${following.value} onClick=${() => { following.value = !following.value; }} />
      <${Button} compact icon="fit" label=${t("fit")} onClick=${() => { following.value = false; fit(element.current.getBoundingClientRect()); }} />
      ${simulated.value && hello.value?.whole && html`<${Button} compact icon="eye" label=${t("truth")} on=${wanted.value.truth} onClick=${() => want({ truth: !wanted.value.truth })} />`}
    </div>
    <${FloorChoice} />
    <div class="scale" aria-hidden="true"><i style=${{ width: `${meters * camera.value.scale}px` }}></i>${meters} m</div>
  </section>`;
}
