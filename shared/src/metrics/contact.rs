//! Contact breaks per push: where instability shows first, since friction bounds the limit cycle.

/// Counts how often contact is lost. One break a push is ideal (its end); more than two is chatter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactBreaks {
    in_contact: bool,
    breaks: u64,
}

impl ContactBreaks {
    /// Takes one tick: whether the side that is watched is in contact.
    pub fn push(&mut self, in_contact: bool) {
        self.breaks += u64::from(self.in_contact && !in_contact);
        self.in_contact = in_contact;
    }

    /// Ticks on which contact ended.
    pub fn total(&self) -> u64 {
        self.breaks
    }

    /// Contact breaks per completed push; absent before the first push is completed.
    pub fn per_push(&self, pushes_completed: u64) -> Option<f64> {
        (pushes_completed > 0).then(|| self.breaks as f64 / pushes_completed as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_end_of_a_contact_is_a_break() {
        let mut breaks = ContactBreaks::default();
        for (in_contact, total) in [
            (false, 0),
            (true, 0),
            (true, 0),
            (false, 1),
            (false, 1),
            (true, 1),
            (false, 2),
            (true, 2),
        ] {
            breaks.push(in_contact);
            assert_eq!(breaks.total(), total);
        }
        assert_eq!(breaks.per_push(0), None);
        assert_eq!(breaks.per_push(4), Some(0.5));
    }
}
