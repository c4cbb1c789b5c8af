// What can be taken: recently used, found, the language, the functions by group, modules of one's own.
import * as Blockly from "blockly";
import { kept, t } from "../base.js";
import { formsOf, stateOf, table, typeOf, words } from "./blocks.js";
import { find, prepare } from "./finding.js";

const RECENT_MAX = 12;
const STATES_ONLY = new Set(["motion", "led", "audio", "task", "cyberdog", "follow", "dance", "navigation"]); // whose answers say little
const recent = kept("studio.recent", "");
export const wanted = { text: "" };

/** What is read most often of an answer. */
const PATHS = {
  "cyberdog.ultrasonic.get_data": "range", "cyberdog.ultrasonic.data": "range", "cyberdog.touch.get_data": "touch_state", "cyberdog.touch.data": "touch_state",
  "cyberdog.bms.data": "batt_soc", "cyberdog.bms.get_data": "batt_soc", "cyberdog.lidar.get_data": "ranges", "cyberdog.lidar.data": "ranges",
  "cyberdog.odometer.get_data": "pose.pose.position.x", "cyberdog.odometer.data": "pose.pose.position.x", "cyberdog.imu.get_data": "angular_velocity.z",
  "cyberdog.imu.data": "angular_velocity.z", "cyberdog.network.data": "is_connected", "cyberdog.audio.get_volume": "response.volume",
  "cyberdog.gesture.recognized": "data.thumb_up", "cyberdog.gesture.recognized_any_gesture": "data.thumb_up", "cyberdog.gesture.recognized_designated_gesture": "data.thumb_up",
  "cyberdog.skeleton.sports_recognition": "response.counts", "cyberdog.skeleton.blocking_recognized": "response.counts", "cyberdog.skeleton.instant_recognized": "response.counts",
  "cyberdog.train.training_words_recognized": "response.trigger", "cyberdog.personnel.face_recognized": "dictionary", "cyberdog.personnel.voiceprint_recognized": "data",
  "cyberdog.navigation.get_preset": "list", "cyberdog.gps.get_data": "lat", "cyberdog.gps.data": "lat", "cyberdog.tof.get_data": "head.left_head.data", "cyberdog.tof.data": "head.left_head.data",
};

const number = (n) => ({ shadow: { type: "math_number", fields: { NUM: n } } });
const text = (words) => ({ shadow: { type: "text", fields: { TEXT: words } } });
const block = (type, inputs = {}, more = {}) => ({ kind: "block", type, inputs, ...more });
const choice = (owner) => ({ kind: "block", type: "robot_choice", extraState: { enum: owner, choices: Object.keys(table.enums[owner]) } });

