//! This module writes counts in sentences.

use std::fmt::Display;

/// A count with its noun: `1 cell`, `2 cells`.
pub fn count(n: impl Display, noun: &str) -> String {
    let n = n.to_string();
    let ending = if n == "1" { "" } else { "s" };
    format!("{n} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_followed_by_their_form() {
        let counts = [0, 1, 2].map(|n| count(n, "damaged row"));
        assert_eq!(counts, ["0 damaged rows", "1 damaged row", "2 damaged rows"]);
    }
}
