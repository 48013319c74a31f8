//! The ticks of a run as columns, filled while it runs and made arrays at its end.

use mmt_lab::world::{World, WorldTick};
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::params::ModelParams;
use pyo3::prelude::*;

use crate::arrays::{column, rows};

/// A vector of which nothing is known.
const UNKNOWN: Vec2 = Vec2::new(f64::NAN, f64::NAN);

/// The columns; of vectors the components of a row follow each other.
pub(crate) struct Ticks {
    time: Vec<f64>,
    hip: Vec<f64>,
    f_m: Vec<f64>,
    hand_force: Vec<f64>,
    touching: Vec<bool>,
    pose_model: Vec<f64>,
    parameters_model: Vec<f64>,
    stamp: Vec<f64>,
    tool: Vec<f64>,
    f_s: Vec<f64>,
    f_s_true: Vec<f64>,
    f_shadow: Vec<f64>,
    f_m_played: Vec<f64>,
    in_contact: Vec<bool>,
    pose_true: Vec<f64>,
    parameters_estimate: Vec<f64>,
    update: Vec<u8>,
}

/// The columns as arrays, and the places of the causes of updates.
pub(crate) struct Arrays {
    /// Names and arrays.
    pub(crate) named: Vec<(&'static str, Py<PyAny>)>,
    pub(crate) updates: Vec<u8>,
}

fn pose(into: &mut Vec<f64>, pose: &Pose) {
    into.extend_from_slice(&[pose.position.x, pose.position.y, pose.angle]);
}

fn params(into: &mut Vec<f64>, params: &ModelParams) {
    into.extend_from_slice(&[params.m(), params.b(), params.c()]);
}

impl Ticks {
    /// No tick yet, with room for so many.
    pub(crate) fn with_room(ticks: usize) -> Self {
        let (numbers, vectors) = (
            || Vec::with_capacity(ticks),
            || Vec::with_capacity(2 * ticks),
        );
        let triples = || Vec::with_capacity(3 * ticks);
        Self {
            time: numbers(),
            hip: vectors(),
            f_m: vectors(),
            hand_force: vectors(),
            touching: Vec::with_capacity(ticks),
            pose_model: triples(),
            parameters_model: triples(),
            stamp: numbers(),
            tool: vectors(),
            f_s: vectors(),
            f_s_true: vectors(),
            f_shadow: vectors(),
            f_m_played: vectors(),
            in_contact: Vec::with_capacity(ticks),
            pose_true: triples(),
            parameters_estimate: triples(),
            update: Vec::with_capacity(ticks),
        }
    }

    /// A tick, after which the world is as it is.
    pub(crate) fn push(&mut self, world: &World, tick: &WorldTick) {
        let (master, model) = (&tick.master, world.master().model());
        self.time.push(tick.now.as_secs_f64());
        self.hip
            .extend_from_slice(master.sample.hip.metres().as_slice());
        self.f_m.extend_from_slice(master.displayed.as_slice());
        self.hand_force
            .extend_from_slice(master.hand_force.as_slice());
        self.touching.push(master.rendered.in_contact());
        pose(&mut self.pose_model, &model.state().pose);
        params(&mut self.parameters_model, &model.state().params);
        let estimate = world.slave().estimate();
        self.parameters_estimate
            .extend_from_slice(&[estimate.m, estimate.b, estimate.c]);
        let Some(slave) = &tick.slave else {
            self.push_no_slave();
            return;
        };
        self.stamp.push(slave.stamp.as_secs_f64());
        self.tool.extend_from_slice(slave.tool.as_slice());
        self.f_s.extend_from_slice(slave.f_s.as_slice());
        self.f_s_true.extend_from_slice(slave.true_force.as_slice());
        self.f_shadow.extend_from_slice(slave.f_shadow.as_slice());
        self.f_m_played
            .extend_from_slice(slave.f_m.unwrap_or(UNKNOWN).as_slice());
        self.in_contact.push(slave.in_contact);
        pose(&mut self.pose_true, &slave.truth);
        let cause = slave.update.map(|update| update.cause.number() + 1);
        self.update.push(
            cause
                .and_then(|at| u8::try_from(at).ok())
                .unwrap_or_default(),
        );
    }

    /// A tick before the first sample is played.
    fn push_no_slave(&mut self) {
        self.stamp.push(f64::NAN);
        let vectors = [
            &mut self.tool,
            &mut self.f_s,
            &mut self.f_s_true,
            &mut self.f_shadow,
            &mut self.f_m_played,
        ];
        for vector in vectors {
            vector.extend_from_slice(UNKNOWN.as_slice());
        }
        self.in_contact.push(false);
        self.pose_true.extend_from_slice(&[f64::NAN; 3]);
        self.update.push(0);
    }

    /// As arrays.
    pub(crate) fn arrays(self, py: Python<'_>) -> PyResult<Arrays> {
        let one = |values| column(py, values);
        let truth = |values: Vec<bool>| column(py, values);
        let many = |values, width| rows(py, values, width);
        let named = [
            ("time", one(self.time)),
            ("hip", many(self.hip, 2)?),
            ("f_m", many(self.f_m, 2)?),
            ("hand_force", many(self.hand_force, 2)?),
            ("touching", truth(self.touching)),
            ("pose_model", many(self.pose_model, 3)?),
            ("parameters_model", many(self.parameters_model, 3)?),
            ("stamp", one(self.stamp)),
            ("tool", many(self.tool, 2)?),
            ("f_s", many(self.f_s, 2)?),
            ("f_s_true", many(self.f_s_true, 2)?),
            ("f_shadow", many(self.f_shadow, 2)?),
            ("f_m_played", many(self.f_m_played, 2)?),
            ("in_contact", truth(self.in_contact)),
            ("pose_true", many(self.pose_true, 3)?),
            ("parameters_estimate", many(self.parameters_estimate, 3)?),
        ];
        let named = named.into_iter();
        Ok(Arrays {
            named: named.map(|(name, array)| (name, array.unbind())).collect(),
            updates: self.update,
        })
    }
}
