// What the studio takes of Blockly.
export * from "blockly/core";
import "blockly/blocks";
export { pythonGenerator, Order } from "blockly/python";
import * as en from "blockly/msg/en";
import * as zh from "blockly/msg/zh-hans";
export const messages = { en: { ...en }, zh: { ...zh } };
