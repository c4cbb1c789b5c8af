// What makes Blockly load many blocks quickly: texts are measured without asking for styles, and what blocks are called
// for screen readers is made once, after they are there, instead of several times while they are put together. The
// machine's sound, which each workspace, toolbox and trash can would open for itself, is opened with the first beep.
import * as Blockly from "blockly";

const { Field, utils: { dom } } = Blockly;
const SLICE = 8; // ms of work between two looks at what the person does
/** What has no words yet. @type {Set<any>} */
const waiting = new Set();
let deferring = 0, making = /** @type {any} */ (null), due = false;

const Sound = window.AudioContext;
if (Sound) {
  const late = class {
    real = /** @type {AudioContext | null} */ (null);
    get made() { return (this.real ??= new Sound()); }
    get state() { return this.real?.state ?? "suspended"; }
    get currentTime() { return this.made.currentTime; }
    get destination() { return this.made.destination; }
    createGain() { return this.made.createGain(); }
    createOscillator() { return this.made.createOscillator(); }
    resume() { return this.made.resume(); }
    async close() { await this.real?.close(); }
  };
  window.AudioContext = /** @type {any} */ (late);
}

/** Make a workspace. Blockly's rule for every element below it has the browser look, for each of 1,000 blocks, through all
 * those that it hangs from, and says what the page's own style says. @param {Element} place @param {object} options */
export function inject(place, options) {
  const made = Blockly.inject(place, options);
  for (const sheet of document.adoptedStyleSheets) {
    const at = [...sheet.cssRules].findIndex((/** @type {any} */ rule) => rule.selectorText?.endsWith(") *"));
    if (at >= 0) sheet.deleteRule(at);
  }
  return made;
}

let canvas = /** @type {Element | null} */ (null);
const size = Field.prototype.updateSize_;
// The quick measure fills the memory that the slow one, which has the browser work out all styles, looks into first.
Field.prototype.updateSize_ = function (/** @type {number | undefined} */ margin) {
  const c = this.getConstants();
  if (deferring && c && this.textElement_) dom.getFastTextWidth(this.textElement_, c.FIELD_TEXT_FONTSIZE, c.FIELD_TEXT_FONTWEIGHT, c.FIELD_TEXT_FONTFAMILY);
  size.call(this, margin);
  canvas ??= document.querySelector(".blocklyComputeCanvas");
  if (canvas?.isConnected) canvas.remove(); // it measures outside of the page, too, and there asks for no styles
};

for (const { prototype: made } of /** @type {any[]} */ ([Field, Blockly.BlockSvg])) {
  const now = made.recomputeAriaContext;
  made.recomputeAriaContext = function (/** @type {any[]} */ ...given) {
    if (!deferring || making === this) return now.apply(this, given);
    waiting.add(this);
    return false; // "it has no words yet", as before it is drawn
  };
}

const { queueRender } = Blockly.BlockSvg.prototype;
/** Which are to be drawn, while many are made. @type {Set<any> | null} */
let drawn = null;
Blockly.BlockSvg.prototype.queueRender = function () { if (!drawn) return queueRender.call(this); drawn.add(this); return Promise.resolve(); };

const { moveSvgRootToFront } = Blockly.BlockSvg.prototype;
// A frame later it moves the neighbours: one of them that has the focus by then would lose it.
Blockly.BlockSvg.prototype.moveSvgRootToFront = function (/** @type {boolean} */ only) {
  let held = /** @type {any} */ (null);
  requestAnimationFrame(() => { held = document.activeElement; });
  moveSvgRootToFront.call(this, only);
  requestAnimationFrame(() => { if (document.activeElement !== held) held.focus(); });
};

/** Ask once for each stack what Blockly asks for each block, and each time of all that it hangs from. */
function queueAll() {
  const asked = new Set(), blocks = [...drawn].reverse();
  drawn = null;
  for (const block of blocks) {
    if (asked.has(block) || block.isDisposed()) continue;
    queueRender.call(block);
    for (let one = block; one && !asked.has(one); one = one.getParent()) asked.add(one);
  }
}

/** Make many blocks, apart from the page; what they are called follows when the page has time. @template T
 * @param {any} workspace @param {() => T} make @returns {T} */
export function together(workspace, make) {
  const canvas = workspace.getCanvas(), { parentNode: page, nextSibling: next } = canvas;
  deferring += 1;
  drawn = new Set();
  dom.startTextWidthCache();
  canvas.remove();
  try {
    const made = make();
    queueAll();
    Blockly.renderManagement.triggerQueuedRenders();
    return made;
  } finally {
    drawn = null;
    page.insertBefore(canvas, next);
    dom.stopTextWidthCache();
    deferring -= 1;
    later();
  }
}

function later() {
  if (due || !waiting.size) return;
  due = true;
  (window.requestIdleCallback ?? setTimeout)(() => { due = false; name(SLICE); later(); });
}

/** Name what waits, for so many ms. @param {number} most */
export function name(most = Infinity) {
  const end = performance.now() + most;
  for (const one of waiting) {
    if (performance.now() > end) return;
    waiting.delete(one);
    making = one;
    try { if (!(one.getSourceBlock?.() ?? one).isDisposed?.()) one.recomputeAriaContext(); } catch { /* it was taken away meanwhile */ } finally { making = null; }
  }
}
