// The workspace of blocks: made, loaded, watched; which block is lit, where it halts, what is wrong with it.
import * as Blockly from "blockly";
import { effect, signal } from "@preact/signals";
import { kept, keysUnder, language, say, t, theme as shade } from "../base.js";
import { defineModule, newId, pythonOf } from "./blocks.js";
import { inject, together } from "./speed.js";
import "./spoken.js";
import { found, noteUse, readyToSearch, recentBlocks, sought, theme, toolbox, wanted } from "./toolbox.js";

export const look = kept("studio.look", "plain");
effect(() => { document.documentElement.dataset.look = look.value; });
export const code = signal("");
export const empty = signal(false); // no block stands here
export const selected = signal("");
export const breaks = signal(/** @type {string[]} */ ([]));
export const changes = signal(0); // counts what a person changed
export const modules = signal(/** @type {any[]} */ ([]));
export const BREAK = "breakpoint";
Blockly.Scrollbar.scrollbarThickness = 14;
/** @type {any} */
export let workspace = null;
let allowed = /** @type {Set<string> | null} */ (null);
let lit = "", place = /** @type {HTMLElement | null} */ (null), unarranged = false; // blocks came while nothing is shown

/** Make the workspace in `element`; again after a change of language or looks, with the same blocks. @param {HTMLElement} element */
export function mount(element) {
  place = element;
  remake();
  refresh();
  new ResizeObserver(() => { if (!workspace || !element.clientWidth) return; Blockly.svgResize(workspace); if (unarranged) arrange(); }).observe(element); // hidden, it keeps its view
}

export function remake() {
  if (place) keepingKeyboard(build);
}

/** Have the keyboard where it was, in the toolbox or among the blocks, when `act` replaces them. @param {() => void} act */
function keepingKeyboard(act) {
  const at = place.contains(document.activeElement) && document.activeElement;
  const boxed = at && at.closest(".blocklyToolbox");
  act();
  if (at && !document.contains(at)) Blockly.getFocusManager().focusTree(boxed ? workspace.getToolbox() : workspace);
}

function build() {
  const state = workspace ? save() : null;
  const view = workspace ? { scale: workspace.scale, x: workspace.scrollX, y: workspace.scrollY } : null;
  workspace?.dispose();
  Blockly.setLocale(Blockly.messages[language.value] ?? Blockly.messages.en);
  Blockly.Msg.PROCEDURES_HUE = "#a33b5e";
  for (const key of keysUnder("blockly.")) Blockly.Msg[key] = t(`blockly.${key}`); // which Blockly has in English only, or in no good Chinese
  workspace = inject(place, {
    toolbox: toolbox(modules.value.flatMap(defineModule), allowed), renderer: "zelos", theme: theme(look.value), media: "/studio/vendor/media/", sounds: false,
    trashcan: true, comments: true, maxTrashcanContents: 20, move: { scrollbars: true, drag: true, wheel: true },
    zoom: { controls: true, wheel: false, pinch: true, startScale: place.clientWidth < 600 ? 0.65 : 0.8, maxScale: 2, minScale: 0.3 },
  });
  workspace.registerToolboxCategoryCallback("FOUND", found);
  workspace.registerToolboxCategoryCallback("RECENT", recentBlocks);
  workspace.addChangeListener(noticed);
  if (state) load(state, false);
  if (view) { workspace.setScale(view.scale); workspace.scroll(view.x, view.y); }
  light(lit);
}

effect(() => { void language.value; void look.value; void shade.value; if (workspace) remake(); });

/** @param {any} event */
function noticed(event) {
  if (event.type === Blockly.Events.SELECTED) selected.value = event.newElementId && workspace.getBlockById(event.newElementId) ? event.newElementId : "";
  if (event.type === Blockly.Events.BLOCK_CREATE && event.recordUndo) noteUse(workspace.getBlockById(event.blockId)?.type ?? "");
  if (event.isUiEvent) return;
  if (event.recordUndo) touched = true; // else it was loaded, not made
  soon();
}

