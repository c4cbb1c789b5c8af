// Views whose files are loaded when they are shown first.
import { useEffect, useState } from "preact/hooks";
import { html } from "../base.js";

/** @param {() => Promise<any>} load what resolves to the view */
export function later(load) {
  let view = null;
  return function Later() {
    const [, shown] = useState(false);
    useEffect(() => { if (!view) load().then((loaded) => { view = loaded; shown(true); }); }, []);
    return view ? html`<${view} />` : null;
  };
}
