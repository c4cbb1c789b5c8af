// Views whose files are loaded when they are shown first.
import { useEffect, useState } from "preact/hooks";
import { html } from "../base.js";

const RETRY = 1000; // ms

/** @param {() => Promise<any>} load what resolves to the view */
export function later(load) {
  let view = null;
  const wait = (then) => load().then((loaded) => { view = loaded; then(); }, () => setTimeout(() => wait(then), RETRY));
  return function Later() {
    const [, shown] = useState(false);
    useEffect(() => { if (!view) wait(() => shown(true)); }, []);
    return view ? html`<${view} />` : null;
  };
}
