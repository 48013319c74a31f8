//! The tokens of a slave: each has a name, a role and the moment it was made, and stands on a line of its own.
//!
//! Pure. A token itself must never appear in a debug print, a log or an error.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use super::{HexError, Token};
use crate::wire::Role;

/// What a token's line begins with.
pub const TOKEN_LINE: &str = "token: ";
/// The most tokens that a slave has.
pub const TOKENS_MAX: usize = 64;
/// The longest name, bytes.
const NAME_MAX: usize = 32;
/// Name of the token that an identity is made with, and of one whose line has no name: those of mmt before tokens had any.
const FIRST_NAME: &str = "operator";
/// What stands for the moment of a token that was made before moments were kept.
const UNKNOWN: &str = "-";

/// Name of a token: who has it, for the eyes of the slave's owner.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct TokenName(String);

/// Why a text is no name of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a name has 1 to {NAME_MAX} letters of a-z, A-Z, 0-9 and . _ -, such as \"alice\"")]
pub struct TokenNameError;

impl TokenName {
    /// The name of the token that an identity is made with.
    #[must_use]
    pub fn first() -> Self {
        Self(FIRST_NAME.to_owned())
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for TokenName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

impl FromStr for TokenName {
    type Err = TokenNameError;

    fn from_str(text: &str) -> Result<Self, TokenNameError> {
        let sound = |b: u8| b.is_ascii_alphanumeric() || b"._-".contains(&b);
        // what is as long as a token could be one that stands in the wrong place
        let fits = (1..=NAME_MAX).contains(&text.len()) && text.bytes().all(sound);
        let name = Self(text.to_owned());
        fits.then_some(name).ok_or(TokenNameError)
    }
}

/// The moment at which a token was made, to the second, as RFC 3339 writes it in UTC.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Created(String);

impl Created {
    /// So many seconds after the beginning of 1970, UTC.
    #[must_use]
    pub fn at(unix_s: u64) -> Self {
        let (days, second) = (unix_s / 86_400, unix_s % 86_400);
        let (year, month, day) = civil(days);
        let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
        Self(format!(
            "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z"
        ))
    }

    fn read(text: &str) -> Option<Self> {
        const FORM: &[u8] = b"0000-00-00T00:00:00Z";
        let alike = |(form, b): (&u8, u8)| match form {
            b'0' => b.is_ascii_digit(),
            other => *other == b,
        };
        let fits = text.len() == FORM.len() && FORM.iter().zip(text.bytes()).all(alike);
        fits.then(|| Self(text.to_owned()))
    }
}

impl fmt::Display for Created {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

/// Year, month and day of the Gregorian calendar, so many days after the beginning of 1970. Eras of 400 years have 146097
/// days; years are counted from the first of March, so that a leap day is a year's last.
fn civil(days: u64) -> (u64, u64, u64) {
    let days = days + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 {
        from_march + 3
    } else {
        from_march - 9
    };
    (era * 400 + year + u64::from(month <= 2), month, day)
}

/// A token with all that is known of it. The token goes nowhere but into the identity's file and a pairing string.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedToken {
    /// Who has it.
    pub name: TokenName,
    /// What it lets a master be.
    pub role: Role,
    /// When it was made; none if that was before moments were kept.
    pub created: Option<Created>,
    /// The secret.
    pub token: Token,
}

/// Why tokens cannot be read. Lines are counted from 1; none of their words is repeated, since it could be a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TokensError {
    /// A line with another number of words.
    #[error("line {line} is no token: it has to read `token: NAME ROLE CREATED DIGITS`")]
    Form {
        /// Which line.
        line: usize,
    },
    /// A name that is none.
    #[error("the name in line {line} is none: {why}")]
    Name {
        /// Which line.
        line: usize,
        /// What a name has.
        why: TokenNameError,
    },
    /// A role that there is not.
    #[error("the role in line {line} is neither operator nor observer")]
    Role {
        /// Which line.
        line: usize,
    },
    /// A moment that is none.
    #[error("the moment in line {line} is none such as 2026-11-23T09:16:00Z")]
    Created {
        /// Which line.
        line: usize,
    },
    /// A token that is none.
    #[error("its token in line {line} {why}")]
    Token {
        /// Which line.
        line: usize,
        /// What is wrong.
        why: HexError,
    },
    /// Two of one name.
    #[error("line {line} has the name of a token before it")]
    Twice {
        /// Which line.
        line: usize,
    },
    /// More than a slave has.
    #[error("there are {TOKENS_MAX} tokens, which is the most: revoke one first")]
    Full,
}

/// The tokens of a slave, in the order in which they were made. Names differ.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tokens(Vec<NamedToken>);

impl Tokens {
    /// The one operator's token of an identity that is just made.
    #[must_use]
    pub fn first(token: Token, created: Created) -> Self {
        Self(vec![NamedToken {
            name: TokenName::first(),
            role: Role::Operator,
            created: Some(created),
            token,
        }])
    }