/** The language by category; every block that the round-trip test plays. @returns {Record<string, [string, any[]]>} */
export function languageCategories() {
  return {
    control: ["loop_category", [
      block("forever"), block("controls_repeat_ext", { TIMES: number(4) }), block("controls_whileUntil"), block("controls_for", { FROM: number(1), TO: number(10), BY: number(1) }),
      block("controls_forEach"), block("controls_flow_statements"), block("wait", { SECONDS: number(1) }), block("remark")]],
    logic: ["logic_category", [
      block("controls_if"), block("controls_if", {}, { extraState: { hasElse: true } }), block("controls_if", {}, { extraState: { elseIfCount: 1, hasElse: true } }),
      block("logic_compare", { A: number(1), B: number(2) }), block("logic_operation"), block("logic_negate"), block("logic_boolean"), block("logic_null"), block("logic_ternary"), block("try_except"),
      ...Object.keys(table.enums).map(choice)]],
    math: ["math_category", [
      block("math_number", {}, { fields: { NUM: 123 } }), block("math_arithmetic", { A: number(1), B: number(1) }), block("math_single", { NUM: number(9) }), block("math_trig", { NUM: number(45) }),
      block("math_constant"), block("math_number_property", { NUMBER_TO_CHECK: number(0) }), block("math_round", { NUM: number(3.1) }), block("math_on_list"),
      block("math_modulo", { DIVIDEND: number(64), DIVISOR: number(10) }), block("math_constrain", { VALUE: number(50), LOW: number(1), HIGH: number(100) }),
      block("math_random_int", { FROM: number(1), TO: number(6) }), block("math_random_float"), block("math_atan2", { X: number(1), Y: number(1) }), block("as_number", { VALUE: text("5") }), block("robot_time")]],
    text: ["text_category", [
      block("text_print", { TEXT: text("hello") }), block("text"), block("text_join"), block("text_append", { TEXT: text("") }), block("text_length", { VALUE: text("abc") }), block("text_isEmpty", { VALUE: text("") }),
      block("text_indexOf", { VALUE: text("abc"), FIND: text("b") }), block("text_charAt", { VALUE: text("abc") }), block("text_getSubstring", { STRING: text("abc") }), block("text_changeCase", { TEXT: text("abc") }),
      block("text_trim", { TEXT: text("abc") }), block("text_count", { SUB: text("a"), TEXT: text("banana") }), block("text_replace", { FROM: text("a"), TO: text("b"), TEXT: text("banana") }),
      block("text_reverse", { TEXT: text("abc") }), block("as_text", { VALUE: number(5) }), block("clock_time")]],
    lists: ["list_category", [
      block("lists_create_with", {}, { extraState: { itemCount: 3 } }), block("lists_create_with", {}, { extraState: { itemCount: 0 } }), block("list_append", { VALUE: number(1) }), block("lists_repeat", { NUM: number(5) }), block("lists_length"), block("lists_isEmpty"),
      block("lists_indexOf"), block("lists_getIndex"), block("lists_setIndex"), block("lists_getSublist"), block("lists_split", { DELIM: text(",") }), block("lists_sort"), block("lists_reverse"),
      block("dict_empty"), block("dict_set", { KEY: text("name"), VALUE: number(1) }), block("dict_get", { KEY: text("name") }), block("dict_has", { KEY: text("name") }), block("dict_keys"), block("dict_remove", { KEY: text("name") }),
      block("field_of"), block("type_made"), block("field_set", { VALUE: number(10) })]],
  };
}

/** The functions of a group as the toolbox shows them. @param {string} group */
function shown(group) {
  const found = [];
  for (const f of table.functions.filter((f) => f.group === group)) {
    const path = PATHS[f.key];
    for (const value of formsOf(f)) {
      if (value && !f.attribute && STATES_ONLY.has(group) && !path) continue;
      const state = stateOf(f, value);
      found.push(value && path ? block("field_of", { VALUE: { block: state } }, { fields: { PATH: path } }) : state);
    }
  }
  return found;
}

const capital = (words) => words[0].toUpperCase() + words.slice(1);
const category = (name, style, contents, id) => ({ kind: "category", toolboxitemid: id, name, ...(style.startsWith("#") ? { colour: style } : { categorystyle: style }), contents });

/** What a search may find. */
let offered = { modules: /** @type {string[]} */ ([]), may: (/** @type {any} */ _) => true };

/** @param {string[]} modules types of the blocks of modules @param {Set<string> | null} allowed types that a mission allows */
export function toolbox(modules, allowed) {
  const may = (item) => !allowed || allowed.has(item.type) || (item.type === "field_of" && allowed.has(item.inputs?.VALUE?.block?.type)
    || (allowed.has("variables") && /^variables_|^math_change$/.test(item.type)) || (allowed.has("functions") && item.type.startsWith("procedures_")));
  offered = { modules, may };
  const contents = /** @type {any[]} */ ([
    { kind: "category", name: t("studio.found"), custom: "FOUND", categorystyle: "found_category", toolboxitemid: "found", hidden: "true" },
    ...(allowed ? [] : [{ kind: "category", name: t("studio.recent"), custom: "RECENT", categorystyle: "found_category", toolboxitemid: "recent" }])]);
  for (const [id, [style, blocks]] of Object.entries(languageCategories())) {
    const left = blocks.filter(may);
    if (left.length) contents.push(category(t(`studio.toolbox.${id}`), style, left, id));
  }
  if (!allowed || allowed.has("variables")) contents.push({ kind: "category", name: t("studio.toolbox.variables"), custom: "VARIABLE", categorystyle: "variable_category" });
  if (!allowed || allowed.has("functions")) contents.push({ kind: "category", name: t("studio.toolbox.functions"), custom: "PROCEDURE", categorystyle: "procedure_category" });
  if (modules.length) contents.push(category(t("studio.toolbox.modules"), "procedure_category", modules.map((type) => block(type)), "modules"));
  contents.push({ kind: "sep" });
  for (const group of table.groups) {
    const left = shown(group.id).filter(may);
    if (left.length) contents.push(category(capital(words(group)), group.colour, left, `group-${group.id}`));
  }
  return { kind: "categoryToolbox", contents };
}

