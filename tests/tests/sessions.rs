//! What is promised of sessions in real time: one at a time, because each wants two cores.

mod devices;
mod ends;
mod endure;
mod harness;
mod identity;
mod independent_client;
mod judged;
mod live;
mod observers;
mod plugs;
mod records;
mod run_again;
mod soak;
mod two_hosts;
