// Blocks made at run time from the table of functions (GET /api/blocks), and the Python that they write.
import * as Blockly from "blockly";
import { signal } from "@preact/signals";
import { language } from "../base.js";
import { defineLanguage } from "./language.js";

const { Blocks, FieldDropdown, FieldNumber, Order, pythonGenerator: python } = Blockly;
const ALPHABET = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
const INLINE_MAX = 4; // values beside each other; more stand below each other
/** @type {any} */
export let table = null;
export const asked = signal(/** @type {any} */ (null)); // the function, or block, that help is wanted of

/** The table's words in the language that is shown. @param {any} named */
export const words = (named) => named[language.value] ?? named.en;
export const typeOf = (/** @type {any} */ f, /** @type {boolean} */ value) => (value ? `value ${f.key}` : f.key);

/** Ids of letters and digits only: the app for phones knows no others. */
export function newId() {
  return Array.from(crypto.getRandomValues(new Uint8Array(20)), (byte) => ALPHABET[byte % ALPHABET.length]).join("");
}

/** @returns {Promise<any>} */
export async function loadTable() {
  table = await (await fetch("/api/blocks")).json();
  Blockly.utils.idGenerator.TEST_ONLY.genUid = newId;
  python.INDENT = "    ";
  python.STATEMENT_PREFIX = "cyberdog.task.block(%1)\n";
  python.addReservedWords(["cyberdog", "choreographer", "dancer", "time", "true", "false", ...Object.keys(table.enums), ...Object.keys(table.records), ...table.builtins].join(","));
  defineValues();
  defineLanguage();
  defineChange();
  keepLetters();
  for (const f of table.functions) for (const value of formsOf(f)) defineFunction(f, value);
  return table;
}

/** Whether a function has a statement and a value, or only one of them. @param {any} f */
export function formsOf(f) { return f.attribute ? [true] : f.answers ? [false, true] : [false]; }

/** @param {any} f @param {boolean} value */
function defineFunction(f, value) {
  const type = typeOf(f, value);
  Blocks[type] = {
    init() {
      const group = table.groups.find((g) => g.id === f.group);
      const input = this.appendDummyInput();
      if (f.attribute || f.key.endsWith(".set_log") || f.key.endsWith("get_data")) input.appendField(words(group));
      input.appendField(words(f));
      for (const p of f.parameters) {
        this.appendValueInput(p.name).appendField(p.unit ? `${words(p)} (${p.unit})` : words(p));
      }
      this.setInputsInline(f.parameters.length <= INLINE_MAX);
      if (value) this.setOutput(true, null);
      else { this.setPreviousStatement(true); this.setNextStatement(true); }
      this.setColour(group.colour);
      this.setTooltip(() => words(f.about));
      this.setHelpUrl("#"); // a window of ours
      this.showHelp = () => { asked.value = f; };
    },
  };
  python.forBlock[type] = (block) => {
    const values = f.parameters.map((p) => python.valueToCode(block, p.name, Order.NONE) || codeOf(p));
    const code = f.attribute ? f.key : `${f.key}(${values.join(", ")})`;
    return value ? [code, f.attribute ? Order.MEMBER : Order.FUNCTION_CALL] : `${code}\n`;
  };
}

/** Help of the language's blocks is a window of ours, too: Blockly's leads to pages on the internet, in English. */
Blockly.BlockSvg.prototype.showHelp = function () {
  python.init(this.workspace);
  const code = [python.blockToCode(this, true) ?? ""].flat()[0].replace(/^[ \t]*cyberdog\.task\.block\('[0-9A-Za-z]+'\)\n/gm, "").trim();
  asked.value = { en: this.toString(60), about: { en: this.getTooltip() }, code, parameters: [] };
};
/** @type {any} */ (Blockly.ContextMenuRegistry.registry.getItem("blockHelp")).preconditionFn = () => "enabled";

/** A module of one's own as blocks, without and with what it returns. @param {{id: string, condition: string, describe: string}} module @returns {string[]} */
export function defineModule({ condition, describe }) {
  const [, name, inside] = /^\s*(\w+)\s*\(([^)]*)\)/.exec(condition) ?? [];
  if (!name) return [];
  const parameters = inside.split(",").map((text) => text.split("=")[0].trim()).filter(Boolean);
  return [false, true].map((value) => {
    const type = `${value ? "value " : ""}module ${name}`;
    Blocks[type] = {
      init() {
        this.appendDummyInput().appendField(name);
        for (const p of parameters) this.appendValueInput(p).appendField(p);
        this.setInputsInline(true);
        if (value) this.setOutput(true, null);
        else { this.setPreviousStatement(true); this.setNextStatement(true); }
        this.setStyle("procedure_blocks");
        this.setTooltip(describe);
      },
    };
    python.forBlock[type] = (block) => {
      const code = `${name}(${parameters.map((p) => python.valueToCode(block, p, Order.NONE) || "None").join(", ")})`;
      return value ? [code, Order.FUNCTION_CALL] : `${code}\n`;
    };
    return type;
  });
}

/** Names keep the letters of all languages; none begins with _, since values of such are not reported. */
function keepLetters() {
  /** @type {any} */ (Blockly.Names.prototype).safeName = (/** @type {string} */ name) => {
    const letters = name.normalize("NFKC").replace(/[^\p{ID_Continue}]/gu, "_");
    return /^\p{ID_Start}/u.test(letters) ? letters : `my_${letters}`;
  };
}

