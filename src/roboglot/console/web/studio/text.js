// Python as text: CodeMirror with completion, signatures, the checker's messages, breakpoints; loaded when it is needed.
import { language, say, t } from "../base.js";
import { table, words } from "./blocks.js";
import { body, changed } from "./program.js";
import { line, phase, problems, textBreaks } from "./runner.js";

let turnBack = (/** @type {boolean} */ _redo) => {};
/** Undo, or redo, in the text that is shown. @param {boolean} redo */
export const undo = (redo) => turnBack(redo);

/** Make the editor in `element`. @param {HTMLElement} element @returns {Promise<{destroy: () => void, set: (text: string) => void, refresh: () => void}>} */
export async function makeText(element) {
  const cm = await import("codemirror");
  const { Decoration, EditorState, EditorView, GutterMarker, StateEffect, StateField, RangeSet } = cm;
  class Dot extends GutterMarker { toDOM() { const dot = document.createElement("span"); dot.className = "dot"; return dot; } }
  const dot = new Dot(), show = StateEffect.define(), judged = StateEffect.define();
  const here = StateField.define({
    create: () => Decoration.none,
    update: (found, change) => {
      for (const effect of change.effects) if (effect.is(show)) return effect.value > 0 && effect.value <= change.state.doc.lines ? Decoration.set([Decoration.line({ class: "here" }).range(change.state.doc.line(effect.value).from)]) : Decoration.none;
      return found.map(change.changes);
    },
    provide: (field) => EditorView.decorations.from(field),
  });
  const gutter = cm.gutter({
    class: "breakpoints",
    markers: (view) => RangeSet.of(textBreaks.value.filter((n) => n <= view.state.doc.lines).map((n) => dot.range(view.state.doc.line(n).from))),
    initialSpacer: () => dot,
    domEventHandlers: { mousedown: (view, place) => { toggle(view.state.doc.lineAt(place.from).number); return true; } },
  });
  const toggle = (number) => {
    textBreaks.value = textBreaks.value.includes(number) ? textBreaks.value.filter((n) => n !== number) : [...textBreaks.value, number].sort((a, b) => a - b);
    view.dispatch({ effects: show.of(line.value) });
    const row = view.state.doc.line(number).text.trim().slice(0, 60);
    say(t(textBreaks.value.includes(number) ? "studio.break.set" : "studio.break.gone", { what: `${number} ${row}`.trim() }));
  };
  const messages = cm.linter((view) => problems.value.filter((p) => p.line >= 1 && p.line <= view.state.doc.lines).map((p) => {
    const row = view.state.doc.line(p.line), from = Math.min(row.to, row.from + Math.max(0, p.column - 1));
    const word = /^[\w.]+/.exec(row.text.slice(from - row.from))?.[0].length ?? 1;
    return { from, to: Math.min(row.to, from + word), severity: "error", message: words(p) };
  }), { delay: 0, needsRefresh: (update) => update.transactions.some((one) => one.effects.some((effect) => effect.is(judged))) });
  let setting = false;
  const view = new EditorView({
    parent: element,
    state: EditorState.create({
      doc: body.value,
      extensions: [
        cm.lineNumbers(), gutter, here, cm.history(), cm.drawSelection(), cm.indentOnInput(), cm.indentUnit.of("    "), cm.bracketMatching(), cm.closeBrackets(),
        cm.highlightActiveLine(), cm.highlightSelectionMatches(), cm.python(), cm.syntaxHighlighting(colours(cm)), cm.lintGutter(), messages,
        cm.autocompletion({ override: [complete] }), signatures(cm), EditorView.lineWrapping,
        EditorView.contentAttributes.of({ "aria-label": "Python", spellcheck: "false" }),
        cm.keymap.of([{ key: "F9", run: (v) => { toggle(v.state.doc.lineAt(v.state.selection.main.head).number); return true; } },
          ...cm.closeBracketsKeymap, ...cm.defaultKeymap, ...cm.searchKeymap, ...cm.historyKeymap, ...cm.completionKeymap, ...cm.lintKeymap, cm.indentWithTab]),
        EditorView.updateListener.of((update) => {
          if (!update.docChanged || setting) return;
          textBreaks.value = moved(update);
          body.value = update.state.doc.toString();
          changed();
        }),
      ],
    }),
  });
  turnBack = (redo) => { cm.historyKeymap.find((/** @type {any} */ one) => one.key === (redo ? "Mod-y" : "Mod-z")).run(view); };
  let looked = 0, known = /** @type {any[]} */ ([]);
  /** What the checker found, once: a message that is replaced all the time cannot be read. */
  const verdict = () => {
    const same = known[0] === problems.value && known[1] === language.value;
    known = [problems.value, language.value];
    return same ? [] : [judged.of(null)];
  };
  /** A line at which it is held comes into view, once. */
  const shown = () => {
    const at = phase.value === "paused" ? line.value : 0, comes = at !== looked && at > 0 && at <= view.state.doc.lines;
    looked = at;
    return comes ? [EditorView.scrollIntoView(view.state.doc.line(at).from, { y: "nearest", yMargin: 40 })] : [];
  };
  return {
    destroy: () => view.destroy(),
    set: (text) => { if (text === view.state.doc.toString()) return; setting = true; view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: text } }); setting = false; },
    refresh: () => { view.dispatch({ effects: [show.of(line.value), ...shown(), ...verdict()] }); },
  };
}

