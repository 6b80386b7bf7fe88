//! This module writes counts and ordinals in sentences.

use std::fmt::Display;

/// A count with its noun: `1 cell`, `2 cells`.
pub fn count(n: impl Display, noun: &str) -> String {
    let n = n.to_string();
    let ending = if n == "1" { "" } else { "s" };
    format!("{n} {noun}{ending}")
}

/// An ordinal: `1st`, `2nd`, `13th`.
pub fn ordinal(n: usize) -> String {
    let ending = match (n % 10, n % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{n}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_followed_by_their_form() {
        let counts = [0, 1, 2].map(|n| count(n, "damaged row"));
        assert_eq!(counts, ["0 damaged rows", "1 damaged row", "2 damaged rows"]);
        for (n, text) in [
            (1, "1st"),
            (2, "2nd"),
            (3, "3rd"),
            (4, "4th"),
            (11, "11th"),
            (112, "112th"),
            (122, "122nd"),
        ] {
            assert_eq!(ordinal(n), text);
        }
    }
}