let due = false, touched = false;
/** Many events come at once: the Python is made once for all of them. */
function soon() {
  if (due) return;
  due = true;
  setTimeout(() => {
    due = false;
    if (workspace.isDragging()) { setTimeout(soon, 80); return; } // a block that is moved by keys ends its events before it is put down
    refresh();
    if (touched) { touched = false; changes.value += 1; }
  });
}

/** Generate the Python again. */
export function refresh() {
  if (!workspace) return;
  code.value = pythonOf(workspace);
  empty.value = isEmpty();
  breaks.value = workspace.getAllBlocks(false).filter((block) => block.data === BREAK).map((block) => block.id);
  for (const block of workspace.getAllBlocks(false)) block.getSvgRoot().classList.toggle("breaks", block.data === BREAK);
}

/** What a file, the library and the app's `style` keep. */
export function save() { return Blockly.serialization.workspaces.save(workspace); }

/** @param {any} state @param {boolean} [fresh] forget what could be undone */
export function load(state, fresh = true) {
  const group = Blockly.Events.getGroup();
  try {
    Blockly.Events.setRecordUndo(false);
    together(workspace, () => Blockly.serialization.workspaces.load(tidied(state), workspace));
  } finally {
    Blockly.Events.setRecordUndo(true);
    Blockly.Events.setGroup(group);
  }
  if (fresh) { workspace.clearUndo(); arrange(); }
  refresh();
}

/** Show the middle of what fits, the beginning of what does not. */
function arrange() {
  unarranged = !place?.clientWidth;
  if (unarranged || !workspace.getAllBlocks(false).length) return;
  const { viewWidth, viewHeight } = workspace.getMetrics(), box = workspace.getBlocksBoundingBox(), { scale } = workspace;
  if ((box.right - box.left) * scale < viewWidth && (box.bottom - box.top) * scale < viewHeight) workspace.scrollCenter();
  else workspace.scroll(24 - box.left * scale, 24 - box.top * scale);
}

/** With ids of letters and digits: those of the app are not. @param {any} state */
function tidied(state) {
  const known = /** @type {Map<string, string>} */ (new Map());
  const fine = (id) => (/^[0-9A-Za-z]+$/.test(id) ? id : known.get(id) ?? known.set(id, newId()).get(id));
  return JSON.parse(JSON.stringify(state), (key, value) => (key === "id" && typeof value === "string" ? fine(value) : value));
}

export function clear() {
  Blockly.Events.setRecordUndo(false);
  workspace.clear();
  Blockly.Events.setRecordUndo(true);
  workspace.clearUndo();
  refresh();
}

/** Undo, once what was just done has been noted: Blockly notes it a frame later. */
export const undo = (/** @type {boolean} */ redo) => noted(() => workspace.undo(redo));
function noted(/** @type {() => void} */ act) { requestAnimationFrame(() => setTimeout(() => { act(); touched = true; soon(); })); }
export const isEmpty = () => !workspace || workspace.getAllBlocks(false).length === 0;

/** Show only what a mission allows, or everything. @param {string[] | null} types */
export function allow(types) {
  allowed = types && new Set(types);
  showModules();
}

/** The modules that there are now, in the toolbox. */
export function showModules() {
  if (workspace) keepingKeyboard(() => workspace.updateToolbox(toolbox(modules.value.flatMap(defineModule), allowed)));
}

/** Blocks to look at, in `element`. @param {HTMLElement} element @param {any} state */
export function picture(element, state) {
  const made = inject(element, { readOnly: true, renderer: "zelos", theme: theme(look.value), media: "/studio/vendor/media/", sounds: false,
    move: { scrollbars: true, drag: true }, zoom: { controls: false, startScale: 0.65 } });
  Blockly.serialization.workspaces.load(state, made);
  return made;
}

