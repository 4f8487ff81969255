//! A source as words and marks: without comments, strings, characters and lifetimes.

/// Words (names, keywords, numbers), `::`, and single characters of all else but space.
pub fn tokens(source: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = source;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => block_comment(rest),
            '"' => string(rest),
            '\'' => quote(rest),
            _ if is_word(first) => {
                let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
                match literal_after(&rest[..length], &rest[length..]) {
                    Literal::None => {
                        tokens.push(&rest[..length]);
                        length
                    }
                    Literal::Name => length + 1,
                    Literal::Text(more) => length + more,
                }
            }
            _ => {
                let length = if rest.starts_with("::") { 2 } else { first.len_utf8() };
                if !first.is_whitespace() {
                    tokens.push(&rest[..length]);
                }
                length
            }
        };
        rest = &rest[length..];
    }
    tokens
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// What a word is the prefix of.
enum Literal {
    None,
    /// `r#name`: the name follows.
    Name,
    /// A string or a character that takes so many bytes.
    Text(usize),
}

fn literal_after(word: &str, rest: &str) -> Literal {
    match word {
        "b" if rest.starts_with('\'') => Literal::Text(quote(rest)),
        "b" | "c" if rest.starts_with('"') => Literal::Text(string(rest)),
        "r" | "br" | "cr" => {
            let hashes = rest.len() - rest.trim_start_matches('#').len();
            match rest[hashes..].starts_with('"') {
                true => Literal::Text(raw_string(rest, hashes)),
                false if word == "r" && hashes == 1 => Literal::Name,
                false => Literal::None,
            }
        }
        _ => Literal::None,
    }
}

/// Block comments nest.
fn block_comment(rest: &str) -> usize {
    let (mut at, mut depth) = (0, 0_u32);
    while at < rest.len() {
        let after = &rest.as_bytes()[at..];
        if after.starts_with(b"/*") {
            (at, depth) = (at + 2, depth + 1);
        } else if after.starts_with(b"*/") {
            (at, depth) = (at + 2, depth - 1);
        } else {
            at += 1;
            continue;
        }
        if depth == 0 {
            return at;
        }
    }
    rest.len()
}

fn string(rest: &str) -> usize {
    closed(rest, b'"')
}

fn raw_string(rest: &str, hashes: usize) -> usize {
    let end = format!("\"{}", "#".repeat(hashes));
    let from = hashes + 1;
    rest[from..].find(&end).map_or(rest.len(), |at| from + at + end.len())
}

/// Of a character; of a lifetime, its quote and its name.
fn quote(rest: &str) -> usize {
    let mut inner = rest[1..].chars();
    match (inner.next(), inner.next()) {
        (Some('\\'), _) | (Some(_), Some('\'')) => closed(rest, b'\''),
        _ => 1 + rest[1..].find(|c| !is_word(c)).unwrap_or(rest.len() - 1),
    }
}

/// Bytes up to and with the mark that ends what begins with it, which a backslash keeps from ending it.
fn closed(rest: &str, mark: u8) -> usize {
    let bytes = rest.as_bytes();
    let mut at = 1;
    while at < bytes.len() {
        match bytes[at] {
            b'\\' => at += 2,
            byte if byte == mark => return at + 1,
            _ => at += 1,
        }
    }
    rest.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_marks_are_left() {
        let source = r##"use a::b; // use c::d;
            /* use e; /* nested */ use f; */ let s = "use g; \" use h;"; let r = r#"use "i"#; let c = '"'; let d = '\'';
            fn x<'a>(y: &'a r#type) -> [u8; 2] { b"use j".0 } 'l'"##;
        let expected =
            "use a :: b ; let s = ; let r = ; let c = ; let d = ; fn x < > ( y : & type ) - > [ u8 ; 2 ] { . 0 }";
        assert_eq!(tokens(source).join(" "), expected);
    }

    #[test]
    fn what_does_not_end_ends_with_the_source() {
        for source in ["\"", "'", "'\\", "/*", "r#\"", "b'", "//", "\"\\", "ä'ö", "'ö'", "/*/"] {
            assert!(tokens(source).len() <= 1, "{source}");
        }
    }
}