/** Python's name of a variable of a workspace. @param {any} workspace @returns {(model: any) => string} */
export function variablesOf(workspace) {
  python.init(workspace);
  return (model) => python.getVariableName(model.getId());
}

/** As a pupil would write it; a variable that is changed begins at 0. */
function defineChange() {
  python.forBlock.math_change = (block) => {
    const name = python.getVariableName(block.getFieldValue("VAR")), { definitions_: definitions } = /** @type {any} */ (python);
    definitions.variables = definitions.variables?.replace(new RegExp(`^${name} = None$`, "m"), `${name} = 0`);
    return `${name} += ${python.valueToCode(block, "DELTA", Order.NONE) || "0"}\n`;
  };
}

/** The Python of a parameter that nothing is put into. @param {any} p */
function codeOf(p) {
  if (p.kind === "choice") return p.enum ? `${p.enum}.${p.default}` : p.default;
  if (p.kind === "list") return "[]";
  if (p.kind === "str") return python.quote_(p.default ?? "");
  if (p.kind === "bool") return p.default ? "True" : "False";
  return p.default === null || p.default === undefined ? "None" : String(p.default);
}

/** The shadow that a new block has in a parameter's place. @param {any} p */
function shadowOf(p) {
  switch (p.kind) {
    case "choice": return { type: "robot_choice", extraState: { enum: p.enum, choices: p.choices }, fields: { MEMBER: p.start ?? p.default } };
    case "float": case "int": {
      const { minimum: min, maximum: max } = p;
      return { type: "robot_number", extraState: { min, max, whole: p.kind === "int" }, fields: { NUM: p.start ?? p.default ?? 0 } };
    }
    case "str": return { type: "text", fields: { TEXT: p.default ?? "" } };
    case "bool": return { type: "logic_boolean", fields: { BOOL: p.default ? "TRUE" : "FALSE" } };
    case "list": return { type: "lists_create_with", extraState: { itemCount: 0 } };
    default: return null;
  }
}

/** A block of a function for the toolbox, with its shadows. @param {any} f @param {boolean} value */
export function stateOf(f, value) {
  const inputs = {};
  for (const p of f.parameters) {
    const shadow = shadowOf(p);
    if (shadow) inputs[p.name] = p.kind === "list" ? { block: shadow } : { shadow };
  }
  return { kind: "block", type: typeOf(f, value), inputs };
}

/** Numbers with limits, and members of enumerations. */
function defineValues() {
  Blocks.robot_number = {
    init() {
      this.limits = {};
      this.appendDummyInput().appendField(new FieldNumber(0), "NUM");
      this.setOutput(true, "Number");
      this.setStyle("math_blocks");
    },
    saveExtraState() { return this.limits; },
    loadExtraState(/** @type {any} */ limits) {
      this.limits = limits;
      this.getField("NUM").setConstraints(limits.min, limits.max, limits.whole ? 1 : undefined);
      if (limits.min !== undefined) this.setTooltip(`${limits.min} … ${limits.max}`);
    },
  };
  python.forBlock.robot_number = (block) => {
    const number = Number(block.getFieldValue("NUM"));
    return [String(number), number < 0 ? Order.UNARY_SIGN : Order.ATOMIC];
  };
  Blocks.robot_choice = {
    init() {
      this.choice = { enum: "StateCode", choices: Object.keys(table.enums.StateCode) };
      this.appendDummyInput("ROW").appendField(this.field(), "MEMBER");
      this.setOutput(true, null);
      this.setColour("#6b5b1f");
    },
    field() { return new FieldDropdown(this.choice.choices.map((name) => [labelOf(name), name])); },
    saveExtraState() { return this.choice; },
    loadExtraState(/** @type {any} */ choice) {
      this.choice = choice;
      this.getInput("ROW").removeField("MEMBER");
      this.getInput("ROW").appendField(this.field(), "MEMBER");
    },
  };
  python.forBlock.robot_choice = (block) => {
    const member = block.getFieldValue("MEMBER"), { enum: owner } = /** @type {any} */ (block).choice;
    return owner ? [`${owner}.${member}`, Order.MEMBER] : [member, Order.ATOMIC];
  };
}

const labelOf = (/** @type {string} */ name) => (table.members[name] ? words(table.members[name]) : name.replaceAll("_", " "));

/** The Python of a workspace. @param {any} workspace */
export function pythonOf(workspace) { return python.workspaceToCode(workspace); }

/** Which block each line belongs to ("" for none), by the marks before them. @param {string} code @returns {string[]} */
export function blocksOfLines(code) {
  const owners = [], stack = [];
  for (const line of code.split("\n")) {
    const indent = line.length - line.trimStart().length;
    const mark = /^\s*cyberdog\.task\.block\('([0-9A-Za-z]+)'\)/.exec(line);
    while (stack.length && (mark ? stack[stack.length - 1].indent >= indent : line.trim() && stack[stack.length - 1].indent > indent)) stack.pop();
    if (mark) stack.push({ indent, id: mark[1] });
    owners.push(line.trim() ? stack[stack.length - 1]?.id ?? "" : "");
  }
  return owners;
}
