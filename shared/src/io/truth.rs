//! The object's true pose on a way beside the network, where both sides live in one process.
//!
//! A demonstration can report how far the master's model was from the object; two hosts cannot, since nobody sends the
//! truth. It must never reach anything but the report: no model, no operator and no estimator reads it.

use std::sync::Mutex;

use crate::model::geometry::Pose;
use crate::time::Time;

/// Poses that may wait for the master's loop: a quarter of a second. One that finds no room is left out.
const WAITING: usize = 256;

/// The slave's end.
#[derive(Debug)]
pub struct TruthSender(rtrb::Producer<(Time, Pose)>);

/// The master's end. The lock makes options that hold it shareable between threads; it is never taken.
#[derive(Debug)]
pub struct TruthReceiver(Mutex<rtrb::Consumer<(Time, Pose)>>);

/// Both ends of one way.
pub fn pair() -> (TruthSender, TruthReceiver) {
    let (sender, receiver) = rtrb::RingBuffer::new(WAITING);
    (TruthSender(sender), TruthReceiver(Mutex::new(receiver)))
}

impl TruthSender {
    /// Sends the true pose (m, rad, world) that the tool met at the HIP sample of `stamp`. Never waits.
    pub fn send(&mut self, stamp: Time, truth: Pose) {
        // a report that misses a few of a thousand poses a second is the same
        let _ = self.0.push((stamp, truth));
    }
}

impl TruthReceiver {
    /// The oldest pose that waits, and the stamp of its HIP sample by the master's clock. Never waits.
    pub fn receive(&mut self) -> Option<(Time, Pose)> {
        // a reference that nobody shares needs no lock
        self.0.get_mut().ok()?.pop().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_come_in_order_and_what_finds_no_room_is_left_out() {
        let (mut sender, mut receiver) = pair();
        let pose = |n: u32| Pose::new(f64::from(n), 0.0, 0.0);
        for n in 0..300 {
            sender.send(Time::from_millis(n.into()), pose(n));
        }
        for n in 0..256 {
            assert_eq!(
                receiver.receive(),
                Some((Time::from_millis(n.into()), pose(n)))
            );
        }
        assert_eq!(receiver.receive(), None);
        sender.send(Time::from_millis(400), pose(400));
        assert!(receiver.receive().is_some());
    }
}
