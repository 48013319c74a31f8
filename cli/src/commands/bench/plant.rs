//! `mmt bench plant`: how well an object is felt over an emulated network, in virtual time: the simulated one, or a plant of
//! somebody else's that computes in lock-step.

use std::fmt;

use mmt_lab::layers::Program;
use mmt_lab::world::{World, WorldConfig};
use mmt_server::io::plant_link::LockStep;
use serde::Serialize;

use crate::args::PlantBenchArguments;
use crate::commands::slave::plant_failure;
use crate::config::{Flags, configuration};
use crate::failure::Failure;
use crate::output::{note, print, print_json};
use crate::stop::Stop;

/// What a run came to; a number that is not known is null.
#[derive(Debug, Serialize)]
struct Document {
    version: &'static str,
    command: &'static str,
    plant: &'static str,
    network: String,
    scheme: String,
    seed: u64,
    duration_s: f64,
    contact_s: f64,
    packets: u64,
    packets_per_s: Option<f64>,
    packets_per_contact_s: Option<f64>,
    force_error_rms_n: Option<f64>,
    force_relative_error: Option<f64>,
    pmse: Option<f64>,
    largest_force_n: Option<f64>,
    energy_injected_j: f64,
    /// m, b and c as estimated last.
    estimate: [f64; 3],
    /// The true ones; of a plant nobody knows them.
    truth: Option<[f64; 3]>,
    /// How far and by how much the object has moved, m and rad.
    moved_m: f64,
    turned_rad: f64,
    /// SHA-256 of all that either side felt or sent.
    digest: String,
}

/// Runs `mmt bench plant`.
///
/// # Errors
/// Wrong input, no plant, or one that went away.
pub(super) fn run(arguments: &PlantBenchArguments) -> Result<(), Failure> {
    let flags = Flags::default().set("--scheme", &["slave.trigger.scheme"], arguments.scheme);
    let path = arguments.config.as_deref();
    let mut slave = configuration(Program::Slave, path, &flags)?.slave;
    slave.plant.link = arguments.plant.is_linked(slave.plant.link)?;
    let linked = slave.plant.link;
    let config = WorldConfig {
        slave,
        ..WorldConfig::over(arguments.netem.clone())
    };
    let config = config.seeded(arguments.seed);
    let mut world = World::try_new(&config).map_err(Failure::usage)?;
    let stop = Stop::on_signals()?;
    let mut plant = None;
    if linked {
        plant = plugged_in(arguments, &stop)?;
        if plant.is_none() {
            return Ok(());
        }
    }
    let ticks = arguments.duration.as_millis();
    for _ in 0..ticks {
        if let (Some(plant), Some(command)) = (&mut plant, world.plant_command()) {
            let answer = plant.exchange(&command).map_err(Failure::failed)?;
            world.answer_of_plant(answer);
        }
        world.step();
        if stop.asked() {
            break;
        }
    }
    let document = document(arguments, &config, &world);
    if arguments.json {
        print_json(&document)
    } else {
        print(document)
    }
}

/// A plant, once one is plugged in; none if somebody ends the command before.
fn plugged_in(arguments: &PlantBenchArguments, stop: &Stop) -> Result<Option<LockStep>, Failure> {
    let plant = LockStep::start(arguments.plant.listen()?);
    let mut plant = plant.map_err(plant_failure)?;
    note(format_args!("plant: {}", plant.address()));
    note("waiting for a plant");
    while !plant.wait() {
        if stop.asked() {
            return Ok(None);
        }
    }
    Ok(Some(plant))
}

fn document(arguments: &PlantBenchArguments, config: &WorldConfig, world: &World) -> Document {
    let (outcome, force, slave) = (world.outcome(), world.force(), world.slave());
    let (estimate, environment) = (slave.estimate(), slave.environment());
    let [m, b, c, ..] = environment.truth().to_array();
    let pose = environment.pose();
    let start = config.slave.environment.pose;
    Document {
        version: env!("CARGO_PKG_VERSION"),
        command: "bench plant",
        plant: if slave.is_linked() { "link" } else { "world" },
        network: arguments.netem.to_string(),
        scheme: config.slave.trigger.scheme.to_string(),
        seed: arguments.seed,
        duration_s: outcome.updates.duration_s(),
        contact_s: outcome.updates.contact_s(),
        packets: outcome.updates.total(),
        packets_per_s: outcome.updates.rate_hz(),
        packets_per_contact_s: outcome.updates.contact_rate_hz(),
        force_error_rms_n: force.error_rms_n,
        force_relative_error: force.relative_error,
        pmse: force.pmse,
        largest_force_n: outcome.on_hand.largest_n(),
        energy_injected_j: outcome.energy_injected_j,
        estimate: [estimate.m, estimate.b, estimate.c],
        truth: (!slave.is_linked()).then_some([m, b, c]),
        moved_m: (pose.position - start.position).norm(),
        turned_rad: pose.angle - start.angle,
        digest: world.digest(),
    }
}

impl fmt::Display for Document {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number =
            |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        let three = |[m, b, c]: [f64; 3]| format!("m {m:.3} kg, b {b:.3} N s/m, c {c:.3} N");
        writeln!(f, "{}, {}, {}", self.plant, self.scheme, self.network)?;
        writeln!(
            f,
            "  contact           {:.1} of {:.1} s",
            self.contact_s, self.duration_s
        )?;
        writeln!(
            f,
            "  packets           {}, {} a second, {} a second of contact",
            self.packets,
            number(self.packets_per_s),
            number(self.packets_per_contact_s)
        )?;
        writeln!(
            f,
            "  force error       {} N r.m.s., relative {}, PMSE {}",
            number(self.force_error_rms_n),
            number(self.force_relative_error),
            number(self.pmse)
        )?;
        writeln!(
            f,
            "  largest force     {} N on the hand",
            number(self.largest_force_n)
        )?;
        writeln!(f, "  estimate          {}", three(self.estimate))?;
        if let Some(truth) = self.truth {
            writeln!(f, "  truth             {}", three(truth))?;
        }
        writeln!(
            f,
            "  object            moved {:.3} m, turned {:.3} rad",
            self.moved_m, self.turned_rad
        )?;
        write!(f, "  digest            {}", self.digest)
    }
}
