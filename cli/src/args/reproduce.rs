//! The arguments of `mmt reproduce`.

use std::num::NonZero;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};
use mmt_lab::physics::Body;

use super::values;

/// Arguments of `mmt reproduce`.
#[derive(Debug, Args)]
pub(crate) struct ReproduceArguments {
    /// What to reproduce.
    #[command(subcommand)]
    pub(crate) experiment: Experiment,
    /// Folder for CSV, SVG and manifest.json; made if it is not there
    #[arg(long, global = true, value_name = "DIR", default_value = "figures")]
    pub(crate) out: PathBuf,
    /// Seeds 1 to N [default: each experiment's own]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(crate) seeds: Option<u64>,
    /// Length of a run, in virtual time [default: 30s; delay, congestion: 40s, transport: 20s]
    #[arg(long, global = true, value_name = "TIME", value_parser = values::duration)]
    pub(crate) duration: Option<Duration>,
    /// Threads [default: as many as the machine has cores]
    #[arg(long, global = true, value_name = "N")]
    pub(crate) jobs: Option<NonZero<usize>>,
    /// Print one JSON document instead of tables
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

/// What can be reproduced.
#[derive(Clone, Debug, PartialEq, Subcommand)]
pub(crate) enum Experiment {
    /// Fig. 5: packet rate and PMSE of the update schemes, both modes
    Fig5 {
        /// Write every run's forces and updates at 1 kHz as well, under samples/ (about 2 MB a run)
        #[arg(long)]
        samples: bool,
    },
    /// Fig. 6: forces and packets over time, deadband 15 %
    Fig6,
    /// Fig. 7: the same for hybrid 15 %, 150 ms
    Fig7,
    /// Every claim of section IV-B with value, interval and verdict
    Claims,
    /// How the paper's results depend on what the paper leaves open
    Ablation,
    /// Every update scheme and mismatch metric, with recovery after a change of friction
    Schemes,
    /// The best T_update: fixed periods and an adaptive rule, over trajectories and grounds
    Tupdate,
    /// Other bodies, other grounds, changes in mid-run: recovery, packets and force error in both modes
    Scenarios,
    /// At which delay each architecture stops being usable
    Delay {
        /// The whole grid of delays, jitter, losses and stiffnesses: about an hour
        #[arg(long)]
        full: bool,
    },
    /// What the protocol adds to the network's delay: stock quinn against ours, in exact virtual time
    Transport,
    /// What repeats of updates and samples buy under loss, and cost
    Repeats,
    /// The deadband as rate controller at a bottleneck of 64 kbit/s, with and without
    Congestion,
    /// Every network preset: configured against achieved
    Netem,
    /// What the environment does against closed forms and a fine reference, for any body
    Physics(BodyArguments),
    /// All of these, in one folder
    All,
}

/// The body of `mmt reproduce physics`.
#[derive(Args, Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyArguments {
    /// Mass m, kg
    #[arg(long, allow_negative_numbers = true, value_name = "KG", default_value_t = Body::default().mass_kg)]
    pub(crate) mass: f64,
    /// Side l of the square footprint, m
    #[arg(long, allow_negative_numbers = true, value_name = "M", default_value_t = Body::default().side_m)]
    pub(crate) side: f64,
    /// Friction coefficient between body and ground
    #[arg(long, allow_negative_numbers = true, value_name = "MU", default_value_t = Body::default().friction_coefficient)]
    pub(crate) mu: f64,
    /// Viscous damping b, N s/m
    #[arg(long, allow_negative_numbers = true, value_name = "NS_PER_M", default_value_t = Body::default().damping_ns_per_m)]
    pub(crate) damping: f64,
}

impl From<BodyArguments> for Body {
    fn from(arguments: BodyArguments) -> Self {
        Self {
            mass_kg: arguments.mass,
            side_m: arguments.side,
            friction_coefficient: arguments.mu,
            damping_ns_per_m: arguments.damping,
        }
    }
}

impl From<Body> for BodyArguments {
    fn from(body: Body) -> Self {
        Self {
            mass: body.mass_kg,
            side: body.side_m,
            mu: body.friction_coefficient,
            damping: body.damping_ns_per_m,
        }
    }
}
