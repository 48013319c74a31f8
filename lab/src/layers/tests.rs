//! One file for every program, each key with its origin.

use std::collections::BTreeSet;

use mmt_shared::model::settings::Mode;

use super::*;

const MODES: [Mode; 2] = [Mode::Recommended, Mode::Paper];

fn layers<'a>(program: Program, file: &'a str, flags: &'a [Flag]) -> Layers<'a> {
    Layers {
        program,
        file,
        flags,
        seed: None,
    }
}

fn of_mode(mode: Mode) -> Vec<Flag> {
    vec![Flag::new("--mode", "slave.mode", &mode).unwrap()]
}

fn known(program: Program, file: &str, flags: &[Flag], key: &str) -> Known {
    let all = layers(program, file, flags).known().unwrap();
    all.into_iter().find(|known| known.key == key).unwrap()
}

#[test]
fn the_default_file_given_back_changes_nothing_in_any_program() {
    for mode in MODES {
        let text = template(mode).unwrap();
        for program in Program::ALL {
            let flags = of_mode(mode);
            let without = layers(program, "", &flags).config().unwrap();
            assert_eq!(layers(program, &text, &[]).config().unwrap(), without);
        }
    }
}

#[test]
fn what_the_default_file_leaves_out_can_be_taken_in_and_is_the_same_run() {
    for mode in MODES {
        let text = template(mode).unwrap();
        let taken_in = text.lines().map(|line| match line.strip_prefix("# ") {
            Some(line) if line.starts_with('[') => line,
            Some(key) if key.contains(" = ") && !key.contains("(left out)") => key,
            _ => line,
        });
        let text: Vec<&str> = taken_in.collect();
        let config = layers(Program::Sweep, &text.join("\n"), &[])
            .config()
            .unwrap();
        let flags = of_mode(mode);
        let own = layers(Program::Sweep, "", &flags).config().unwrap();
        assert_eq!(whole::whole(&config), whole::whole(&own));
    }
}

#[test]
fn the_default_file_has_every_key_with_unit_and_range() {
    let text = template(Mode::Recommended).unwrap();
    for line in [
        "mass_kg = 0.7  # 0.05 to 50 kg",
        "samples_per_command = 10  # 1 to 32",
        "# up = \"none\"",
        "# [settings]",
        "[slave.environment]",
        "# tool_compliance = (left out)",
        "mode = \"recommended\"  # paper or recommended",
    ] {
        let found = text.lines().any(|other| other.starts_with(line));
        assert!(found, "{line} is not in:\n{text}");
    }
    let whole = whole::whole(&WorldConfig::default());
    let tree = toml::to_string(&whole).unwrap();
    let mut leaves = Vec::new();
    let tree = DeTable::parse(&tree).unwrap();
    leaves_of(tree.get_ref(), "", &mut leaves);
    let known = layers(Program::Sweep, "", &[]).known().unwrap();
    let known: BTreeSet<&str> = known.iter().map(|known| known.key.as_str()).collect();
    for (key, _) in leaves {
        assert!(known.contains(key.as_str()), "{key}");
    }
    for left_out in ["slave.tool_compliance", "slave.environment.contact"] {
        assert!(known.contains(left_out), "{left_out}");
    }
}

#[test]
fn every_number_of_the_default_file_has_a_range_and_none_below_it_is_taken() {
    for mode in MODES {
        let flags = of_mode(mode);
        for known in layers(Program::Sweep, "", &flags).known().unwrap() {
            let value = known.value.as_deref().unwrap_or_default();
            let is_number = value.starts_with(|first: char| first.is_ascii_digit() || first == '[');
            assert!(
                !is_number || !known.in_force || value == "[]" || !known.accepted.is_empty(),
                "{} = {value} has no range",
                known.key
            );
        }
    }
    for (key, value) in [
        ("slave.trigger.force_floor_n", "0"),
        ("slave.trigger.contact.on_n", "-1"),
        ("slave.trigger.contact.off_n", "0.2"),
        ("slave.plant.acceleration_max_m_per_s2", "-1"),
        ("settings.smoothing.in-time.tau_s", "-1"),
    ] {
        let (table, name) = key.rsplit_once('.').unwrap();
        let text = format!("[{table}]\n{name} = {value}\n");
        let error = layers(Program::Sweep, &text, &[])
            .config()
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("line 2") && error.contains("accepted range"),
            "{key}: {error}"
        );
    }
}

