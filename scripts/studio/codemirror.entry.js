// What the studio takes of CodeMirror.
export { EditorState, StateEffect, StateField, Compartment, RangeSet } from "@codemirror/state";
export { EditorView, Decoration, GutterMarker, gutter, keymap, lineNumbers, highlightActiveLine, hoverTooltip, showTooltip, drawSelection } from "@codemirror/view";
export { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
export { autocompletion, completionKeymap, closeBrackets, closeBracketsKeymap } from "@codemirror/autocomplete";
export { bracketMatching, indentOnInput, indentUnit, syntaxHighlighting, HighlightStyle } from "@codemirror/language";
export { linter, lintGutter, lintKeymap, setDiagnostics } from "@codemirror/lint";
export { searchKeymap, highlightSelectionMatches } from "@codemirror/search";
export { python } from "@codemirror/lang-python";
export { tags } from "@lezer/highlight";
