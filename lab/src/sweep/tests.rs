//! Plans right and wrong, and rows however they are cut.
