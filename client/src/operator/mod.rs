//! Operators: what moves the HIP when no hand does.

pub mod trace;
//! Who moves the HIP.

pub mod hand;
mod route;
pub mod scripted;
mod stroke;
