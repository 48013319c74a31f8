//! Who moves the HIP.

pub mod hand;
mod route;
pub mod scripted;
mod stroke;
