// Orders of a delivering robot: those to come and the last that ended.
import { Button, html, robotWord, t } from "../base.js";
import { command, state } from "../link.js";

export function Orders() {
  const { list, more } = state.value.orders;
  return html`<div class="card"><h3>${t("orders")}</h3><ol class="actions">
    ${list.map((o) => html`<li key=${o.id} class=${o.doing ? "running" : ""}><b>${robotWord(o.task)}</b><span class=${`badge ${o.status.toLowerCase()}`}>${robotWord(o.status)}</span>
      <small>${[o.client || t("itself"), robotWord(o.doing)].filter(Boolean).join(" · ")}</small>${o.reason && html`<em>${robotWord(o.reason)}</em>`}
      ${o.open && html`<div class="buttons"><${Button} compact icon="stop" label=${t("cancel")} verb="cancel_order" onClick=${() => command("cancel_order", { order: o.id })} /></div>`}</li>`)}</ol>
    ${more > 0 && html`<p class="muted">+ ${more}</p>`}</div>`;
}
