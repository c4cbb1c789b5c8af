// Run in the studio's page: blocks loaded together, and the same loaded by Blockly alone: what is unlike in the drawings.
async () => {
  const B = await import("/studio/vendor/blockly.mjs");
  const { table, formsOf, stateOf } = await import("/studio/blocks.js");
  const { languageCategories } = await import("/studio/toolbox.js");
  const { inject, name, together } = await import("/studio/speed.js");
  const APART = 600; // px from block to block, more than the tallest is high: Blockly moves those that lie close apart, by a random bit
  const LOOKS = ["fill", "stroke", "fill-opacity", "d", "transform", "style", "width", "height", "x", "y", "href", "role", "aria-label"];

  /** A workspace of its own (no checker puts warnings there; it scrolls, else all blocks are moved into view): how often each element is in it, and where connections are found. */
  async function drawn(load) {
    const place = document.createElement("div");
    place.style.cssText = "position: fixed; inset: 0";
    document.body.append(place);
    const workspace = inject(place, { renderer: "zelos", sounds: false, comments: true, move: { drag: true, scrollbars: true }, media: "/studio/vendor/media/" }), rows = new Map();
    load(workspace);
    await new Promise((go) => setTimeout(go, 1)); // connections can be found after 1 ms, block by block (a delay of 0 ms could overtake)
    for (let turn = 0; turn < 3; turn += 1) { // events are sent after a frame, and may cause others
      await new Promise((go) => requestAnimationFrame(() => setTimeout(go, 1)));
      await B.renderManagement.finishQueuedRenders();
    }
    const moved = workspace.getTopBlocks(true).filter((block, i) => block.getRelativeToSurfaceXY().y !== 20 + APART * i).map((block) => block.type);
    name();
    for (const block of workspace.getAllBlocks()) block.recomputeAriaContext(); // Blockly names some before what is in them is there
    for (const element of workspace.getCanvas().querySelectorAll("*")) {
      const said = element.children.length ? "" : element.textContent, looks = LOOKS.map((look) => `${look}=${element.getAttribute(look) ?? ""}`);
      const row = [element.tagName, [...element.classList].sort().join(" "), said, ...looks].join("|").replaceAll(/url\(#[^)]*\)/g, "url");
      rows.set(row, (rows.get(row) ?? 0) + 1);
    }
    const found = Array.from(workspace.connectionDBList, (all) => (all?.connections ?? []).map(({ x, y }) => `${x} ${y}`).sort().join());
    workspace.dispose();
    place.remove();
    return { rows, found, moved };
  }

  const top = [...table.functions.flatMap((f) => formsOf(f).map((value) => stateOf(f, value))), ...Object.values(languageCategories()).flatMap(([, blocks]) => blocks)];
  const text = { block: { type: "text_join", extraState: { itemCount: 2 }, inputs: { ADD0: { shadow: { type: "text", fields: { TEXT: "a" } } } } } };
  const inside = { type: "text_print", inputs: { TEXT: text }, next: { block: { type: "text_print", enabled: false, inputs: { TEXT: text } } } };
  const odd = [{ disabledReasons: ["MANUALLY_DISABLED"] }, { collapsed: true }, { icons: { comment: { text: "a", pinned: false, height: 80, width: 160 } } }, { inline: false }]
    .map((how) => ({ type: "controls_repeat_ext", ...how, inputs: { TIMES: { block: { type: "math_number", fields: { NUM: 2 } } }, DO: { block: inside } }, next: { block: inside } }));
  const blocks = [...top, ...odd].map(({ kind, ...state }, i) => ({ ...state, x: 20, y: 20 + APART * i }));
  const load = B.serialization.workspaces.load;
  async function compared(blocks) {
    const state = { blocks: { languageVersion: 0, blocks } };
    const ours = await drawn((workspace) => together(workspace, () => load(state, workspace)));
    const plain = await drawn((workspace) => load(state, workspace));
    const unlike = [...new Set([...ours.rows.keys(), ...plain.rows.keys()])].filter((row) => ours.rows.get(row) !== plain.rows.get(row));
    return { elements: ours.rows.size, unlike: unlike.slice(0, 5), moved: [...ours.moved, ...plain.moved], connected: ours.found.map((all, i) => all === plain.found[i]) };
  }
  // Alone, so that no other block has had the texts measured before.
  const alone = await compared([{ type: "controls_whileUntil", x: 20, y: 20, inputs: { BOOL: { shadow: { type: "logic_boolean", fields: { BOOL: "TRUE" } } } } }]);
  const all = await compared(blocks);
  return { ...all, unlike: [...alone.unlike, ...all.unlike] };
}
