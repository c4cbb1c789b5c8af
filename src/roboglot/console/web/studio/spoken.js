// What Blockly 13.3 says wrongly to screen readers, put right: blocks to take are options of a list that hold nothing
// else, and an entry of a menu is chosen by going to it, not "selected".
import * as Blockly from "blockly";

const { Flyout, MenuItem, RenderedConnection } = /** @type {any} */ (Blockly);

const { setAriaRole, recomputeAriaContext } = RenderedConnection.prototype;
RenderedConnection.prototype.setAriaRole = function (/** @type {Element} */ path) {
  if (!this.getSourceBlock().isInFlyout) { setAriaRole.call(this, path); return; }
  path.setAttribute("role", "none"); // nothing is put anywhere in there
  path.setAttribute("aria-hidden", "true");
};
RenderedConnection.prototype.recomputeAriaContext = function (/** @type {Element} */ path) {
  if (this.getSourceBlock().isInFlyout) this.setAriaRole(path); else recomputeAriaContext.call(this, path);
};

const context = Flyout.prototype.updateAriaContext;
Flyout.prototype.updateAriaContext = function () {
  context.call(this);
  for (const item of this.getContents()) {
    const element = item.getElement(), option = element.canBeFocused() && element.getFocusableElement();
    const owns = option && option.getAttribute("aria-owns")?.split(" ").filter((/** @type {string} */ id) => !id.includes("_connection_"));
    if (owns?.length) option.setAttribute("aria-owns", owns.join(" ")); else if (owns) option.removeAttribute("aria-owns");
  }
};

const made = MenuItem.prototype.createDom;
MenuItem.prototype.createDom = function () {
  const element = made.call(this);
  if (this.roleName === "menuitem") element.removeAttribute("aria-selected");
  return element;
};