#[test]
fn each_value_shows_whether_it_is_the_programs_the_files_or_a_flags() {
    let file = "seed = 5\n[slave.environment]\nmass_kg = 1.5\n[operator]\nhold_s = 0.5\n";
    let network = "delay 9ms".parse().unwrap();
    let flags = [Flag::network("--netem", "up", &network)];
    let origin = |key| known(Program::Master, file, &flags, key).origin;
    assert_eq!(origin("seed"), Origin::File(1));
    assert_eq!(origin("slave.seed"), Origin::File(1));
    assert_eq!(origin("slave.environment.mass_kg"), Origin::File(3));
    assert_eq!(origin("up"), Origin::Flag("--netem"));
    let up = known(Program::Master, file, &flags, "up").value;
    assert_eq!(up.as_deref(), Some("\"delay 9ms\""));
    assert_eq!(origin("down"), Origin::Default);
    let force = |key| known(Program::Master, file, &flags, key).in_force;
    assert!(force("operator.hold_s") && !force("slave.environment.mass_kg"));
    let mass = known(Program::Slave, file, &[], "slave.environment.mass_kg");
    assert_eq!((mass.value.as_deref(), mass.unit), (Some("1.5"), "kg"));
    assert_eq!(mass.accepted, "0.05 to 50");
}

#[test]
fn a_flag_comes_before_the_file_and_the_file_before_the_mode() {
    let file =
        "[slave]\nmode = \"paper\"\nrepeats_ms = [5]\n[slave.trigger]\nscheme = \"timer 50ms\"\n";
    let config = layers(Program::Slave, file, &[]).config().unwrap();
    assert_eq!(
        (config.slave.mode, config.slave.stretch_max.get()),
        (Mode::Paper, 1.0)
    );
    let flags = [
        Flag::new("--mode", "slave.mode", &Mode::Recommended).unwrap(),
        Flag::new("--scheme", "slave.trigger.scheme", &"every-sample").unwrap(),
    ];
    let config = layers(Program::Slave, file, &flags).config().unwrap();
    assert_eq!(
        (config.slave.mode, config.slave.stretch_max.get()),
        (Mode::Recommended, 3.0)
    );
    assert_eq!(config.slave.trigger.scheme.to_string(), "every-sample");
    assert_eq!(config.slave.repeats_ms.to_string(), "5ms");
}

