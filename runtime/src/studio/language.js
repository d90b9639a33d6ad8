// Colours of a program, by the grammar of the editors (`editors/vscode/syntaxes`): its patterns, tried at each place in their order.
// Only what that grammar uses is here: `match`, `captures`, `include`, lists of patterns; no patterns over several lines.

/** What a scope's first words mean to the editor, the longest that fits. */
const SCOPES = {
  "comment": "comment", "string": "string", "constant.numeric": "number", "keyword.other.unit": "unit", "constant.other": "number",
  "constant.language": "keyword", "keyword.operator": "operator", "keyword": "keyword", "entity.name.type": "typeName",
  "support.type": "typeName", "entity.name.function": "function", "support.function": "function", "support.constant": "number",
};

/** The kind of a scope. */
function kindOf(scope = "") {
  const found = Object.keys(SCOPES).filter((start) => scope.startsWith(start));
  return SCOPES[found.sort((a, b) => b.length - a.length)[0]] ?? null;
}

/** All patterns of a grammar in their order: { regexp, kind, kinds of captures }. */
function patternsOf(grammar, of = grammar) {
  if (of.include) return patternsOf(grammar, grammar.repository[of.include.slice(1)]);
  if (!of.match) return (of.patterns ?? []).flatMap((pattern) => patternsOf(grammar, pattern));
  const captures = Object.entries(of.captures ?? {}).map(([number, { name }]) => [Number(number), kindOf(name)]);
  return [{ regexp: new RegExp(of.match, "dy"), kind: kindOf(of.name), captures }];
}

/** The pieces of a match, from one place to the next: [end, kind]. */
function piecesOf(found, { kind, captures }) {
  const [start, end] = found.indices[0];
  const pieces = [];
  let at = start;
  for (const [number, own] of captures) {
    if (!found.indices[number]) continue;
    const [from, to] = found.indices[number];
    if (from > at) pieces.push([from, kind]);
    pieces.push([to, own]);
    at = to;
  }
  if (end > at) pieces.push([end, kind]);
  return pieces;
}

/** A tokenizer of lines for the editor. */
function tokenizer(grammar) {
  const patterns = patternsOf(grammar);
  const token = (stream, state) => {
    if (stream.sol()) state.pieces = [];
    for (const pattern of state.pieces.length > 0 ? [] : patterns) {
      pattern.regexp.lastIndex = stream.pos;
      const found = pattern.regexp.exec(stream.string);
      if (!found || found[0] === "") continue;
      state.pieces = piecesOf(found, pattern);
      break;
    }
    if (state.pieces.length === 0) {
      // A word that no pattern begins is passed whole: none begins in the middle of it.
      if (!stream.match(/^(\s+|[A-Za-z0-9_]+)/)) stream.next();
      return null;
    }
    const [end, kind] = state.pieces.shift();
    stream.pos = end;
    return kind;
  };
  const copyState = ({ pieces }) => ({ pieces: [...pieces] });
  return { name: "whip", startState: () => ({ pieces: [] }), copyState, token };
}
