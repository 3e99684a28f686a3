//! Text as people may see it, whatever it quotes: one line of bounded length, in which no character
//! steers a terminal or hides. It knows nothing of who says what.

use std::borrow::Cow;
use std::fmt::Write;

/// The most characters of a line that the program says.
pub const LONGEST_LINE: usize = 300;

/// Stands for what was cut out.
const GAP: &str = " ... ";

/// `text` as one line of at most `longest` characters: what steers terminals or can't be seen is
/// escaped as Rust writes it, and what is too long loses its middle, since messages begin with the
/// place of a fault and end with the reason.
pub fn one_line(text: &str, longest: usize) -> String {
    let mut line = String::new();
    // A character is at least one afterwards, so that most of a long text need not be looked at.
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

/// JSON with everything that a terminal would obey or hide as `\u` and four digits, which stands
/// for the same character: such characters only occur within strings.
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

/// The first two thirds and the end, `longest` characters in all; all of what is no longer.
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

/// Whether a character steers terminals (the controls of ASCII and of Latin 1), breaks lines, turns
/// the direction of writing or has no width.
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
        // A line within a line is what it was.
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