#[test]
fn a_file_of_a_slave_alone_means_what_it_has_always_meant() {
    let file = "seed = 5\nmode = \"paper\"\nstretch_max = 2\n[environment]\nmass_kg = 1.5\n";
    for program in Program::ALL {
        let config = layers(program, file, &[]).config().unwrap();
        let slave = &config.slave;
        assert_eq!(
            (slave.seed, slave.mode, slave.stretch_max.get()),
            (5, Mode::Paper, 2.0)
        );
        assert_eq!(slave.environment.mass_kg, 1.5);
    }
    let twice = "mode = \"paper\"\n[slave]\nmode = \"recommended\"\n";
    let error = layers(Program::Slave, twice, &[])
        .config()
        .unwrap_err()
        .to_string();
    for part in ["line 1, column 1", "`mode` is given twice", "in line 3"] {
        assert!(error.contains(part), "{error}");
    }
    let twice = "seed = 1\n[environment]\nmass_kg = 1\n[slave.environment.contact]\nstiffness_n_per_m = 5e3\n";
    let error = layers(Program::Slave, twice, &[]).config().unwrap_err();
    let error = error.to_string();
    for part in [
        "line 2, column 2",
        "`environment` is given twice",
        "in line 4",
    ] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn what_is_wrong_is_answered_with_line_caret_and_what_was_meant() {
    let refused = |file: &str| {
        layers(Program::Demo, file, &[])
            .config()
            .unwrap_err()
            .to_string()
    };
    let range = refused("[operator]\nhold_s = 0.5\n[slave.environment]\nmass_kg = 1e9\n");
    for part in ["line 4, column 11", "^^^", "0.05 to 50 kg"] {
        assert!(range.contains(part), "{range}");
    }
    let word = refused("[slave.environment]\nmas_kg = 1.0\n");
    for part in ["line 2", "^^^^^^", "did you mean `mass_kg`?"] {
        assert!(word.contains(part), "{word}");
    }
    for (top, meant) in [
        ("mod = \"paper\"\n", "did you mean `mode`?"),
        ("mas_kg = 1.0\n", "`slave.environment.mass_kg` or"),
        ("hold_s = 1.0\n", "did you mean `operator.hold_s`?"),
    ] {
        let error = refused(top);
        assert!(
            error.contains(meant) && error.contains("`trigger`"),
            "{error}"
        );
    }
    let flags = [Flag::new("--repeat-samples", "repeat_samples", &-1).unwrap()];
    assert!(layers(Program::Master, "", &flags).config().is_err());
}

#[test]
fn a_demo_without_a_file_has_its_network_and_a_play_out_for_it() {
    let config = layers(Program::Demo, "", &[]).config().unwrap();
    assert_eq!(config.up.to_string(), DEMO_NETWORK);
    assert_eq!(config.slave.playout.delay_ms, 21.0);
    let given = "up = \"delay 5ms\"\n";
    let config = layers(Program::Demo, given, &[]).config().unwrap();
    assert_eq!(
        (
            config.up.to_string().as_str(),
            config.slave.playout.delay_ms
        ),
        ("delay 5ms", 11.0)
    );
}

#[test]
fn a_start_that_is_not_the_programs_own_lies_below_the_file_and_is_checked_like_it() {
    let over = |start, file| {
        let layers = Layers {
            program: Program::Sweep,
            file,
            flags: &[],
            seed: None,
        };
        layers.config_from(start)
    };
    let paper = over(Start::PaperExperiment, "slave.mode = \"paper\"").unwrap();
    let scheme = "hybrid 10% 150ms".parse().unwrap();
    assert_eq!(paper, crate::setting::paper_world(Mode::Paper, scheme));
    let live = over(Start::Live, "slave.mode = \"paper\"").unwrap();
    assert_ne!(paper.samples_per_command, live.samples_per_command);
    let wrong = over(Start::PaperExperiment, "seed = 2\noperator.push_speed = -1");
    assert!(wrong.unwrap_err().to_string().starts_with("line 2"));
}

#[test]
fn a_stiffness_that_the_device_refuses_is_refused_with_its_place_and_shown_as_given_where_it_has_no_effect()
 {
    let file = "seed = 1\nstiffness_n_per_m = 1e9\n";
    for program in [Program::Demo, Program::Master] {
        let error = layers(program, file, &[]).known().unwrap_err().to_string();
        for part in ["line 2, column 21", "^^^", "50 to 3000 N/m"] {
            assert!(error.contains(part), "{error}");
        }
        let flags = [Flag::new("--stiffness", "stiffness_n_per_m", &40.0).unwrap()];
        let error = layers(program, file, &flags).known().unwrap_err();
        assert_eq!(error.option(), Some("--stiffness"));
        assert!(error.to_string().starts_with("--stiffness: stiffness 40 "));
    }
    let of_slave = known(Program::Slave, file, &[], "stiffness_n_per_m");
    assert_eq!(of_slave.value, Some(toml::Value::Float(1e9).to_string()));
    assert_eq!(of_slave.accepted, "50 to 3000");
}

#[test]
fn a_value_that_was_read_from_a_text_of_its_own_is_refused_with_its_place_there() {
    #[derive(Serialize)]
    struct Scene {
        contact_friction: f64,
        walls: Vec<[f64; 0]>,
    }
    let refused = |file: &str, text: &str, contact_friction: f64| {
        let scene = Scene {
            contact_friction,
            walls: Vec::new(),
        };
        let flag = Flag::new("--scene", "slave.scene", &scene).unwrap();
        let flags = [flag.read_from(text.to_owned())];
        let error = layers(Program::Slave, file, &flags).config().unwrap_err();
        (error.option(), error.to_string())
    };
    let (option, error) = refused("seed = 1\n", "\ncontact_friction = 6.0\n", 6.0);
    assert_eq!(option, Some("--scene"));
    assert!(error.starts_with("line 2, column 20"), "{error}");
    // neither is refused without the other: the first one is to blame
    let file = "[slave.environment]\npose = { position = [1.0, 0.0] }\n";
    let (option, error) = refused(file, "[[walls]]\ndistance_m = 0.5\n", 0.0);
    assert!(option.is_none() && error.starts_with("line 2"), "{error}");
}
