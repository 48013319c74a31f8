//! What is promised of sessions in real time.

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
