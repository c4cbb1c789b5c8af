// What makes Blockly load many blocks quickly: texts are measured without asking for styles, blocks are coloured once,
// nothing is asked of all that stands above or below, and what blocks are called for screen readers is made once, after
// they are there. The quotes of a text are drawn by its own field, not by two pictures beside it. The machine's sound,
// which each workspace, toolbox and trash can would open for itself, is opened with the first beep.
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
/** @param {any} field */
function measure(field) {
  const c = field.getConstants();
  if (deferring && c && field.textElement_) dom.getFastTextWidth(field.textElement_, c.FIELD_TEXT_FONTSIZE, c.FIELD_TEXT_FONTWEIGHT, c.FIELD_TEXT_FONTFAMILY);
}
Field.prototype.updateSize_ = function (/** @type {number | undefined} */ margin) {
  measure(this);
  size.call(this, margin);
  canvas ??= document.querySelector(".blocklyComputeCanvas");
  if (canvas?.isConnected) canvas.remove(); // it measures outside of the page, too, and there asks for no styles
};

// Drop-downs measure by themselves, which outside of the page has no style to go by: true and false lay on their arrows.
const choice = /** @type {any} */ (Blockly.FieldDropdown.prototype), { render_: choose } = choice;
choice.render_ = function () {
  if (deferring && this.textContent_) { this.textContent_.nodeValue = this.getDisplayText_(); measure(this); }
  choose.call(this);
};

for (const { prototype: made } of /** @type {any[]} */ ([Field, Blockly.BlockSvg])) {
  const now = made.recomputeAriaContext;
  made.recomputeAriaContext = function (/** @type {any[]} */ ...given) {
    if (!deferring || making === this) return now.apply(this, given);
    waiting.add(this);
    return false; // "it has no words yet", as before it is drawn
  };
}

const block = /** @type {any} */ (Blockly.BlockSvg.prototype);
const { applyColour, getInheritedDisabled, initSvg, moveBy, queueRender, setConnectionTracking } = block;
/** Which are to be drawn, while many are made. @type {Set<any> | null} */
let drawn = null, dressing = /** @type {any} */ (null);
block.queueRender = function () { if (!drawn) return queueRender.call(this); drawn.add(this); return Promise.resolve(); };
/** Blocks are new: each is at its parent's, its connections are found once all are made, and those below are not yet. */
block.moveBy = function (/** @type {number} */ x, /** @type {number} */ y, /** @type {any} */ why) { if (!drawn || x || y) moveBy.call(this, x, y, why); };
block.setConnectionTracking = function (/** @type {boolean} */ on) {
  if (!drawn || on) setConnectionTracking.call(this, on); else for (const one of this.getConnections_(true)) one.setTracking(false);
};
/** Blockly colours a block when it gets a parent and when its field is drawn, too, and each time looks through all around it. */
block.initSvg = function () { const outer = dressing; dressing = this; try { initSvg.call(this); } finally { dressing = outer; } };
block.applyColour = function () { if (!deferring || dressing === this) applyColour.call(this); };
block.getInheritedDisabled = function () { return !drawn && getInheritedDisabled.call(this); };

Blockly.Extensions.unregister("text_quotes");
Blockly.Extensions.register("text_quotes", /** @this {any} */ function () {
  const field = this.getField("TEXT"), shown = field.getDisplayText_;
  field.getDisplayText_ = () => `“${shown.call(field)}”`;
});

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
  let made;
  try {
    made = make();
    queueAll();
    Blockly.renderManagement.triggerQueuedRenders();
  } finally {
    drawn = null;
    page.insertBefore(canvas, next);
    dom.stopTextWidthCache();
    deferring -= 1;
    later();
  }
  const blocks = workspace.getAllBlocks(false);
  if (blocks.some((/** @type {any} */ one) => !one.isEnabled())) for (const one of blocks) one.updateDisabled();
  return made;
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
