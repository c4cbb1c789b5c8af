// Run in the studio's page: a program for every block, with values of its own, and what each call must be.
async () => {
  const B = await import("/studio/vendor/blockly.mjs");
  const { table, formsOf, stateOf, pythonOf } = await import("/studio/blocks.js");
  const { languageCategories } = await import("/studio/toolbox.js");
  const { save, load } = studio.editor;
  const text = `it's "a\\b" 中 {0}`;

  function valueOf(p) {
    switch (p.kind) {
      case "choice": { const name = p.choices[p.choices.length - 1]; return [name, p.enum ? table.enums[p.enum][name] : Number(name)]; }
      case "float": case "int": {
        const low = p.minimum ?? -7, high = p.maximum ?? 7, between = low + (high - low) * 0.37;
        const number = p.kind === "int" ? Math.round(between) : Math.round(between * 1000) / 1000;
        return [number, number];
      }
      case "str": return [text, text];
      case "bool": return [p.default ? "FALSE" : "TRUE", !p.default];
      case "list": return [null, [text, "b"]];
      default: return [null, "MotionSequence"];
    }
  }

  function filled(f, value) {
    const state = stateOf(f, value), expected = {};
    for (const p of f.parameters) {
      const [field, wanted] = valueOf(p), input = state.inputs[p.name];
      expected[p.name] = wanted;
      if (p.kind === "list") input.block = { type: "lists_create_with", extraState: { itemCount: 2 }, inputs: { ADD0: { block: { type: "text", fields: { TEXT: text } } }, ADD1: { block: { type: "text", fields: { TEXT: "b" } } } } };
      else if (!input) state.inputs[p.name] = { block: { type: "type_made", fields: { KIND: "MotionSequence" } } };
      else input.shadow.fields = { [Object.keys(input.shadow.fields)[0]]: field };
    }
    return [state, expected];
  }

  const asStatement = (state, value) => (value ? { type: "variables_set", fields: { VAR: { name: "x" } }, inputs: { VALUE: { block: state } } } : state);
  const chain = (states) => { let next; for (const state of [...states].reverse()) { const made = { ...state }; if (next) made.next = { block: next }; next = made; } return next; };
  const open = (top) => { load({ blocks: { languageVersion: 0, blocks: [{ x: 20, y: 20, ...top }] } }); return pythonOf(studio.editor.workspace); };

  const calls = [], states = [];
  for (const f of table.functions) {
    for (const value of formsOf(f)) {
      const [state, expected] = filled(f, value);
      calls.push([f.key, expected]);
      states.push(asStatement(state, value));
    }
  }
  const code = open(chain(states)), kept = save();
  load(kept);
  const again = pythonOf(studio.editor.workspace);

  const language = [];
  for (const [, blocks] of Object.values(languageCategories())) {
    for (const item of blocks) {
      const { kind, ...state } = item;
      const probe = B.serialization.blocks.append(JSON.parse(JSON.stringify(state)), studio.editor.workspace), value = Boolean(probe.outputConnection);
      probe.dispose();
      const inside = item.type === "controls_flow_statements" ? { type: "controls_repeat_ext", inputs: { TIMES: { shadow: { type: "math_number", fields: { NUM: 2 } } }, DO: { block: state } } } : state;
      language.push([item.type, open(asStatement(inside, value))]);
    }
  }
  studio.editor.clear();
  return { functions: table.functions.length, calls, code, again, language };
}
