// Modules of one's own: kept from a function's blocks, opened again, and shown from inside while they run.
import * as Blockly from "blockly";
import { useEffect, useRef } from "preact/hooks";
import { html, lacks, say, t, translated } from "../base.js";
import { defineModule } from "./blocks.js";
import * as editor from "./editor.js";
import { ask, frame } from "./link.js";
import { list, listed, program, show } from "./program.js";

const DEFINITIONS = new Set(["procedures_defnoreturn", "procedures_defreturn"]);
const CALLS = { procedures_callnoreturn: "module ", procedures_callreturn: "value module " };
const MARK = /cyberdog\.task\.block\('([0-9A-Za-z]+)'\)/g;
const owners = /** @type {Map<string, string>} */ (new Map()); // of blocks: the module's name
const styles = /** @type {Map<string, any>} */ (new Map()); // by name: the module's blocks

const nameOf = (/** @type {{condition: string}} */ module) => /^\s*(\w+)/.exec(module.condition)?.[1] ?? "";
export const ownerOf = (/** @type {string} */ block) => owners.get(block) ?? "";

/** @param {string} id @returns {Promise<any>} */
async function fetched(id) { return (await ask({ type: "fetch", program: id, module: true, log: false })).program; }

function blocksOf(found) {
  try { const made = JSON.parse(found.style); return made.blocks?.blocks?.length ? made : null; } catch { return null; }
}

/** Read the modules that a text calls, so that their blocks are known when they are lit. @param {string} text @param {Set<string>} [seen] */
export async function learn(text, seen = new Set()) {
  for (const module of editor.modules.value) {
    const name = nameOf(module);
    if (!name || seen.has(name) || !new RegExp(`\\b${name}\\s*\\(`).test(text)) continue;
    seen.add(name);
    const found = await fetched(module.id).catch(() => null);
    if (!found) continue;
    styles.set(name, blocksOf(found));
    for (const [, block] of found.body.matchAll(MARK)) owners.set(block, name);
    await learn(found.body, seen);
  }
}

/** Interface and body of a function of the open program, as its Python has them. @param {string} name */
function functionOf(name) {
  const [, head, inside] = new RegExp(`^def (${name}\\(.*\\)):\\n((?:(?: .*)?\\n)*)`, "m").exec(`${editor.code.value}\n`) ?? [];
  if (!head) return null;
  const body = inside.split("\n").filter((line) => !/^ {4}global /.test(line)).map((line) => line.slice(4)).join("\n").trim();
  return { condition: head, body: `${body}\n` };
}

/** Keep a function's blocks as a module: all programs of the robot can call it. @param {any} definition */
async function keep(definition) {
  const called = definition.getFieldValue("NAME"), made = functionOf(Blockly.pythonGenerator.getProcedureName(called));
  if (!made || !/^[A-Za-z_]\w*$/.test(called)) { say(t("studio.module.name", { name: called }), true); return; }
  const all = editor.save(), blocks = [Blockly.serialization.blocks.save(definition, { addCoordinates: true })];
  const style = JSON.stringify({ blocks: { languageVersion: 0, blocks }, variables: all.variables ?? [] });
  const id = editor.modules.value.find((module) => nameOf(module) === called)?.id ?? called;
  try {
    const { feedback } = await frame({ type: "module", operate: "save", mode: "common", target_id: [id], describe: called, style, ...made });
    if (feedback.state) throw new Error(feedback.describe);
    await list();
  } catch (error) { say(t("refused", { why: error.message }), true); return; }
  defineModule({ id, describe: called, ...made });
  if (program.value.module) { await renamed(id, called); return; }
  Blockly.Events.setGroup(true);
  try {
    for (const caller of Blockly.Procedures.getCallers(called, editor.workspace)) replace(caller, called, made.condition);
    definition.dispose(false);
  } finally { Blockly.Events.setGroup(false); }
  editor.showModules();
  say(t("studio.module.kept", { name: called }));
}

/** A module that was opened is kept: under a new name it is that module still, unless programs call it by the old one.
 * @param {string} id @param {string} name */
