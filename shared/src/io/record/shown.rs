//! The topics of a record, and what both ends show of themselves on them.

use super::file::RecordWriter;
use crate::channel::peer::Loss;
use crate::model::geometry::{BoxFootprint, Pose, Twist, Vec2};
use crate::record::messages::{Link, Parameters, Stamp};
use crate::record::ros::{Marker, Standard};
use crate::wire::Side;

/// What an end shows of itself now and then: its contact as screens draw it, its model and its link.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    /// The HIP, or the tool, m.
    pub point: Vec2,
    /// The force there, N.
    pub force: Vec2,
    /// Pose of the body: the model's, or the object's.
    pub body: Pose,
    /// Its faces, once they are known.
    pub footprint: Option<BoxFootprint>,
    /// Its velocity.
    pub twist: Twist,
    /// m (kg), b (N s/m), c (N).
    pub params: [f64; 3],
    /// Covariance of (m, b, c), row by row; NaN where it is not known.
    pub covariance: [f64; 9],
    /// Median round trip, ms; none before the first.
    pub rtt_ms: Option<f64>,
    /// The master's datagrams, as far as this end counts them.
    pub up: Loss,
    /// The slave's datagrams, likewise.
    pub down: Loss,
}

/// The topics of an end, its frames and its markers.
pub(super) struct Names {
    pub(super) session: &'static str,
    pub(super) arrivals: &'static str,
    pub(super) packets: &'static str,
    pub(super) about_loop: &'static str,
    twist: &'static str,
    markers: &'static str,
    parameters: &'static str,
    link: &'static str,
    point: &'static str,
    body: &'static str,
    force: &'static str,
    /// Red, green and blue of its body and its force, 0 to 1.
    colour: [f32; 3],
}

const MASTER: Names = Names {
    session: "/master/session",
    arrivals: "/master/arrivals",
    packets: "/master/packets",
    about_loop: "/master/loop",
    twist: "/master/model_twist",
    markers: "/master/markers",
    parameters: "/master/parameters",
    link: "/master/link",
    point: "master/hip",
    body: "master/model",
    force: "f_m",
    // blue
    colour: [0.0, 0.45, 0.70],
};

const SLAVE: Names = Names {
    session: "/slave/session",
    arrivals: "/slave/arrivals",
    packets: "/slave/packets",
    about_loop: "/slave/loop",
    twist: "/slave/object_twist",
    markers: "/slave/markers",
    parameters: "/slave/parameters",
    link: "/slave/link",
    point: "slave/tool",
    body: "slave/object",
    force: "f_s",
    // vermilion
    colour: [0.84, 0.37, 0.0],
};

impl Names {
    pub(super) const fn of(side: Side) -> &'static Self {
        match side {
            Side::Master => &MASTER,
            Side::Slave => &SLAVE,
        }
    }

    /// Writes what an end shows.
    pub(super) fn put(&self, stamp: Stamp, session: u32, shown: &Shown, out: &mut RecordWriter) {
        let point = Pose::new(shown.point.x, shown.point.y, 0.0);
        let frames = [(self.point, point), (self.body, shown.body)];
        out.put_standard("/tf", stamp, Standard::Frames(&frames));
        out.put_standard(self.twist, stamp, Standard::Twist(shown.twist));
        let markers = self.markers(shown, point);
        out.put_standard(self.markers, stamp, Standard::Markers(&markers));
        let [m_kg, b_ns_per_m, c_n] = shown.params;
        let parameters = Parameters {
            stamp,
            session,
            m_kg,
            b_ns_per_m,
            c_n,
            covariance: shown.covariance,
        };
        out.put(self.parameters, stamp, &parameters);
        let link = Link {
            stamp,
            session,
            rtt_ms: shown.rtt_ms.unwrap_or(f64::NAN),
            up_expected: shown.up.expected,
            up_received: shown.up.received,
            down_expected: shown.down.expected,
            down_received: shown.down.received,
        };
        out.put(self.link, stamp, &link);
    }

    /// The body, half transparent, the point at it, and the force there.
    fn markers(&self, shown: &Shown, point: Pose) -> Vec<Marker> {
        let [red, green, blue] = self.colour;
        let colour = |opacity| [red, green, blue, opacity];
        let last = |path: &'static str| path.rsplit('/').next().unwrap_or(path);
        let body = shown.footprint.as_ref();
        body.map(|faces| Marker::body(last(self.body), shown.body, faces, colour(0.5)))
            .into_iter()
            .chain([
                Marker::point(last(self.point), point),
                Marker::force(self.force, point, shown.force, colour(1.0)),
            ])
            .collect()
    }
}