/** Breakpoints stay at their lines when others come or go above them. */
function moved(update) {
  return [...new Set(textBreaks.value.filter((n) => n <= update.startState.doc.lines).map((n) => update.state.doc.lineAt(update.changes.mapPos(update.startState.doc.line(n).from)).number))];
}

function colours({ HighlightStyle, tags }) {
  return HighlightStyle.define([
    { tag: [tags.keyword, tags.controlKeyword, tags.definitionKeyword, tags.operatorKeyword], class: "tok-keyword" }, { tag: tags.string, class: "tok-string" },
    { tag: [tags.number, tags.bool, tags.null], class: "tok-number" }, { tag: tags.comment, class: "tok-comment" }, { tag: tags.function(tags.variableName), class: "tok-function" },
  ]);
}

const signature = (f) => (f.attribute ? "" : `(${f.parameters.map((p) => `${p.name}${p.default === null || p.default === undefined ? "" : `=${p.default}`}`).join(", ")})`);

/** Names of the robot after a point, all names else. */
function complete(context) {
  const chain = context.matchBefore(/[A-Za-z_][\w.]*/);
  if (!chain && !context.explicit) return null;
  const text = chain?.text ?? "", owner = text.slice(0, text.lastIndexOf(".") + 1), from = (chain?.from ?? context.pos) + owner.length;
  if (!owner) {
    const roots = ["cyberdog", "choreographer", "dancer", "time", ...Object.keys(table.enums), ...table.builtins, ...table.modules, "def", "while", "for", "if", "elif", "else", "return", "import", "break", "continue", "True", "False", "None"];
    return { from, options: [...new Set(roots)].map((label) => ({ label, type: "keyword" })) };
  }
  const members = table.enums[owner.slice(0, -1)];
  if (members) return { from, options: Object.keys(members).map((label) => ({ label, type: "enum" })) };
  if (owner === "time.") return { from, options: ["sleep", "time", "monotonic", "localtime", "strftime"].map((label) => ({ label, type: "function", apply: `${label}(` })) };
  const found = new Map();
  for (const f of table.functions.filter((f) => f.key.startsWith(owner))) {
    const [part, ...rest] = f.key.slice(owner.length).split(".");
    if (rest.length) found.set(part, found.get(part) ?? { label: part, type: "namespace" });
    else found.set(part, { label: part, type: f.attribute ? "property" : "function", detail: signature(f), info: `${words(f)}: ${words(f.about)}`, apply: f.attribute ? part : `${part}(` });
  }
  return found.size ? { from, options: [...found.values()] } : null;
}

/** What a function wants, while its brackets are filled in. */
function signatures({ StateField, showTooltip }) {
  const find = (state) => {
    const { head } = state.selection.main, row = state.doc.lineAt(head), before = row.text.slice(0, head - row.from);
    const call = /([A-Za-z_][\w.]*)\(([^()]*)$/.exec(before), f = call && table.functions.find((f) => f.key === call[1]);
    if (!f || !f.parameters.length) return [];
    const at = call[2].split(",").length - 1;
    return [{ pos: head, above: true, create: () => {
      const dom = document.createElement("div");
      dom.className = "signature";
      f.parameters.forEach((p, i) => { const part = document.createElement(i === at ? "b" : "span"); part.textContent = `${p.name} (${words(p)}${p.unit ? `, ${p.unit}` : ""}${p.minimum !== undefined ? `, ${p.minimum} … ${p.maximum}` : ""})`; dom.append(part, i < f.parameters.length - 1 ? ", " : ""); });
      dom.lang = language.value;
      return { dom };
    } }];
  };
  return StateField.define({
    create: find, update: (found, change) => (change.docChanged || change.selection ? find(change.state) : found), provide: (field) => showTooltip.computeN([field], (state) => state.field(field)),
  });
}
