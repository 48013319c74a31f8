//! Keys without an effect are refused, with what to do; keys that one row reads are taken.

use crate::layers::{Layers, Program};
use crate::sweep::Plan;

const HEAD: &str = "duration_s = 1\nseeds = { count = 2 }\n";
const BODIES: &str = "slave.scene.bodies = [{ mass_kg = 0.6 }]";

fn complaint(rest: &str) -> String {
    let refused = Plan::parse(&format!("{HEAD}{rest}"));
    refused.map_or_else(|error| error.to_string(), |_| String::new())
}

/// Checks that a base of these lines is refused for the key in the last of them, with these words.
fn refuses(lines: &[&str], words: &str) {
    let last = lines.last().unwrap();
    let key = last.split_once(" = ").unwrap().0;
    let complaint = complaint(&format!("[base]\n{}\n", lines.join("\n")));
    let line = format!("line {}, column 1", 3 + lines.len());
    // the caret is below the last part of the key
    let caret = format!("| {}^", " ".repeat(key.rfind('.').map_or(0, |at| at + 1)));
    for part in [
        line.split(',').next().unwrap(),
        &caret,
        &format!("`{key}` has no effect"),
        words,
    ] {
        assert!(
            complaint.contains(part),
            "{part} is missing in: {complaint}"
        );
    }
}

#[test]
fn what_no_run_reads_is_refused_with_what_to_do() {
    refuses(
        &["slave.environment.coupling.stiffness_n_per_m = 500.0"],
        "give `stiffness_n_per_m`",
    );
    refuses(&["slave.plant.link = true"], "plugged into virtual time");
    refuses(
        &["slave.estimator.recommended.recursive.prior = [0.5, 0.0, 1.0]"],
        "give it there",
    );
}

#[test]
fn what_another_key_makes_idle_is_refused_and_with_the_other_value_taken() {
    let body = "slave.environment.side_m = 0.3";
    let disc = "slave.environment.shape = { disc = { diameter_m = 0.3 } }";
    let sized = "slave.sensing.vision.size_noise_m = 0.001";
    #[rustfmt::skip]
    let cases: &[(&[&str], &str, &[&str])] = &[
        (&["operator.nudge_m = 0.05"], "dwell_s", &["operator.dwell_s = 1.0"]),
        (&["operator.hand.tremor_m = 0.0", "operator.hand.tremor_hz = 5.0"], "tremor_m", &[]),
        (&[BODIES, body], "slave.scene.bodies", &[]),
        (&[BODIES, "slave.environment.pose.angle = 0.1"], "slave.scene.bodies", &[]),
        (&[disc, body], "only a square", &[]),
        (&["slave.scene.contact_friction = 0.5"], "meets nothing", &["slave.environment.wall = { distance_m = 0.3, angle_rad = 0.0 }"]),
        (&["slave.sensing.vision.rate_hz = 0.0", "slave.sensing.vision.latency_ms = 10.0"], "no images", &[]),
        (&[sized, "slave.start.side_m = 0.3"], "images show", &[]),
        (&["slave.trigger.timer_in_free_space = false"], "hybrid", &["slave.trigger.scheme = \"hybrid 10% 150ms\""]),
        (&["slave.trigger.scheme = \"every-sample\"", "slave.trigger.force_floor_n = 1.0"], "no deadband", &[]),
        (&["slave.trigger.metric = \"pose\"", "slave.trigger.judge_sticking = true"], "not the force", &[]),
        (&["architecture = \"tdpa\"", "samples_per_command = 5"], "goes up alone", &[]),
        (&["slave.mode = \"paper\"", "slave.sensing.vision.position_noise_m = 0.01"], "how sure the place is", &["slave.mode = \"paper\"", "slave.sensing.vision.rate_hz = 30.0"]),
        (&["slave.trigger.scheme = \"every-sample\"", "slave.trigger.free_space_error_m = 0.01"], "sent anyway", &[]),
        (&["slave.mode = \"paper\"", "slave.tool_energy.share = 0.5"], "bounded", &["slave.mode = \"paper\"", "slave.tool_energy.bounded = true"]),
        (&["architecture = \"tdpa\"", "slave.tool_energy.share = 0.5"], "of its own", &[]),
        (&["architecture = \"tdpa\"", "slave.tool_energy.bounded = false"], "of its own", &[]),
    ];
    for (lines, words, cure) in cases {
        refuses(lines, words);
        let key = lines.last().unwrap();
        let without = if cure.is_empty() {
            vec![*key]
        } else {
            [cure, &[*key][..]].concat()
        };
        assert_eq!(
            complaint(&format!("[base]\n{}\n", without.join("\n"))),
            "",
            "{key}"
        );
    }
    let in_list =
        "slave.scene.bodies = [{ side_m = 0.3, shape = { disc = { diameter_m = 0.3 } } }]";
    let refused = complaint(&format!("[base]\n{in_list}\n"));
    assert!(
        refused.contains("`slave.scene.bodies.0.side_m` has no effect"),
        "{refused}"
    );
}