    /// The tokens in the lines of a text that begin with [`TOKEN_LINE`]; there may be none.
    ///
    /// # Errors
    /// Names the first line that is none, or has a name again.
    pub fn read(text: &str) -> Result<Self, TokensError> {
        let mut all = Self::default();
        for (line, text) in (1..).zip(text.lines()) {
            let Some(words) = text.strip_prefix(TOKEN_LINE) else {
                continue;
            };
            let one = read_line(line, words)?;
            if all.get(&one.name).is_some() {
                return Err(TokensError::Twice { line });
            }
            all.has_room()?;
            all.0.push(one);
        }
        Ok(all)
    }

    /// The lines that [`Tokens::read`] reads. They hold the secrets.
    #[must_use]
    pub fn reveal(&self) -> String {
        let line = |of: &NamedToken| {
            let created = of.created.as_ref().map_or(UNKNOWN, |at| &at.0);
            let (name, role, digits) = (&of.name, of.role.name(), of.token.reveal());
            format!("{TOKEN_LINE}{name} {role} {created} {digits}\n")
        };
        self.0.iter().map(line).collect()
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &NamedToken> {
        self.0.iter()
    }

    /// The token of this name.
    #[must_use]
    pub fn get(&self, name: &TokenName) -> Option<&NamedToken> {
        self.0.iter().find(|of| of.name == *name)
    }

    /// The one that this is, in a time that does not depend on its bytes.
    #[must_use]
    pub fn find(&self, token: &Token) -> Option<&NamedToken> {
        let same = |found: Option<_>, of| if of_token(of, token) { Some(of) } else { found };
        self.0.iter().fold(None, same)
    }

    /// The one that a slave's own pairing string has: the first, or else the oldest, of an operator.
    #[must_use]
    pub fn of_operator(&self) -> Option<&NamedToken> {
        let first = self.get(&TokenName::first());
        let operates = |of: &&NamedToken| of.role == Role::Operator;
        let oldest = || self.0.iter().find(operates);
        first.filter(operates).or_else(oldest)
    }

    /// Puts a token of this name in the place of the one that has it, whose role it keeps unless there is another; a new name
    /// without a role is an operator's. Whether there was one.
    ///
    /// # Errors
    /// There are as many as there may be.
    pub fn put(
        &mut self,
        name: &TokenName,
        role: Option<Role>,
        created: Created,
        token: Token,
    ) -> Result<bool, TokensError> {
        let created = Some(created);
        if let Some(of) = self.0.iter_mut().find(|of| of.name == *name) {
            of.role = role.unwrap_or(of.role);
            (of.created, of.token) = (created, token);
            return Ok(true);
        }
        self.has_room()?;
        self.0.push(NamedToken {
            name: name.clone(),
            role: role.unwrap_or(Role::Operator),
            created,
            token,
        });
        Ok(false)
    }

    /// Takes the token of this name away; none if there is none.
    pub fn remove(&mut self, name: &TokenName) -> Option<NamedToken> {
        let place = self.0.iter().position(|of| of.name == *name)?;
        Some(self.0.remove(place))
    }

    fn has_room(&self) -> Result<(), TokensError> {
        let room = self.0.len() < TOKENS_MAX;
        room.then_some(()).ok_or(TokensError::Full)
    }
}

fn of_token(of: &NamedToken, token: &Token) -> bool {
    of.token == *token
}

/// The words of a line: name, role, moment, token; or, of old, the token alone.
fn read_line(line: usize, words: &str) -> Result<NamedToken, TokensError> {
    let digits = |digits: &str| {
        let read = digits.parse();
        read.map_err(|why| TokensError::Token { line, why })
    };
    let words: Vec<&str> = words.split_whitespace().collect();
    match words[..] {
        [old] => Ok(NamedToken {
            name: TokenName::first(),
            role: Role::Operator,
            created: None,
            token: digits(old)?,
        }),
        [name, role, created, token] => Ok(NamedToken {
            name: (name.parse()).map_err(|why| TokensError::Name { line, why })?,
            role: Role::by_name(role).ok_or(TokensError::Role { line })?,
            created: match created {
                UNKNOWN => None,
                moment => Some(Created::read(moment).ok_or(TokensError::Created { line })?),
            },
            token: digits(token)?,
        }),
        _ => Err(TokensError::Form { line }),
    }
}

#[cfg(test)]
mod tests;
