//! Parses Python's literals, as far as headers of NPY files have them: texts, whole numbers, truth values,
//! tuples, lists and dictionaries. Source: Python Language Reference, "Lexical analysis".
//!
//! Own code: npyz, which reads headers too, brings 16 packages, a C compiler, and 4 % of the time of a first
//! build, and its parser overflows the stack on deeply nested brackets. Tests compare the types that are read
//! with npyz's.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

/// The deepest nesting of brackets. numpy's are four deep, and two more for each structure in a field.
const DEEPEST: u32 = 8;

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Literal {
    Text(String),
    Number(u64),
    Bool(bool),
    /// A tuple or a list.
    List(Vec<Literal>),
    /// A dictionary whose keys are texts.
    Dictionary(Vec<(String, Literal)>),
}

/// Parses a text that holds one value.
///
/// # Errors
/// What is wrong, and at which byte.
pub(super) fn parse(text: &str) -> Result<Literal, String> {
    let mut parser = Parser { rest: text };
    let parsed = parser.value(0).and_then(|value| match parser.next() {
        None => Ok(value),
        Some(_) => Err("could not parse"),
    });
    parsed.map_err(|why| format!("{why}, at byte {}", text.len().saturating_sub(parser.rest.len())))
}

struct Parser<'a> {
    rest: &'a str,
}

impl Parser<'_> {
    /// The next character that is no space, which stays.
    fn next(&mut self) -> Option<char> {
        self.rest = self.rest.trim_ascii_start();
        self.rest.chars().next()
    }

    /// Skips a text if it comes next, and returns whether it did.
    fn has(&mut self, expected: &str) -> bool {
        self.next();
        let rest = self.rest.strip_prefix(expected);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn value(&mut self, depth: u32) -> Result<Literal, &'static str> {
        if depth > DEEPEST {
            return Err("its lists are too deep");
        }
        let inner = depth.saturating_add(1);
        match self.next() {
            Some(quote @ ('\'' | '"')) => self.text(quote).map(Literal::Text),
            Some('0'..='9') => self.number().map(Literal::Number),
            Some('(') => self.list("(", ")", |parser| parser.value(inner)).map(Literal::List),
            Some('[') => self.list("[", "]", |parser| parser.value(inner)).map(Literal::List),
            Some('{') => self
                .list("{", "}", |parser| parser.entry(inner))
                .map(Literal::Dictionary),
            _ if self.has("True") => Ok(Literal::Bool(true)),
            _ if self.has("False") => Ok(Literal::Bool(false)),
            _ => Err("could not parse"),
        }
    }

    /// Parses items between brackets, with a comma between them or after each.
    fn list<T>(
        &mut self,
        open: &str,
        close: &str,
        item: impl Fn(&mut Self) -> Result<T, &'static str>,
    ) -> Result<Vec<T>, &'static str> {
        let mut items = Vec::new();
        let mut more = self.has(open);
        while !self.has(close) {
            if !more {
                return Err("could not parse");
            }
            items.push(item(self)?);
            more = self.has(",");
        }
        Ok(items)
    }

    fn entry(&mut self, depth: u32) -> Result<(String, Literal), &'static str> {
        match self.value(depth)? {
            Literal::Text(key) if self.has(":") => Ok((key, self.value(depth)?)),
            _ => Err("could not parse"),
        }
    }

    /// Parses a whole number. Python 2 wrote an `L` after it.
    fn number(&mut self) -> Result<u64, &'static str> {
        let end = self.rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(self.rest.len());
        let (digits, rest) = self.rest.split_at(end);
        let number = digits.parse().map_err(|_| "a number is too large")?;
        self.rest = rest.strip_prefix('L').unwrap_or(rest);
        Ok(number)
    }

    /// Parses a text between quotes.
    fn text(&mut self, quote: char) -> Result<String, &'static str> {
        let mut text = String::new();
        let mut chars = self.rest.chars();
        chars.next();
        while let Some(c) = chars.next() {
            text.push(match c {
                c if c == quote => {
                    self.rest = chars.as_str();
                    return Ok(text);
                }
                '\\' => match chars.next() {
                    Some(c @ ('\\' | '\'' | '"')) => c,
                    Some('n') => '\n',
                    Some('r') => '\r',
                    Some('t') => '\t',
                    Some('x') => code_point(&mut chars, 2)?,
                    Some('u') => code_point(&mut chars, 4)?,
                    Some('U') => code_point(&mut chars, 8)?,
                    _ => return Err("could not parse an escape"),
                },
                c => c,
            });
        }
        Err("could not parse a text that does not end")
    }
}

/// The character with a hexadecimal code point.
fn code_point(chars: &mut std::str::Chars<'_>, digits: usize) -> Result<char, &'static str> {
    let code = (0..digits).try_fold(0u32, |code, _| {
        let digit = chars.next().and_then(|c| c.to_digit(16))?;
        Some(code.wrapping_shl(4) | digit)
    });
    code.and_then(char::from_u32).ok_or("could not parse an escape")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Literal {
        Literal::Text(text.into())
    }

    #[test]
    fn values_as_python_writes_them() {
        for (written, value) in [
            (" 'a' \n", text("a")),
            (r#""it's""#, text("it's")),
            (r"'it\'s \\ \xe9\u20ac\U0001f600\n'", text("it's \\ é€😀\n")),
            ("'é'", text("é")),
            ("7L", Literal::Number(7)),
            ("(18446744073709551615,)", Literal::List(vec![Literal::Number(u64::MAX)])),
            ("()", Literal::List(vec![])),
            ("[True, False]", Literal::List(vec![Literal::Bool(true), Literal::Bool(false)])),
            ("{ 'a' : 1 , 'b':() , }", {
                let entries = [("a".into(), Literal::Number(1)), ("b".into(), Literal::List(vec![]))];
                Literal::Dictionary(entries.to_vec())
            }),
        ] {
            assert_eq!(parse(written), Ok(value), "{written}");
        }
    }

    #[test]
    fn what_is_no_literal_is_refused_with_its_place() {
        for (written, why) in [
            ("", "could not parse, at byte 0"),
            ("(1 2)", "could not parse, at byte 3"),
            ("(,)", "could not parse, at byte 1"),
            ("(1,,)", "could not parse, at byte 3"),
            ("(1", "could not parse, at byte 2"),
            ("1 'a'", "could not parse, at byte 2"),
            ("-1", "could not parse, at byte 0"),
            ("{1: 2}", "could not parse, at byte 2"),
            ("{'a'}", "could not parse, at byte 4"),
            ("'a", "could not parse a text that does not end, at byte 0"),
            (r"'\x4'", "could not parse an escape, at byte 0"),
            (r"'\ud800'", "could not parse an escape, at byte 0"),
            ("18446744073709551616", "a number is too large, at byte 0"),
            ("((((((((((1))))))))))", "its lists are too deep, at byte 9"),
        ] {
            assert_eq!(parse(written), Err(why.to_owned()), "{written}");
        }
    }
}
