// Values in bubbles at their blocks: what a function answered there, what the variables of a block hold.
import { t, translated } from "../base.js";
import { variablesOf } from "./blocks.js";
import * as editor from "./editor.js";

const NS = "http://www.w3.org/2000/svg", LONG = 40, PAD = 6, HEIGHT = 22; // characters, workspace units
const pen = /** @type {CanvasRenderingContext2D} */ (document.createElement("canvas").getContext("2d"));
pen.font = "600 13px ui-monospace, monospace"; // as in studio.css
/** By id of the block: what is shown there. @type {Map<string, string>} */
const shown = new Map();
let due = false;

const SUCCESS = "(state (code 0, describe success)";
const DONE = /^(, response \((motion_id -?\d+, )?result True, code 0(, order_process_bar -?\d+)?\))?\)$/;

/** When and where it was measured: of that, pupils ask another block. */
const HEADER = /header \(stamp \(sec \d+, nanosec \d+\), frame_id [^()]*\), /;

/** An answer without what says only that it was done; a refusal in the language of the page. @param {string} value */
export function inWords(value) {
  if (!value.startsWith(SUCCESS)) return translated(value.replace(HEADER, ""));
  const rest = value.slice(SUCCESS.length);
  return DONE.test(rest) ? t("studio.answer.done") : rest.replace(/^, (.*)\)$/s, "$1");
}

/** What a function answered at a block. @param {string} id @param {string} value */
export function answered(id, value) { put(id, value); }

/** What variables hold, at the statements that name them. @param {Record<string, string>} held */
export function held(held) {
  if (!editor.workspace) return;
  const python = variablesOf(editor.workspace);
  for (const block of editor.workspace.getAllBlocks(false)) {
    if (block.outputConnection || block.isInsertionMarker()) continue;
    const models = block.getVarModels().filter((model) => python(model) in held);
    if (models.length) put(block.id, models.map((model) => `${model.getName()} = ${held[python(model)]}`).join(", "));
  }
}

export function clear() { shown.clear(); soon(); }

/** @param {string} id @param {string} text */
function put(id, text) {
  if (!id || shown.get(id) === text) return;
  shown.set(id, text);
  soon();
}

const short = (/** @type {string} */ text) => (text.length > LONG ? `${text.slice(0, LONG - 1)}…` : text);

function soon() {
  if (due) return;
  due = true;
  requestAnimationFrame(() => { due = false; draw(); });
}

/** Draw new bubbles and remove old ones, also after the blocks were replaced. */
export function draw() {
  for (const old of document.querySelectorAll(".blocklyBlockCanvas .value-bubble")) if (!shown.has(/** @type {any} */ (old).dataset.of)) old.remove();
  for (const [id, text] of shown) {
    const root = editor.workspace?.getBlockById(id)?.getSvgRoot();
    if (root) bubble(root, id, short(inWords(text)));
  }
}

/** One bubble, above the right end of its block. @param {SVGGElement} root @param {string} id @param {string} text */
function bubble(root, id, text) {
  let group = root.querySelector(":scope > .value-bubble");
  if (!group) {
    group = document.createElementNS(NS, "g");
    group.setAttribute("class", "value-bubble");
    group.setAttribute("aria-hidden", "true"); // the list of values is read
    /** @type {any} */ (group).dataset.of = id;
    group.append(document.createElementNS(NS, "rect"), document.createElementNS(NS, "text"));
    root.append(group);
  }
  const [box, words] = /** @type {any} */ (group.children);
  if (words.textContent === text) return;
  words.textContent = text;
  const block = editor.workspace.getBlockById(id), width = pen.measureText(text).width + 2 * PAD; // asked for it, the page would lay everything out
  group.setAttribute("transform", `translate(${block.width + 4}, 4)`);
  for (const [name, value] of Object.entries({ width, height: HEIGHT, rx: 8 })) box.setAttribute(name, value);
  words.setAttribute("x", PAD);
  words.setAttribute("y", HEIGHT - 7);
}
