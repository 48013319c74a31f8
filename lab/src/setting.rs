//! The paper's experiment as a world: no network, one sample a packet, and the choices the paper leaves open.
//!
//! Literal where the paper is literal: a received pose is set on arrival, which is sound without delay. The same hand pushes
//! in both modes. It sees the real object, because the local model is not displayed (IV-A), and draws back as soon as a
//! push is over, because the paper mentions no rest.

use std::time::Duration;

use mmt_client::device::DeviceProfile;
use mmt_client::operator::scripted::{ScriptedConfig, VisualFeedback};
use mmt_server::playout::PlayoutConfig;
use mmt_server::sensing::VisionConfig;
use mmt_server::slave::SlaveConfig;
use mmt_server::trigger::{Scheme, TriggerConfig};
use mmt_shared::model::settings::{Mode, ModelSettings, PoseCorrection};

use crate::trial::Trial;
use crate::world::WorldConfig;

/// The seven deadband parameters of section IV-B, as shares.
pub const DEADBANDS: [f64; 7] = [0.025, 0.05, 0.10, 0.15, 0.20, 0.25, 0.30];

/// An update scheme whose deadband is still open: one curve of a rate–PMSE figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curve {
    /// (12) alone.
    Deadband,
    /// Section III-B with this T_update, ms.
    Hybrid(u64),
    /// The recommended scheme with this T_update, ms.
    Useful(u64),
}

impl Curve {
    /// The scheme at a deadband.
    #[must_use]
    pub fn at(self, delta: f64) -> Scheme {
        match self {
            Self::Deadband => Scheme::Deadband { delta },
            Self::Hybrid(ms) => Scheme::Hybrid {
                delta,
                t_update: Duration::from_millis(ms),
            },
            Self::Useful(ms) => Scheme::Useful {
                delta,
                t_update: Duration::from_millis(ms),
            },
        }
    }

    /// T_update, ms; 0 for the scheme without a timer.
    #[must_use]
    pub fn t_update_ms(self) -> u64 {
        match self {
            Self::Deadband => 0,
            Self::Hybrid(ms) | Self::Useful(ms) => ms,
        }
    }

    /// For legends: `hybrid 150 ms`.
    #[must_use]
    pub fn label(self) -> String {
        match self {
            Self::Deadband => "deadband".to_owned(),
            Self::Hybrid(ms) => format!("hybrid {ms} ms"),
            Self::Useful(ms) => format!("useful {ms} ms"),
        }
    }
}

/// What the slave finds the object by while it is pushed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Senses {
    /// Force and position of the tool, as in the paper.
    Touch,
    /// Images as well.
    Vision,
}

impl Senses {
    /// Those of a mode.
    #[must_use]
    pub fn of_mode(mode: Mode) -> Self {
        match mode {
            Mode::Paper => Self::Touch,
            Mode::Recommended => Self::Vision,
        }
    }

    /// For files: `touch` or `vision`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Touch => "touch",
            Self::Vision => "vision",
        }
    }

    fn vision(self) -> VisionConfig {
        match self {
            Self::Touch => VisionConfig::off(),
            Self::Vision => VisionConfig::default(),
        }
    }
}

/// The curves of fig. 5: the paper's three in both modes and the recommended scheme; and with equal senses, paper mode
/// with vision and the recommended scheme without.
pub const FIG5_CURVES: [(Mode, Senses, Curve); 11] = [
    (Mode::Paper, Senses::Touch, Curve::Deadband),
    (Mode::Paper, Senses::Touch, Curve::Hybrid(50)),
    (Mode::Paper, Senses::Touch, Curve::Hybrid(150)),
    (Mode::Paper, Senses::Vision, Curve::Deadband),
    (Mode::Paper, Senses::Vision, Curve::Hybrid(50)),
    (Mode::Paper, Senses::Vision, Curve::Hybrid(150)),
    (Mode::Recommended, Senses::Touch, Curve::Useful(150)),
    (Mode::Recommended, Senses::Vision, Curve::Deadband),
    (Mode::Recommended, Senses::Vision, Curve::Hybrid(50)),
    (Mode::Recommended, Senses::Vision, Curve::Hybrid(150)),
    (Mode::Recommended, Senses::Vision, Curve::Useful(150)),
];

/// The two modes with the schemes that they default to.
#[cfg(feature = "io")]
pub(crate) const MODES: [(Mode, Curve); 2] = [
    (Mode::Paper, Curve::Hybrid(150)),
    (Mode::Recommended, Curve::Useful(150)),
];

/// The paper's experiment in both modes, each with the scheme that it defaults to.
#[cfg(feature = "io")]
pub(crate) fn paper_worlds(deadband: f64) -> Vec<WorldConfig> {
    MODES
        .map(|(mode, curve)| paper_world(mode, curve.at(deadband)))
        .to_vec()
}

/// A point of a rate–PMSE curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The mode.
    pub mode: Mode,
    /// The senses.
    pub senses: Senses,
    /// The scheme.
    pub curve: Curve,
    /// Delta, as a share.
    pub deadband: f64,
}

impl Point {
    /// Every deadband of some curves, curve by curve.
    pub fn of(curves: impl IntoIterator<Item = (Mode, Senses, Curve)>) -> Vec<Self> {
        let points = |(mode, senses, curve)| {
            DEADBANDS.map(|deadband| Self {
                mode,
                senses,
                curve,
                deadband,
            })
        };
        curves.into_iter().flat_map(points).collect()
    }

    /// The run of the paper's experiment at this point.
    #[must_use]
    pub fn trial(&self, duration: Duration) -> Trial {
        let mut world = paper_world(self.mode, self.curve.at(self.deadband));
        world.slave.sensing.vision = self.senses.vision();
        Trial::new(world, duration)
    }
}

/// How much steeper PMSE falls from 30 to 10 % than from 10 to 2.5 %: the difference of the exponents d ln PMSE / d ln
/// Delta; of the PMSE at 2.5, 10 and 30 %.
#[cfg(feature = "io")]
pub(crate) fn knee(fine: f64, middle: f64, coarse: f64) -> f64 {
    let [fine, middle, coarse] = [fine, middle, coarse].map(libm::log);
    (coarse - middle) / libm::log(3.0) - (middle - fine) / libm::log(4.0)
}

/// The name of a mode in files.
#[must_use]
pub fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Paper => "paper",
        Mode::Recommended => "recommended",
    }
}

/// The default scenario without a network: every sample is its own packet, is played with the least delay, and an update is
/// applied in the next tick.
#[must_use]
pub fn paper_world(mode: Mode, scheme: Scheme) -> WorldConfig {
    let coupling = DeviceProfile::default().coupling();
    let settings = mode.model_settings(coupling);
    let settings = match mode {
        Mode::Paper => ModelSettings {
            correction: PoseCorrection::Snap,
            ..settings
        },
        Mode::Recommended => settings,
    };
    WorldConfig {
        operator: ScriptedConfig {
            view: VisualFeedback::Delayed,
            hold_s: 0.0,
            ..ScriptedConfig::default()
        },
        slave: SlaveConfig {
            playout: PlayoutConfig {
                delay_ms: 0.0,
                ..PlayoutConfig::default()
            },
            trigger: TriggerConfig {
                scheme,
                ..TriggerConfig::of_mode(mode)
            },
            ..SlaveConfig::of_mode(mode)
        },
        settings: Some(settings),
        stretch_max: SlaveConfig::of_mode(mode).stretch_max,
        samples_per_command: 1,
        ..WorldConfig::default()
    }
}
