//! `mmt demo`: slave, emulated network and master in this process.
