//! Which update a command may acknowledge.

/// The newest update that the end has accepted, as far as its datagrams show.
#[derive(Clone, Debug, Default)]
pub(super) struct Accepted {
    newest: u32,
    /// Newer ones that may have been accepted: the datagrams alone do not show it.
    unsure: Vec<u32>,
}

impl Accepted {
    /// Its number; 0 before there is one.
    pub(super) fn newest(&self) -> u32 {
        self.newest
    }

    /// This one was accepted.
    pub(super) fn accepts(&mut self, sequence: u32) {
        self.newest = sequence;
        self.unsure.retain(|unsure| *unsure > sequence);
    }

    /// This one may have been accepted.
    pub(super) fn may_accept(&mut self, sequence: u32) {
        self.unsure.push(sequence);
    }

    /// The end sends a command that acknowledges this one. If it may have been accepted, it was. Returns whether it is the
    /// newest that was accepted.
    pub(super) fn is_acknowledged(&mut self, sequence: u32) -> bool {
        if self.unsure.contains(&sequence) {
            self.accepts(sequence);
        }
        sequence == self.newest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_update_that_may_have_been_accepted_may_be_acknowledged_and_no_other() {
        let mut accepted = Accepted::default();
        accepted.accepts(1);
        (2..=5).for_each(|sequence| accepted.may_accept(sequence));
        assert!(accepted.is_acknowledged(1), "none of them so far");
        assert!(!accepted.is_acknowledged(6), "it never came");
        // the link was late from the fourth on
        assert!(accepted.is_acknowledged(3));
        assert!(!accepted.is_acknowledged(2), "a command does not go back");
        assert!(accepted.is_acknowledged(5));
        accepted.may_accept(6);
        accepted.accepts(7);
        assert!(!accepted.is_acknowledged(6) && accepted.is_acknowledged(7));
    }
}