#[test]
fn a_time_that_no_scheme_of_the_plan_judges_by_is_refused() {
    let time = "slave.trigger.judged_over = { secs = 1, nanos = 0 }\n";
    let of = |given: &str| complaint(&format!("[base]\n{given}{time}"));
    let scheme = |scheme: &str| format!("slave.trigger.scheme = \"{scheme}\"\n");
    let by_pose = format!(
        "{}slave.trigger.metric = \"pose\"\n",
        scheme("hybrid 10% 150ms")
    );
    assert!(of(&scheme("timer 100ms")).contains("this scheme has no deadband"));
    assert!(of(&by_pose).contains("is not the force"));
    for taken in [
        "",
        &scheme("hybrid 10% 150ms"),
        "slave.trigger.metric = \"pose\"\n",
    ] {
        assert_eq!(of(taken), "", "{taken}");
    }
}

#[test]
fn a_key_that_one_row_reads_is_taken_and_one_that_none_reads_is_not() {
    let schemes = |values: &str| {
        format!(
            "[base]\nslave.trigger.timer_in_free_space = false\n[[axis]]\nkey = \"slave.trigger.scheme\"\nvalues = [{values}]\n"
        )
    };
    assert_eq!(
        complaint(&schemes("\"deadband 10%\", \"hybrid 10% 150ms\"")),
        ""
    );
    let refused = complaint(&schemes("\"deadband 10%\", \"every-sample\""));
    assert!(
        refused.contains("line 4") && refused.contains("no effect"),
        "{refused}"
    );
    let axis = "[[axis]]\nkey = \"operator.nudge_m\"\nvalues = [0.03, 0.05]\n";
    let refused = complaint(axis);
    assert!(
        refused.contains("line 4, column 7")
            && refused.contains("`operator.nudge_m` has no effect"),
        "{refused}"
    );
}

#[test]
fn a_key_of_base_that_an_axis_gives_in_every_row_is_refused() {
    let base = "[base]\nslave.environment.mass_kg = 1.0\n";
    let axis = |values: &str| {
        format!("{base}[[axis]]\nkey = \"slave.environment\"\nvalues = [{values}]\n")
    };
    let refused = complaint(&axis("{ mass_kg = 0.5 }, { mass_kg = 0.6 }"));
    assert!(
        refused.contains("line 4") && refused.contains("an axis gives it"),
        "{refused}"
    );
    assert_eq!(complaint(&axis("{ mass_kg = 0.5 }, { side_m = 0.3 }")), "");
}

#[test]
fn two_stiffnesses_are_refused_in_a_plan_and_in_a_file_of_virtual_time() {
    let device = "stiffness_n_per_m = 500.0\n";
    let model = "settings.coupling.stiffness_n_per_m = 1000.0\n";
    let refused = complaint(&format!("[base]\n{device}{model}"));
    assert!(
        refused.contains("line 4, column 1") && refused.contains("leave one of them out"),
        "{refused}"
    );
    let over_file = Plan::parse_over(&format!("{HEAD}[base]\n{device}"), model);
    assert!(over_file.unwrap_err().to_string().contains("line 4"));
    let file = format!("{device}{model}");
    let layers = |program, file| Layers {
        program,
        file,
        flags: &[],
        seed: None,
    };
    let refused = layers(Program::Sweep, &file)
        .config()
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("line 1") && refused.contains("another k_p"),
        "{refused}"
    );
    assert!(
        layers(Program::Demo, &file).config().is_ok(),
        "a demo does not read settings"
    );
    let equal = file.replace("500", "1000");
    assert!(layers(Program::Sweep, &equal).config().is_ok());
}
