//! What is promised of the command, the wire and the house itself.

mod architecture;
mod command;
mod dissector;
mod documents;
mod golden;
mod harness;
mod plug_layout;
