//! This module finds the place of a key in the text of a scene.

use std::ops::Range;
use toml_edit::{Document, Item};

/// Byte range of the value of a key such as `accuracy.cells` or `gauges[1].material`. If the scene
/// does not contain it, the range is that of the innermost table that it does contain, or else of
/// `[domain]`; `None` if there is none.
pub fn span_of(text: &str, key: &str) -> Option<Range<usize>> {
    let document = Document::parse(text).ok()?;
    let domain = || {
        let item = document.get("domain")?;
        item.span().or_else(|| first_span(item))
    };
    let mut item = document.as_item();
    let mut last = None;
    for part in key.split('.') {
        let (name, index) = match part.split_once('[') {
            Some((name, rest)) => (name, rest.trim_end_matches(']').parse::<usize>().ok()),
            None => (part, None),
        };
        let Some(inner) = item.get(name) else { break };
        item = inner;
        last = item.span().or_else(|| first_span(item)).or(last);
        if let Some(index) = index {
            let Some(entry) = item.get(index) else { break };
            item = entry;
            last = item.span().or(last);
        }
    }
    last.or_else(domain)
}

/// Range of the first value in a table that has no header of its own.
fn first_span(item: &Item) -> Option<Range<usize>> {
    item.as_table_like()?.iter().find_map(|(_, inner)| inner.span().or_else(|| first_span(inner)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_tables_lists_and_dotted_keys() {
        let text = "name = \"x\"\naccuracy.cells = 4\n[time]\nend = 1\n[[gauges]]\nname = \"a\"\n\
                    [[gauges]]\nname = \"b\"\n[boundaries]\nleft = { kind = \"open\" }\n";
        for (key, found) in [
            ("name", "\"x\""),
            ("accuracy.cells", "4"),
            ("time.end", "1"),
            ("time.courant", "[time]"),
            ("gauges[1].name", "\"b\""),
            ("boundaries.left.kind", "\"open\""),
            ("accuracy.tolerance", "accuracy"),
        ] {
            let span = span_of(text, key).expect(key);
            assert_eq!(&text[span], found, "{key}");
        }
        assert_eq!(span_of(text, "dye.lines"), None);
        assert_eq!(span_of("[domain]\nx = 1\n", "dye.lines"), Some(0..8));
    }
}
