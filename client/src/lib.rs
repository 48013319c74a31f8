//! The master: everything on the side of the hand.

pub mod operator;
