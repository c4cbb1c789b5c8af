// What a page hands to the person at it: files to save, text to paste elsewhere.
import { t } from "./base.js";

const SAVED_WITHIN = 60_000; // ms: Safari asks first, and then reads what is saved

/** Have the browser save a file. @param {Blob} content @param {string} name */
export function saveAs(content, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(content), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), SAVED_WITHIN);
}

/** Copy a text that may still be on its way: Safari lets a page copy in the moment of the click only. Where the browser does
 * not, it is shown to be copied by hand. @param {string | Promise<string | null>} wish null: there is none @returns {Promise<boolean>} whether it was copied */
export async function copied(wish) {
  const words = Promise.resolve(wish), made = words.then((text) => new Blob([text ?? ""], { type: "text/plain" }));
  const done = navigator.clipboard?.write && window.ClipboardItem ? navigator.clipboard.write([new ClipboardItem({ "text/plain": made })]).then(() => true, () => false) : false;
  const text = await words;
  if (text === null) return false;
  if (await done || copiedByCommand(text)) return true;
  prompt(t("copy.by.hand"), text); // its line breaks are lost
  return false;
}

/** Copy as browsers did before there was a clipboard for pages; they still do without https. @param {string} text */
function copiedByCommand(text) {
  const held = /** @type {HTMLElement | null} */ (document.activeElement);
  const area = Object.assign(document.createElement("textarea"), { value: text, className: "unseen", readOnly: true });
  document.body.append(area);
  area.select();
  const done = document.execCommand("copy");
  area.remove();
  held?.focus({ preventScroll: true });
  return done;
}
