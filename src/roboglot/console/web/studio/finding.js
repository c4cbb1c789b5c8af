// Blocks found by words: those of the table, of the language (in English and Chinese, by name, explanation and Python),
// of variables and functions, and modules of one's own.
import * as Blockly from "blockly";
import { language, t } from "../base.js";
import { OWN_TYPES } from "./language.js";
import { formsOf, stateOf, table, words } from "./blocks.js";

const FOUND_MAX = 30;
/** What pupils and teachers call it, besides what stands on it. @type {Record<string, string>} */
const CALLED = {
  forever: "loop while 循环", controls_repeat_ext: "loop for 循环", controls_whileUntil: "loop 循环", controls_for: "loop range 循环", controls_forEach: "loop 循环",
  controls_flow_statements: "loop continue 循环", wait: "sleep pause 暂停 等待", remark: "comment 注释", controls_if: "else elif condition 条件 判断", logic_boolean: "true false 真 假",
  text_print: "print output show 打印 输出 显示", text_join: "join concatenate 连接 拼接", as_text: "str", as_number: "int float", math_random_int: "dice 随机 骰子",
  variables_set: "variable assign 变量 赋值", variables_get: "variable 变量", math_change: "variable change increase 变量 增加",
  procedures_defnoreturn: "function def define 函数 定义", procedures_defreturn: "function def return define 函数 定义", procedures_ifreturn: "function return 函数 返回", math_modulo: "remainder 余数",
};
const MORE = ["variables_set", "variables_get", "math_change", "procedures_defnoreturn", "procedures_defreturn", "procedures_ifreturn"].map((type) => ({ kind: "block", type }));
/** By language, then by block: its words. @type {Map<string, Map<string, string>>} */
const known = new Map();
let other = /** @type {Record<string, string> | null} */ (null); // words of the language that is not shown
let asked = "";

/** A block's words as it stands in the toolbox. @param {any} workspace @param {any} item */
function wordsOf(workspace, item) {
  const made = Blockly.serialization.blocks.append({ ...item, kind: undefined }, workspace), tip = made.getTooltip();
  const found = `${made.toString()} ${typeof tip === "string" ? tip : ""}`;
  workspace.clear();
  return found.toLowerCase();
}

/** All words of the language's blocks in one language. @param {"en" | "zh"} name @param {any[]} items */
function readAll(name, items) {
  const found = new Map(), before = { ...Blockly.Msg }, workspace = new Blockly.Workspace();
  Blockly.Events.disable();
  try {
    Blockly.setLocale(Blockly.messages[name]);
    for (const item of items) {
      const own = name !== language.value && OWN_TYPES.includes(item.type); // its words are the page's
      found.set(keyOf(item), own ? `${other?.[`block.${item.type}`]} ${other?.[`block.${item.type}.about`]}`.toLowerCase() : wordsOf(workspace, item));
    }
  } finally {
    Object.assign(Blockly.Msg, before);
    Blockly.Events.enable();
    workspace.dispose();
  }
  return found;
}

const keyOf = (/** @type {any} */ item) => `${item.type} ${JSON.stringify(item.extraState ?? "")}`;

/** The other language's words, once someone searches; `then` when they are there. @param {() => void} then */
export function prepare(then) {
  const name = language.value === "zh" ? "en" : "zh";
  if (asked === name) return;
  asked = name;
  fetch(`/studio/words/${name}.json`).then((answer) => answer.json()).then((found) => { other = found; known.clear(); then(); }, () => { asked = ""; });
}

/** @param {any} item @param {any[]} all */
function of(item, all) {
  if (!known.has(language.value)) for (const name of /** @type {("en" | "zh")[]} */ (["en", "zh"])) known.set(name, readAll(name, all));
  const [here, there] = [language.value, language.value === "zh" ? "en" : "zh"].map((name) => known.get(name)?.get(keyOf(item)) ?? "");
  return { name: here, all: `${item.type} ${CALLED[item.type] ?? ""} ${here} ${there}`.toLowerCase() };
}

/** Latin words from their beginning, so that "if" is not in "lift"; Chinese anywhere. @param {string} text @param {string} wish */
function has(text, wish) {
  for (let at = text.indexOf(wish); at >= 0; at = text.indexOf(wish, at + 1)) if (!/^[a-z]/.test(wish) || !/[a-z]/.test(text[at - 1] ?? "")) return true;
  return false;
}

/** Named so, called so, or only explained so. @param {string} name @param {string[]} wishes */
const rank = (name, wishes) => (name.startsWith(wishes[0]) ? 0 : wishes.every((wish) => has(name, wish)) ? 1 : 2);

/** How many blocks have all these words, and the first of them as the toolbox shows them.
 * @param {string} text @param {any[]} items of the language @param {string[]} modules types @param {(item: any) => boolean} may */
export function find(text, items, modules, may) {
  const wishes = text.toLowerCase().split(/\s+/).filter(Boolean), hits = /** @type {{item: any, rank: number}[]} */ ([]);
  const all = [...items, ...MORE];
  const offer = (/** @type {string} */ name, /** @type {string} */ words, /** @type {any[]} */ made) => {
    if (wishes.length && wishes.every((wish) => has(words, wish))) for (const item of made.filter(may)) hits.push({ item, rank: rank(name, wishes) });
  };
  for (const item of all) { const { name, all: words } = of(item, all); offer(name, words, [item]); }
  for (const type of modules) { const name = type.replace(/^(value )?module /, "").toLowerCase(); offer(name, name, [{ kind: "block", type }]); }
  for (const f of table.functions) offer(words(f).toLowerCase(), `${f.key} ${f.key.replaceAll("_", " ")} ${f.en} ${f.zh} ${f.about.en} ${f.about.zh}`.toLowerCase(), formsOf(f).map((value) => stateOf(f, value)));
  hits.sort((a, b) => a.rank - b.rank);
  const shown = hits.slice(0, FOUND_MAX).map(({ item }) => item);
  if (!shown.length) return { count: 0, contents: [{ kind: "label", text: t("studio.search.none") }] };
  if (hits.length > FOUND_MAX) shown.push({ kind: "label", text: t("studio.search.more", { n: hits.length - FOUND_MAX }) });
  return { count: hits.length, contents: shown };
}
