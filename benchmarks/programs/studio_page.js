// What benchmarks/programs/studio.py has the page do and measure.
window.bench = (() => {
  const many = (count) => {
    let block = null;
    for (let i = 0; i < count; i++) {
      const inputs = { TEXT: { shadow: { type: "text", fields: { TEXT: `${i}` } } } };
      block = { type: "text_print", inputs, ...(block ? { next: { block } } : {}) };
    }
    return { blocks: { languageVersion: 0, blocks: [{ x: 20, y: 20, ...block }] } };
  };
  return {
    load(count) {
      const state = many(count), began = performance.now();
      studio.editor.load(state);
      return performance.now() - began;
    },
    async alone(count) {
      const B = await import("/studio/vendor/blockly.mjs"), place = document.createElement("div");
      place.style.cssText = "position: fixed; inset: 0";
      document.body.append(place);
      const workspace = B.inject(place, { renderer: "zelos", sounds: false, media: "/studio/vendor/media/" });
      const state = many(count), began = performance.now();
      B.serialization.workspaces.load(state, workspace);
      const took = performance.now() - began;
      workspace.dispose();
      place.remove();
      return took;
    },
    frames: () => new Promise((done) => {
      const at = [];
      const tick = (now) => {
        at.push(now);
        if (at.length < 90) requestAnimationFrame(tick); else done(at.slice(1).map((t, i) => t - at[i]));
      };
      requestAnimationFrame(tick);
    }),
    corner() {
      const block = studio.editor.workspace.getTopBlocks()[0];
      studio.editor.workspace.centerOnBlock(block.id);
      const box = block.getSvgRoot().querySelector(".blocklyPath").getBoundingClientRect();
      return [box.x + 8, box.y + 8];
    },
    loop() {
      const wait = { type: "wait", inputs: { SECONDS: { shadow: { type: "math_number", fields: { NUM: 0.2 } } } } };
      const twice = { ...wait, next: { block: wait } }; // so that the light moves
      studio.runner.lights.count = 0;
      studio.editor.load({ blocks: { languageVersion: 0, blocks: [{ type: "forever", x: 20, y: 20, inputs: { DO: { block: twice } } }] } });
    },
    choose(name) {
      const list = document.querySelector("header .robot select");
      list.value = name;
      list.dispatchEvent(new Event("change", { bubbles: true }));
    },
    seen: [],
    watch() {
      new MutationObserver((news) => {
        for (const { target } of news) if (target.classList.contains("lit") && target.dataset.id !== this.last) bench.seen.push([this.last = target.dataset.id, performance.timeOrigin + performance.now()]);
        if (!document.querySelector(".lit")) this.last = "";
      }).observe(document.querySelector(".blocklySvg"), { subtree: true, attributes: true, attributeFilter: ["class"] });
    },
    async stop() {
      const began = performance.now();
      studio.runner.stop();
      while (studio.runner.phase.value !== "idle") await new Promise((go) => setTimeout(go, 1));
      return performance.now() - began;
    },
  };
})();
