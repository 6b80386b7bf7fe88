// The text editor of scenes: CodeMirror 6 with the parts that scenes need.
import { autocompletion, completionKeymap, closeBrackets, closeBracketsKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
import { HighlightStyle, StreamLanguage, bracketMatching, syntaxHighlighting } from "@codemirror/language";
import { toml } from "@codemirror/legacy-modes/mode/toml";
import { lintGutter, setDiagnostics } from "@codemirror/lint";
import { highlightSelectionMatches, searchKeymap } from "@codemirror/search";
import { EditorState } from "@codemirror/state";
import { EditorView, highlightActiveLine, hoverTooltip, keymap, lineNumbers } from "@codemirror/view";
import { tags } from "@lezer/highlight";

const colours = HighlightStyle.define([
  { tag: tags.comment, color: "var(--soft)", fontStyle: "italic" },
  { tag: [tags.string, tags.special(tags.string)], color: "var(--good)" },
  { tag: [tags.number, tags.bool, tags.atom], color: "var(--warn)" },
  { tag: [tags.propertyName, tags.heading], color: "var(--accent)" },
]);

const look = EditorView.theme({
  "&": { height: "100%", fontSize: "12.5px", backgroundColor: "var(--field)", color: "var(--ink)" },
  ".cm-scroller": { fontFamily: 'ui-monospace, "DejaVu Sans Mono", monospace', lineHeight: "1.45" },
  ".cm-content": { caretColor: "var(--ink)" },
  "&.cm-focused .cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": { backgroundColor: "var(--ground)", color: "var(--soft)", border: "0" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "color-mix(in srgb, var(--accent) 9%, transparent)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { backgroundColor: "color-mix(in srgb, var(--accent) 28%, transparent)" },
  ".cm-tooltip": { backgroundColor: "var(--card)", color: "var(--ink)", border: "1px solid var(--line)", borderRadius: "6px" },
  ".cm-tooltip-autocomplete > ul > li[aria-selected]": { backgroundColor: "var(--accent)", color: "var(--accent-ink)" },
  ".cm-help": { padding: "6px 10px", maxWidth: "420px" },
  ".cm-panels": { backgroundColor: "var(--card)", color: "var(--ink)" },
});

// Makes an editor. `changed` is called after each change of the text by the user; `entries(path)`
// gives the keys that a table takes: [{label, detail, info}]; `path` are the names of the table.
export function createEditor({ parent, text, changed, entries, save }) {
  const complete = (context) => {
    const line = context.state.doc.lineAt(context.pos);
    const before = line.text.slice(0, context.pos - line.from);
    const found = before.match(/^\s*([A-Za-z_][\w.-]*)?$/);
    if (!found || (!found[1] && !context.explicit)) return null;
    const word = found[1] || "";
    const dot = word.lastIndexOf(".") + 1;
    const path = [...tableAt(context.state, line.number), ...word.slice(0, dot).split(".").filter(Boolean)];
    return { from: context.pos - word.length + dot, options: entries(path).map((entry) => ({ type: "property", ...entry })), validFor: /^[\w-]*$/ };
  };
  const help = hoverTooltip((view, pos) => {
    const line = view.state.doc.lineAt(pos);
    const key = line.text.match(/^\s*([A-Za-z_][\w.-]*)\s*=/);
    const end = key && line.from + key[0].length - 1;
    if (!key || pos > end) return null;
    const names = [...tableAt(view.state, line.number), ...key[1].split(".")];
    const entry = entries(names.slice(0, -1)).find((e) => e.label === names.at(-1));
    if (!entry || !entry.info) return null;
    const create = () => {
      const dom = document.createElement("div");
      dom.className = "cm-help";
      dom.textContent = entry.detail ? `${entry.detail}: ${entry.info}` : entry.info;
      return { dom };
    };
    return { pos: line.from, end, above: true, create };
  });
  let quiet = false;
  const view = new EditorView({
    parent,
    state: EditorState.create({
      doc: text,
      extensions: [
        lineNumbers(), history(), bracketMatching(), closeBrackets(), highlightActiveLine(), highlightSelectionMatches(),
        StreamLanguage.define(toml), syntaxHighlighting(colours), look, lintGutter(), help,
        autocompletion({ override: [complete] }),
        keymap.of([{ key: "Mod-s", run: () => { save(); return true; } }, ...closeBracketsKeymap, ...completionKeymap, ...searchKeymap, ...historyKeymap, ...defaultKeymap, indentWithTab]),
        EditorView.contentAttributes.of({ "aria-label": "Text of the scene (Escape, then Tab leaves it)" }),
        EditorView.updateListener.of((update) => { if (update.docChanged && !quiet) changed(); }),
      ],
    }),
  });
  // Reached by keyboard, so that long lines can be scrolled.
  view.scrollDOM.tabIndex = 0;
  const at = (line) => view.state.doc.line(Math.min(Math.max(line, 1), view.state.doc.lines));
  return {
    text: () => view.state.doc.toString(),
    // Replaces what differs, so that cursor and history stay. `loud`: as if the user had typed it.
    setText(wanted, loud = false) {
      const now = view.state.doc.toString();
      if (now === wanted) return;
      let [start, end] = [0, 0];
      while (start < Math.min(now.length, wanted.length) && now[start] === wanted[start]) start++;
      while (end < Math.min(now.length, wanted.length) - start && now[now.length - 1 - end] === wanted[wanted.length - 1 - end]) end++;
      quiet = !loud;
      view.dispatch({ changes: { from: start, to: now.length - end, insert: wanted.slice(start, wanted.length - end) } });
      quiet = false;
    },
    // Underlines faults: {line (from 1), column, length, message, severity}.
    setFaults(faults) {
      const diagnostics = faults.map(({ line, column, length, message, severity }) => {
        const place = at(line || 1);
        const from = Math.min(place.from + (column || 0), place.to);
        const to = length ? Math.min(from + length, place.to) : place.to;
        return { from, to: Math.max(to, from), message, severity: severity || "error" };
      });
      view.dispatch(setDiagnostics(view.state, diagnostics));
    },
    goTo(line) { view.dispatch({ selection: { anchor: at(line).from }, scrollIntoView: true }); view.focus(); },
    focus: () => view.focus(),
  };
}

// The names of the table in which a line is.
function tableAt(state, number) {
  for (let n = number - 1; n >= 1; n--) {
    const found = state.doc.line(n).text.match(/^\s*\[\[?\s*([^\]]+?)\s*\]\]?/);
    if (found) return found[1].split(".").map((part) => part.trim().replace(/^"|"$/g, ""));
  }
  return [];
}
