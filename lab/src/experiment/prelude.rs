//! What nearly every experiment speaks of: the engine, figures, tables and trials.

pub(crate) use std::time::Duration;

pub(crate) use mmt_shared::model::settings::Mode;

pub(crate) use super::description::{Argument, Experiment, Request};
pub(crate) use super::findings::{ExperimentError, Findings};
pub(crate) use super::grid::{self, digest, interval, mean};
pub(crate) use crate::figure::{Axis, Colour, Dot, Figure, Legend, Mark, Panel, Series, Stroke};
pub(crate) use crate::io::Runner;
pub(crate) use crate::setting::{Curve, MODES, Senses, mode_name, paper_world, paper_worlds};
pub(crate) use crate::statistics::Interval;
pub(crate) use crate::table::{Column, Table, column};
pub(crate) use crate::trial::{Measured, Trial};
pub(crate) use crate::world::WorldConfig;
