//! What a peer wrote, made fit for a person to read: it neither steers a terminal nor forges a line.
//!
//! Every string of a peer goes through here before it is logged, printed or kept: names and labels where they are shown,
//! reasons of a close with the line or the error that carries them.

/// What stands for a character that is not shown.
const INSTEAD: char = '?';
/// Characters of a text that are kept: as long as any message of ours.
const KEPT_MAX: usize = 1000;

/// Whether a character has no place in a line: controls (ESC, CR, LF, C1), line and paragraph separators, and what changes
/// the direction of writing (Unicode TR 36, 2.10: it can make one text look like another).
fn is_unfit(c: char) -> bool {
    c.is_control()
        || matches!(
            c,
            '\u{61c}'
                | '\u{200e}'
                | '\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2066}'..='\u{2069}'
                | '\u{feff}'
        )
}

/// One line of it, without what is unfit, and not longer than a message.
pub fn clean(text: &str) -> String {
    let fit = |c| if is_unfit(c) { INSTEAD } else { c };
    let mut fit: String = text.chars().take(KEPT_MAX).map(fit).collect();
    if text.chars().nth(KEPT_MAX).is_some() {
        fit.push('…');
    }
    fit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_of_a_stranger_steers_a_terminal_or_forges_a_line() {
        for (hostile, shown) in [
            ("\x1b[2J\x1b]0;owned\x07", "?[2J?]0;owned?"),
            (
                "bye\r\n INFO 10.0.0.7 operates",
                "bye?? INFO 10.0.0.7 operates",
            ),
            ("a\u{202e}txt.exe\u{2066}b\u{200f}", "a?txt.exe?b?"),
            ("\u{9b}31m\u{85}\u{2028}x\u{feff}", "?31m??x?"),
            ("Grüße, 世界", "Grüße, 世界"),
        ] {
            assert_eq!(clean(hostile), shown);
        }
    }

    #[test]
    fn a_flood_of_text_is_cut() {
        let cut = clean(&"é".repeat(5000));
        assert_eq!(cut.chars().count(), KEPT_MAX + 1);
        assert!(cut.ends_with('…'));
        assert_eq!(clean(&"x".repeat(KEPT_MAX)), "x".repeat(KEPT_MAX));
    }
}