async function renamed(id, name) {
  const old = editor.modules.value.find((module) => module.id === program.value.module);
  program.value = { ...program.value, name, module: id };
  if (!old || old.id === id) { editor.showModules(); say(t("studio.module.kept", { name })); return; }
  const { feedback } = await frame({ type: "module", operate: "delete", target_id: [old.id] });
  await list();
  editor.showModules();
  if (feedback.state) say(`${t("studio.module.kept", { name })} ${t("studio.module.used", { name: nameOf(old), by: callersOf(old) })}`); else say(t("studio.module.kept", { name }));
}

/** Names of what calls a module. @param {any} module */
const callersOf = (module) => (module.be_depended ?? []).map((/** @type {string} */ id) => {
  const task = listed.value.find((one) => one.id === id), other = editor.modules.value.find((one) => one.id === id);
  return task?.describe || (other && nameOf(other)) || id;
}).join(", ");

/** Have a call of a function be one of the module. @param {any} caller @param {string} name @param {string} condition */
function replace(caller, name, condition) {
  const call = caller.workspace.newBlock(CALLS[caller.type] + name);
  call.initSvg();
  call.render();
  const parameters = /\((.*)\)/.exec(condition)[1].split(",").map((each) => each.trim()).filter(Boolean);
  parameters.forEach((parameter, number) => {
    const value = caller.getInputTargetBlock(`ARG${number}`);
    if (!value) return;
    value.unplug();
    call.getInput(parameter).connection.connect(value.outputConnection);
  });
  const { x, y } = caller.getRelativeToSurfaceXY(), next = caller.getNextBlock();
  const above = (caller.previousConnection ?? caller.outputConnection).targetConnection;
  caller.unplug(true);
  if (above) above.connect(call.previousConnection ?? call.outputConnection); else call.moveBy(x, y);
  if (!above && next) call.nextConnection.connect(next.previousConnection);
  caller.dispose(false);
}

/** Show a module's blocks as a program, to change and keep them again. @param {{id: string}} module */
export async function openModule({ id }) {
  const found = await fetched(id), made = found && blocksOf(found);
  if (!made) throw new Error(t("studio.module.text"));
  show({ name: found.describe, kind: "blocks", style: made, module: id });
}

/** @param {any} module */
export async function removeModule(module) {
  const { feedback } = await frame({ type: "module", operate: "delete", target_id: [module.id] });
  await list();
  const now = editor.modules.value.find((one) => one.id === module.id);
  if (feedback.state) say(now?.be_depended.length ? t("studio.module.used", { name: nameOf(now), by: callersOf(now) }) : translated(feedback.describe), true);
  editor.showModules();
}

/** The module that runs, with its lit block. @param {{name: string, block: string}} props */
export function Inside({ name, block }) {
  const place = useRef(/** @type {any} */ (null)), last = useRef(""), made = useRef(/** @type {any} */ (null));
  if (styles.get(name)) last.current = name;
  const shown = last.current;
  useEffect(() => {
    if (!shown) return undefined;
    made.current = editor.picture(place.current, styles.get(shown));
    return () => { made.current?.dispose(); made.current = null; };
  }, [shown]);
  useEffect(() => {
    for (const each of made.current?.getAllBlocks(false) ?? []) each.getSvgRoot().classList.toggle("lit", each.id === block);
    if (made.current?.getBlockById(block)) made.current.centerOnBlock(block);
  }, [shown, block]);
  return html`<section class="inside" hidden=${!shown || name !== shown} aria-label=${t("studio.phase.module", { name: shown })}>
    <b>${t("studio.phase.module", { name: shown })}</b><div ref=${place}></div></section>`;
}

Blockly.ContextMenuRegistry.registry.register({
  id: "module", weight: 1, scopeType: Blockly.ContextMenuRegistry.ScopeType.BLOCK,
  displayText: () => [t("studio.module.keep"), lacks("program")].filter(Boolean).join(": "),
  preconditionFn: ({ block }) => (DEFINITIONS.has(block.type) ? (lacks("program") ? "disabled" : "enabled") : "hidden"), callback: ({ block }) => { keep(block); },
});
