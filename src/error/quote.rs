//! Formats text for display, whatever it quotes: as one line of bounded length, without characters
//! that control a terminal or are invisible. Knows nothing of where messages come from.

use std::borrow::Cow;
use std::fmt::Write;

/// The largest number of characters in a line that the program prints.
pub const LONGEST_LINE: usize = 300;

/// Replaces what was cut out.
const GAP: &str = " ... ";

/// `text` as one line of at most `longest` characters. Characters that control a terminal or are
/// invisible are escaped as in Rust. A text that is too long loses its middle, since messages begin
/// with the place of an error and end with its reason.
pub fn one_line(text: &str, longest: usize) -> String {
    let mut line = String::new();
    // Escaping never shortens a text, so most of a long text need not be escaped.
    let text = shortened(text, longest);
    for c in text.chars() {
        if is_hidden(c) {
            line.extend(c.escape_default());
        } else {
            line.push(c);
        }
    }
    shortened(&line, longest).into_owned()
}

/// JSON in which every character that a terminal would interpret or hide is replaced by the
/// equivalent `\u` and four digits; such characters occur only within strings.
pub fn json(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_hidden(c) && c != '\n' {
            for unit in c.encode_utf16(&mut [0; 2]) {
                // Writing to a string cannot fail.
                let _ = write!(shown, "\\u{unit:04x}");
            }
        } else {
            shown.push(c);
        }
    }
    shown
}

/// The first two thirds and the end, `longest` characters in all; a shorter text is unchanged.
fn shortened(text: &str, longest: usize) -> Cow<'_, str> {
    if text.chars().nth(longest).is_none() {
        return text.into();
    }
    let kept = longest.saturating_sub(GAP.len());
    let end = kept / 3;
    let start: String = text.chars().take(kept - end).collect();
    let mut tail: Vec<char> = text.chars().rev().take(end).collect();
    tail.reverse();
    (start + GAP + &tail.into_iter().collect::<String>()).into()
}

/// Whether a character controls terminals (the control characters of ASCII and Latin-1), breaks
/// lines, changes the writing direction or has no width.
fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff0}'..='\u{fffb}' | '\u{e0000}'..='\u{e0fff}')
}

#[cfg(test)]
mod tests {
    use super::{json, one_line};

    #[test]
    fn nothing_steers_a_terminal() {
        let text = "a\u{1b}[31mb\nc\u{9b}d\u{202e}e\u{7f}\u{2028}";
        let line = one_line(text, 300);
        assert_eq!(line, "a\\u{1b}[31mb\\nc\\u{9b}d\\u{202e}e\\u{7f}\\u{2028}");
        // A line that is formatted again does not change.
        assert_eq!(one_line(&line, 300), line);
        assert_eq!(one_line("Wolke über µ", 300), "Wolke über µ");
    }

    #[test]
    fn a_long_line_keeps_its_beginning_and_its_end() {
        for text in ["x".repeat(400), "\u{1b}".repeat(200_000), "é".repeat(1 << 20)] {
            let line = one_line(&format!("file.npy: {text}: the reason"), 100);
            assert_eq!(line.chars().count(), 100);
            assert!(line.starts_with("file.npy: ") && line.ends_with(": the reason"), "{line}");
        }
        assert_eq!(one_line("short", 5), "short");
    }

    #[test]
    fn json_says_the_same() {
        let names = ["a\u{1b}[0m\n", "\u{9b}\u{202e}", "\u{e0041}x\u{7f}"];
        let text = serde_json::to_string_pretty(&names).unwrap_or_default();
        let shown = json(&text);
        assert!(shown.chars().all(|c| c == '\n' || (' '..='~').contains(&c)), "{shown}");
        let again: Vec<String> = serde_json::from_str(&shown).unwrap_or_default();
        assert_eq!(again, names);
    }
}