/** Light one block and no other. @param {string} id @param {boolean} [look] bring it into view */
export function light(id, look = false) {
  if (lit !== id) workspace?.getBlockById(lit)?.getSvgRoot().classList.remove("lit");
  lit = id;
  const block = workspace?.getBlockById(id);
  if (!block) return Boolean(!id);
  block.getSvgRoot().classList.add("lit");
  if (look && !inView(block)) workspace.centerOnBlock(id);
  return true;
}

function inView(block) {
  const box = block.getSvgRoot().getBoundingClientRect(), frame = place.getBoundingClientRect();
  return box.top >= frame.top && box.top < frame.bottom - 30 && box.left < frame.right;
}

/** Halt before this block, or no more. @param {string} [id] */
export function toggleBreak(id = selected.value) {
  const block = statementOf(workspace.getBlockById(id));
  if (!block) { say(t("studio.break.choose")); return; }
  block.data = block.data === BREAK ? null : BREAK;
  say(t(block.data ? "studio.break.set" : "studio.break.gone", { what: block.toString(60) }));
  refresh();
  changes.value += 1;
}

/** The statement that a value stands in. @param {any} block */
function statementOf(block) {
  while (block && block.outputConnection) block = block.getSurroundParent() ?? block.getParent();
  return block;
}

/** Show what is wrong at blocks: id to sentence. @param {Map<string, string>} wrong */
export function blame(wrong) {
  for (const block of workspace?.getAllBlocks(false) ?? []) {
    const words = wrong.get(block.id) ?? null;
    if (block.isShadow() || (!words && !block.hasIcon?.(Blockly.icons.IconType.WARNING))) continue;
    block.setWarningText(words);
    block.getSvgRoot().classList.toggle("wrong", Boolean(words));
  }
}

/** Show what has these words in the toolbox; how many blocks that are. @param {string} text */
export function search(text) {
  wanted.text = text;
  const box = workspace.getToolbox(), item = box?.getToolboxItemById("found");
  if (!item) return 0;
  if (text) readyToSearch(() => {
    const inside = document.activeElement?.closest(".blocklyFlyout");
    if (wanted.text) box.refreshSelection();
    if (wanted.text && inside) toToolbox(true);
  });
  if (text) { item.show?.(); box.setSelectedItem(item); box.refreshSelection(); } else { box.clearSelection(); item.hide?.(); }
  return text ? sought().count : 0;
}

/** Bring the keyboard to the first block that is found, or to the toolbox. @param {boolean} [first] */
export function toToolbox(first = false) {
  const box = workspace.getToolbox(), manager = Blockly.getFocusManager();
  if (first) manager.focusNode(box.getFlyout().getContents()[0].getElement()); else manager.focusTree(box);
}

export function focus(id) {
  const block = workspace.getBlockById(id);
  if (!block) return;
  workspace.centerOnBlock(id);
  Blockly.getFocusManager().focusNode(block);
}

Blockly.ContextMenuRegistry.registry.register({
  id: "breakpoint", weight: 0, scopeType: Blockly.ContextMenuRegistry.ScopeType.BLOCK, preconditionFn: () => "enabled",
  displayText: (scope) => t(statementOf(scope.block)?.data === BREAK ? "studio.break.off" : "studio.break.on"), callback: (scope) => toggleBreak(scope.block.id),
});
Blockly.ShortcutRegistry.registry.register({
  name: "breakpoint", keyCodes: [Blockly.utils.KeyCodes.F9 ?? 120], preconditionFn: (ws) => !ws.isFlyout, callback: (_, event) => { event.preventDefault(); toggleBreak(); return true; },
});
for (const name of ["undo", "redo"]) {
  const { registry } = Blockly.ShortcutRegistry, was = registry.getRegistry()[name];
  registry.unregister(name);
  registry.register({ ...was, allowCollision: true, callback: (ws, event, ...more) => { event.preventDefault(); noted(() => was.callback(ws, event, ...more)); return true; } });
}