/** Blocks that have the words, and how many there are. */
export function sought() { return find(wanted.text, Object.values(languageCategories()).flatMap(([, blocks]) => blocks), offered.modules, offered.may); }
export const found = () => sought().contents;

/** Have both languages' words; `then` once they are there. @param {() => void} then */
export const readyToSearch = (then) => prepare(then);

/** Note that a block was taken. @param {string} type */
export function noteUse(type) {
  const types = [type, ...recent.value.split("|").filter((other) => other && other !== type)];
  recent.value = types.slice(0, RECENT_MAX).join("|");
}

export function recentBlocks() {
  const all = Object.values(languageCategories()).flatMap(([, blocks]) => blocks);
  const found = recent.value.split("|").map((type) => {
    const f = table.functions.find((f) => formsOf(f).some((value) => typeOf(f, value) === type));
    return f ? stateOf(f, type.startsWith("value ")) : all.find((item) => item.type === type);
  }).filter(Boolean);
  return found.length ? found : [{ kind: "label", text: t("studio.recent.none") }];
}

/** The looks: dark enough for white words; and one with the strongest contrast. @param {string} look */
export function theme(look) {
  const strong = look === "contrast";
  const colours = strong
    ? { logic: "#003a70", loop: "#00501e", math: "#1c2f8f", text: "#5b0050", list: "#5a1a8a", variable: "#7a1f00", procedure: "#6a0038", found: "#222222" }
    : { logic: "#2a6fb0", loop: "#2f7d4f", math: "#4457b8", text: "#8a4a9e", list: "#70519e", variable: "#a3531f", procedure: "#a33b5e", found: "#4f5b6b" };
  const blockStyles = {}, categoryStyles = {};
  for (const [name, colour] of Object.entries(colours)) {
    blockStyles[`${name}_blocks`] = { colourPrimary: colour, colourSecondary: mix(colour, 0.55), colourTertiary: strong ? "#ffffff" : mix(colour, -0.25), hat: "" };
    categoryStyles[`${name}_category`] = { colour };
  }
  blockStyles.variable_dynamic_blocks = blockStyles.variable_blocks;
  categoryStyles.variable_dynamic_category = categoryStyles.variable_category;
  const dark = document.documentElement.dataset.theme === "dark" && look !== "dyslexia";
  return Blockly.Theme.defineTheme(`studio-${look}-${dark}`, {
    name: `studio-${look}-${dark}`, base: Blockly.Themes.Zelos, blockStyles, categoryStyles,
    fontStyle: look === "dyslexia" ? { family: '"OpenDyslexic", "Comic Neue", "Comic Sans MS", Verdana, sans-serif', size: 13, weight: "600" } : { family: 'system-ui, "Segoe UI", Roboto, "Noto Sans", "Noto Sans CJK SC", "PingFang SC", "Microsoft YaHei", sans-serif', size: 11.5, weight: "600" },
    componentStyles: dark
      ? { workspaceBackgroundColour: "#10161f", toolboxBackgroundColour: "#161c25", toolboxForegroundColour: "#e7edf4", flyoutBackgroundColour: "#1f2835", flyoutForegroundColour: "#e7edf4", flyoutOpacity: 0.97, scrollbarColour: "#6b7c93", insertionMarkerColour: "#ffffff" }
      : { workspaceBackgroundColour: look === "dyslexia" ? "#fbf3df" : "#f7f9fc", toolboxBackgroundColour: look === "dyslexia" ? "#f3e8cc" : "#ffffff", toolboxForegroundColour: "#142131", flyoutBackgroundColour: look === "dyslexia" ? "#efe2c0" : "#e8edf3", flyoutForegroundColour: "#142131", flyoutOpacity: 0.97, scrollbarColour: "#6b7c93", insertionMarkerColour: "#000000" },
  });
}

/** Lighter (above 0) or darker. @param {string} colour @param {number} by */
function mix(colour, by) {
  const to = by > 0 ? 255 : 0, share = Math.abs(by);
  return `#${[1, 3, 5].map((i) => Math.round(parseInt(colour.slice(i, i + 2), 16) * (1 - share) + to * share).toString(16).padStart(2, "0")).join("")}`;
}
