// The editor: CodeMirror with the colours of the language, what the compiler says at its places, and cycles behind lines.

const { EditorView, EditorState, Decoration, WidgetType, StateEffect, StateField } = CodeMirror;

/** Places of a text in bytes, as the compiler tells them, and in letters of a script (UTF-16). */
function placesOf(text) {
  const starts = new Map();
  let [bytes, letters] = [0, 0];
  for (const letter of text) {
    starts.set(bytes, letters);
    const code = letter.codePointAt(0);
    bytes += code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
    letters += letter.length;
  }
  return (byte) => starts.get(byte) ?? letters;
}

/** Cycles at the end of a line. */
class Cycles extends WidgetType {
  constructor(text) {
    super();
    this.text = text;
  }

  eq(other) {
    return other.text === this.text;
  }

  toDOM() {
    return el("span", { class: "cycles", title: "at most, on the longest path through a key" }, this.text);
  }
}

const setCycles = StateEffect.define();
const cycles = StateField.define({
  create: () => Decoration.none,
  update: (shown, change) => {
    let next = shown.map(change.changes);
    for (const effect of change.effects) if (effect.is(setCycles)) next = effect.value;
    return next;
  },
  provide: (field) => EditorView.decorations.from(field),
});

const setBoardLine = StateEffect.define();
const boardLine = StateField.define({
  create: () => Decoration.none,
  update: (shown, change) => {
    let next = shown.map(change.changes);
    for (const effect of change.effects) if (effect.is(setBoardLine)) next = effect.value;
    return next;
  },
  provide: (field) => EditorView.decorations.from(field),
});

/** Marks the line (from 1) of the instruction on the board, or none. */
function showBoardLine(view, number) {
  const { doc } = view.state;
  if (number === null || number > doc.lines) return view.dispatch({ effects: setBoardLine.of(Decoration.none) });
  const { from } = doc.line(number);
  const mark = Decoration.line({ class: "cm-board" }).range(from);
  view.dispatch({ effects: [setBoardLine.of(Decoration.set([mark])), EditorView.scrollIntoView(from, { y: "nearest" })] });
}

/** The editor's colours are the page's. */
const theme = EditorView.theme({
  "&": { fontSize: "13px", backgroundColor: "var(--raised)", color: "var(--text)", border: "1px solid var(--rule)", borderRadius: "6px" },
  "&.cm-focused": { outline: "2px solid var(--accent)" },
  ".cm-scroller": { fontFamily: "ui-monospace, monospace", lineHeight: "1.5" },
  ".cm-content": { caretColor: "var(--text)" },
  ".cm-cursor": { borderLeftColor: "var(--text)" },
  ".cm-gutters": { backgroundColor: "var(--raised)", color: "var(--soft)", border: "none" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "var(--active)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { background: "var(--selected)" },
  ".cm-tooltip, .cm-panels": { backgroundColor: "var(--back)", color: "var(--text)", border: "1px solid var(--rule)" },
  ".cm-panels input, .cm-panels button": { color: "var(--text)", background: "var(--raised)" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--back)" },
  ".cm-diagnosticAction": { backgroundColor: "var(--accent)", color: "var(--back)" },
  ".cm-matchingBracket, &.cm-focused .cm-matchingBracket": { backgroundColor: "var(--selected)" },
});
const KINDS = ["comment", "string", "number", "unit", "operator", "keyword", "typeName", "function"];
const tagOf = (kind) => ({ unit: CodeMirror.tags.unit, function: CodeMirror.tags.function(CodeMirror.tags.variableName) })[kind] ?? CodeMirror.tags[kind];
const highlight = CodeMirror.HighlightStyle.define(KINDS.map((kind) => ({ tag: tagOf(kind), color: `var(--${kind})` })));
const tokenTable = Object.fromEntries(KINDS.map((kind) => [kind, tagOf(kind)]));

/** Makes the editor in an element; `changed` hears of a new text, `complete` and `hover` ask the language server. */
function makeEditor(parent, { changed, complete, hover, grammar }) {
  const language = CodeMirror.StreamLanguage.define({ ...tokenizer(grammar), tokenTable });
  const keys = ["defaultKeymap", "historyKeymap", "lintKeymap", "completionKeymap", "closeBracketsKeymap", "searchKeymap"];
  const extensions = [
    CodeMirror.lineNumbers(), CodeMirror.history(), CodeMirror.drawSelection(), CodeMirror.highlightActiveLine(), CodeMirror.bracketMatching(),
    CodeMirror.closeBrackets(), CodeMirror.highlightSelectionMatches(), CodeMirror.indentUnit.of("    "), CodeMirror.lintGutter(),
    CodeMirror.autocompletion({ override: [complete] }), CodeMirror.hoverTooltip(hover),
    language, CodeMirror.syntaxHighlighting(highlight), cycles, boardLine, theme,
    CodeMirror.keymap.of(keys.flatMap((name) => CodeMirror[name])),
    EditorView.contentAttributes.of({ "aria-label": "The program", spellcheck: "false" }),
    EditorView.updateListener.of((update) => update.docChanged && changed()),
  ];
  const view = new EditorView({ parent, state: EditorState.create({ extensions }) });
  // What scrolls can be scrolled by the keyboard alone.
  view.scrollDOM.tabIndex = 0;
  return view;
}

const textOf = (view) => view.state.doc.toString();

/** Puts another text in place of all. */
function setText(view, text) {
  view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: text } });
}

/** Shows what the compiler said about a text, which must still be the editor's. */
function showDiagnostics(view, file, said) {
  const here = said.filter((one) => one.place.file === file);
  const place = here.length > 0 ? placesOf(textOf(view)) : null;
  const shown = here.map((one) => {
    const [from, to] = [place(one.place.start.byte), place(one.place.end.byte)];
    const actions = one.suggestions.filter((change) => change.file === file).map((change) => ({
      name: `Write ${change.replacement.trim() || "nothing"}`,
      apply: () => mend(view, file, change),
    }));
    return { from, to, severity: one.severity === "note" ? "info" : one.severity, source: one.code, message: one.message, actions };
  });
  view.dispatch(CodeMirror.setDiagnostics(view.state, shown));
}

/** Does what the compiler suggests. */
function mend(view, file, { start, end, replacement }) {
  const place = placesOf(textOf(view));
  view.dispatch({ changes: { from: place(start.byte), to: place(end.byte), insert: replacement } });
  view.focus();
}

/** Shows cycles behind lines: a map from line numbers (from 1). */
function showCycles(view, lines) {
  const { doc } = view.state;
  const marks = [...lines].filter(([line]) => line <= doc.lines).sort(([a], [b]) => a - b).map(([line, count]) =>
    Decoration.widget({ widget: new Cycles(count === 1 ? "1 cycle" : `${count} cycles`), side: 1 }).range(doc.line(line).to));
  view.dispatch({ effects: setCycles.of(Decoration.set(marks)) });
}

/** The place of a letter as the language server counts: lines from 0. */
function positionOf(state, at) {
  const line = state.doc.lineAt(at);
  return { line: line.number - 1, character: at - line.from };
}
