//! What somebody meant who wrote a word nearly right.

/// Of these words the one that is closest to a wrong one; none where all are far.
#[must_use]
pub fn meant<'a>(wrong: &str, words: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let near = words
        .into_iter()
        .map(|word| (strsim::osa_distance(wrong, word), word));
    let (distance, word) = near.min_by_key(|(distance, _)| *distance)?;
    (distance <= 1 + wrong.chars().count() / 4).then_some(word)
}

#[cfg(test)]
mod tests {
    use super::meant;

    #[test]
    fn a_word_that_is_nearly_right_finds_the_one_that_was_meant() {
        let words = ["side_m", "mass_kg", "wall"];
        assert_eq!(meant("mas_kg", words), Some("mass_kg"));
        assert_eq!(meant("mass_gk", words), Some("mass_kg"));
        assert_eq!(meant("colour", words), None);
        assert_eq!(meant("colour", []), None);
    }
}
