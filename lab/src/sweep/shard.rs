//! A share of a sweep: every n-th row.
//!
//! Neighbouring rows cost about the same, so dealing them out in turn gives shards that end at about the same time.
//! Every row must be in exactly one shard of n.

use std::fmt;
use std::str::FromStr;

/// Shard i of n: the rows whose number leaves i − 1 when n divides the number less one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    count: u64,
}

/// Text that names no shard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no shard; write it as i/n with 1 <= i <= n, such as 2/8")]
pub struct ShardError(String);

impl Shard {
    /// All rows.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// Whether the row with this number, from 1, is in it.
    #[must_use]
    pub fn has(self, row: u64) -> bool {
        row > 0 && (row - 1) % self.count == self.index - 1
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let number = |digits: &str| {
            let plain = digits.bytes().all(|byte| byte.is_ascii_digit());
            plain.then(|| digits.parse::<u64>().ok()).flatten()
        };
        let numbers = text
            .split_once('/')
            .and_then(|(index, count)| Some((number(index)?, number(count)?)));
        match numbers {
            Some((index, count)) if 1 <= index && index <= count => Ok(Self { index, count }),
            _ => Err(ShardError(text.to_owned())),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl Shard {
    /// Its name in the name of a file: `2-of-8`.
    #[must_use]
    pub fn file_stem(self) -> String {
        format!("{}-of-{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_in_one_shard() {
        for count in 1..=7 {
            for row in 1..=50 {
                let holders = (1..=count)
                    .filter(|index| {
                        Shard {
                            index: *index,
                            count,
                        }
                        .has(row)
                    })
                    .count();
                assert_eq!(holders, 1, "row {row} of {count} shards");
            }
        }
        assert!(!Shard::WHOLE.has(0));
    }

    #[test]
    fn a_shard_is_written_i_of_n_and_nothing_else_is_one() {
        let shard: Shard = "2/8".parse().unwrap();
        assert_eq!(shard, Shard { index: 2, count: 8 });
        assert_eq!(
            (shard.to_string(), shard.file_stem()),
            ("2/8".into(), "2-of-8".into())
        );
        for wrong in [
            "", "2", "0/3", "4/3", "1/0", "-1/3", "+1/3", "a/b", "1/2/3", "/", " 1/2",
        ] {
            let error = wrong.parse::<Shard>().unwrap_err().to_string();
            assert!(error.contains("2/8"), "{error}");
        }
    }
}
