// Blocks of the language that Blockly does not bring: pauses, dictionaries, fields of answers, errors that are caught.
import * as Blockly from "blockly";
import { t } from "../base.js";

const { Blocks, FieldTextInput, FieldNumber, Order, pythonGenerator: python } = Blockly;
const PATH = /^[A-Za-z]\w*(\.[A-Za-z]\w*|\[\d+\])*$/;

/** Each: its inputs (name to shadow), its fields, its colour, its Python. The words are under block.TYPE as "… %NAME …".
 * @type {Record<string, any>} */
const OWN = {
  wait: { style: "loop_blocks", inputs: ["SECONDS"], code: (v) => `time.sleep(${v("SECONDS", "1")})\n` },
  robot_time: { style: "math_blocks", output: "Number", code: () => ["time.monotonic()", Order.FUNCTION_CALL] },
  clock_time: { style: "text_blocks", output: "String", code: () => ['time.strftime("%H:%M:%S", time.localtime())', Order.FUNCTION_CALL] },
  forever: { style: "loop_blocks", statement: "DO", code: (_, block) => `while True:\n${python.statementToCode(block, "DO") || python.PASS}` },
  field_of: { style: "list_blocks", output: null, path: "state.code", inputs: ["VALUE"],
    code: (v, block) => [`${v("VALUE", "None", Order.MEMBER)}.${block.getFieldValue("PATH")}`, Order.MEMBER] },
  as_text: { style: "text_blocks", output: "String", inputs: ["VALUE"], code: (v) => [`str(${v("VALUE", "''")})`, Order.FUNCTION_CALL] },
  as_number: { style: "math_blocks", output: "Number", inputs: ["VALUE"], code: (v) => [`float(${v("VALUE", "0")})`, Order.FUNCTION_CALL] },
  dict_empty: { style: "list_blocks", output: null, code: () => ["{}", Order.ATOMIC] },
  dict_set: { style: "list_blocks", inputs: ["DICT", "KEY", "VALUE"], code: (v) => `${v("DICT", "{}", Order.MEMBER)}[${v("KEY", "''")}] = ${v("VALUE", "None")}\n` },
  dict_get: { style: "list_blocks", output: null, inputs: ["DICT", "KEY"], code: (v) => [`${v("DICT", "{}", Order.MEMBER)}.get(${v("KEY", "''")})`, Order.FUNCTION_CALL] },
  dict_has: { style: "list_blocks", output: "Boolean", inputs: ["DICT", "KEY"], code: (v) => [`${v("KEY", "''", Order.RELATIONAL)} in ${v("DICT", "{}", Order.RELATIONAL)}`, Order.RELATIONAL] },
  dict_keys: { style: "list_blocks", output: "Array", inputs: ["DICT"], code: (v) => [`list(${v("DICT", "{}")})`, Order.FUNCTION_CALL] },
  dict_remove: { style: "list_blocks", inputs: ["DICT", "KEY"], code: (v) => `${v("DICT", "{}", Order.MEMBER)}.pop(${v("KEY", "''")}, None)\n` },
  list_append: { style: "list_blocks", inputs: ["LIST", "VALUE"], code: (v) => `${v("LIST", "[]", Order.MEMBER)}.append(${v("VALUE", "None")})\n` },
  try_except: { style: "logic_blocks", statement: "DO", second: "ELSE",
    code: (_, block) => `try:\n${python.statementToCode(block, "DO") || python.PASS}except Exception:\n${python.statementToCode(block, "ELSE") || python.PASS}` },
  remark: { style: "text_blocks", text: "TEXT", code: (_, block) => `# ${block.getFieldValue("TEXT").replace(/[\r\n]+/g, " ")}\n` },
  type_made: { style: "list_blocks", output: null, kinds: ["MotionSequence", "MotionSequenceGait", "MotionSequencePace"],
    code: (_, block) => [`${block.getFieldValue("KIND")}()`, Order.FUNCTION_CALL] },
  field_set: { style: "list_blocks", path: "duration", inputs: ["OBJECT", "VALUE"],
    code: (v, block) => `${v("OBJECT", "None", Order.MEMBER)}.${block.getFieldValue("PATH")} = ${v("VALUE", "None")}\n` },
};
export const OWN_TYPES = Object.keys(OWN);

export function defineLanguage() {
  for (const [type, own] of Object.entries(OWN)) {
    Blocks[type] = { init() { shape(this, type, own); } };
    python.forBlock[type] = (block) => own.code((name, empty, order = Order.NONE) => python.valueToCode(block, name, order) || empty, block);
  }
}

/** @param {any} block @param {string} type @param {any} own */
function shape(block, type, own) {
  const pending = /** @type {any[][]} */ ([]);
  const put = (input) => { for (const [field, name] of pending.splice(0)) input.appendField(field, name); };
  for (const piece of t(`block.${type}`).split(/(%\w+)/).map((text) => text.trim()).filter(Boolean)) {
    const name = piece.slice(1);
    if (!piece.startsWith("%")) pending.push([piece]);
    else if (own.inputs?.includes(name)) put(block.appendValueInput(name));
    else pending.push([fieldOf(name, own), name]);
  }
  if (pending.length) put(block.appendDummyInput());
  if (own.statement) block.appendStatementInput(own.statement);
  if (own.second) { block.appendDummyInput().appendField(t(`block.${type}.second`)); block.appendStatementInput(own.second); }
  block.setInputsInline(true);
  block.setStyle(own.style);
  if (own.output !== undefined) block.setOutput(true, own.output);
  else { block.setPreviousStatement(true); block.setNextStatement(true); }
  block.setTooltip(t(`block.${type}.about`));
}

/** @param {string} name @param {any} own */
function fieldOf(name, own) {
  if (name === "PATH") return new FieldTextInput(own.path, (text) => (PATH.test(text) ? text : null));
  if (name === "KIND") return new Blockly.FieldDropdown(own.kinds.map((kind) => [kind, kind]));
  if (name === "TEXT") return new FieldTextInput(t("block.remark.text"));
  return new FieldNumber(0);
}
