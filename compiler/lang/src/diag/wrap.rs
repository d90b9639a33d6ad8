//! Line breaking for pages on a terminal: greedy, a paragraph at a time, with code in backquotes
//! kept whole.

/// The text with its paragraphs filled to at most `width` columns; a single word may be wider.
/// Headings lose their mark. Fenced code is indented instead, and like tables never broken.
pub(super) fn fill_page(page: &str, width: usize) -> String {
    let mut out = String::new();
    let mut paragraph = Vec::new();
    let mut fenced = false;
    for line in page.lines() {
        let fence = line.starts_with("```");
        let is_prose = !(fenced || fence || line.is_empty() || line.starts_with('|'));
        if !is_prose || is_item(line) || line.starts_with('#') {
            fill(&mut out, &paragraph, width);
            paragraph.clear();
        }
        if is_prose {
            paragraph.extend(words(line.trim_start_matches("# ")));
        } else if fence {
            fenced = !fenced;
        } else if fenced && !line.is_empty() {
            out += &format!("    {line}\n");
        } else {
            out += &format!("{line}\n");
        }
    }
    fill(&mut out, &paragraph, width);
    out
}

/// Whether a line begins an item of a list.
fn is_item(line: &str) -> bool {
    line.trim_start().starts_with("* ")
}

/// Adds words in lines of at most `width` columns; those of an item hang behind its mark.
fn fill(out: &mut String, words: &[&str], width: usize) {
    let hang = if words.first() == Some(&"*") { 2 } else { 0 };
    let mut column = 0;
    for word in words {
        let length = word.chars().count();
        if column > 0 && column + 1 + length > width {
            *out += "\n";
            *out += &" ".repeat(hang);
            column = hang;
        } else if column > 0 {
            *out += " ";
            column += 1;
        }
        *out += word;
        column += length;
    }
    if !words.is_empty() {
        *out += "\n";
    }
}

/// The words of a line: a space within backquotes parts nothing.
fn words(line: &str) -> impl Iterator<Item = &str> {
    let mut quoted = false;
    line.split(move |c: char| {
        quoted ^= c == '`';
        c == ' ' && !quoted
    })
    .filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paragraphs_are_filled_and_code_in_quotes_stays_whole() {
        let page = "# A title\n\nOne sentence.\nAnother one, with `a b c d` in it.\n";
        let filled = "A title\n\nOne sentence. Another\none, with `a b c d`\nin it.\n";
        assert_eq!(fill_page(page, 21), filled);
        let wide = "A title\n\nOne sentence. Another one, with `a b c d` in it.\n";
        assert_eq!(fill_page(page, 80), wide);
    }

    #[test]
    fn programs_and_tables_keep_their_lines() {
        let page = "Wrong:\n\n```whip\nforce f = 1 N +  2 N\n\n```\n\n| a | wide table |\n";
        let filled = "Wrong:\n\n    force f = 1 N +  2 N\n\n\n| a | wide table |\n";
        assert_eq!(fill_page(page, 8), filled);
    }

    #[test]
    fn items_hang_behind_their_mark() {
        let filled = "* one two\n  three\n* four\n";
        assert_eq!(fill_page("* one two\n  three\n* four\n", 9), filled);
    }

    #[test]
    fn a_word_may_be_wider_than_a_line() {
        assert_eq!(fill_page("a abcdefgh b\n", 4), "a\nabcdefgh\nb\n");
    }
}
