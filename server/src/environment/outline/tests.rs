//! Laws of outlines.
