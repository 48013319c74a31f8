//! Words that the inputs of a target are made of.

pub(in crate::fuzz) const REPORT_WORDS: &[&str] = &[
    "\"session\":", "\"drops\":{", "\"updates\":", "\"timing\":", "\"outgoing\":{\"expected\":", "\"received\":", "\"ticks\":",
    "\"skipped\":", "\"rtt_ms\":{\"p50\":", "\"unsent\":", "\"unread\":", "null", "\"\\u001b[2J\":", "{", "}", ",",
    "\"model\":{\"mass_kg\":{\"estimate\":",
];
pub(in crate::fuzz) const INVERSE3_WORDS: &[&str] = &[
    "{\"inverse3\":[", "{\"device_id\":\"049D\",\"state\":{", "\"cursor_position\":{\"x\":", ",\"y\":", ",\"z\":",
    "\"cursor_velocity\":", "\"wireless_verse_grip\":[{\"state\":{\"buttons\":{\"a\":true", "\"verse_grip\":[{\"state\":{\"button\":true}}]",
    "}}]}", "]}", "\n", "{}", "null", "1e400",
];
pub(in crate::fuzz) const PAGE_WORDS: &[&str] = &[
    "{\"press\":[", "{\"move\":[[", "]]}", "]}", "\"release\"", "{\"clock\":", "}", "{\"drive\":\"scripted\"}", "{\"drive\":\"pointer\"}",
    "{\"pause\":true}", "{\"pause\":false}", "\"take\"", "\"leave\"", "\"stop\"", "\"clear\"", "\"end\"", "{\"network\":{\"up\":\"none\"}}",
    "{\"restart\":{\"mass_kg\":", "{\"study\":{\"answer\":7}}", "\n", ",", "1e308", "-1e308", "1.7e308",
];
pub(in crate::fuzz) const PAIRING_WORDS: &[&str] = &[
    "mmt://", "?pin=", "&token=", "&pin=", "?token=", "[::1]", "[2001:db8::1%eth0]", "192.0.2.1", "192.0.2.256", ":4433", ":0", ":65536",
    ":+80", "example.org", "-a", "a-", "_", "&", "?", " ", "::", "a.b.c", "%20", "@",
];
pub(in crate::fuzz) const SCHEME_WORDS: &[&str] = &[
    "deadband ", "hybrid ", "timer ", "every-sample", "dis ", "useful ", "adaptive ", "10%", "0.1%", "100%", "150ms", "1s", "60s", "0.3N",
    "none", "10ms 30ms", "1/8", "2/8", " ", "1e-3ms", "0.001N", "inf", "nan",
];
pub(in crate::fuzz) const LINK_WORDS: &[&str] = &[
    "delay ", "loss ", "loss gemodel ", "loss state ", "loss burst ", "loss every ", "loss list ", "outage ", " for ", " every ", "order free",
    "order fifo", "reorder ", "gap ", "duplicate ", "corrupt ", "mtu ", "rate ", "rate trace opportunities", "queue ", "codel ", "cross ",
    " poisson ", "slot ", "slot distribution ", "packets ", "bytes ", "ecn", "limit ", "trace path", " up", " down", "seed ", "preset ", "none",
    "; at ", " over ", "; loop ", "; then ", "distribution ", "normal", "pareto", "paretonormal", "lognormal", "gamma", "uniform", "table table",
    "delay cdf cdf", "delay cdf 40ms@0%,50ms@90%,200ms@100%", "tau ", "50ms", "1ns", "1h", "3600s", "1%", "100%", "0.0000001%", "1mbit", "1tbit",
    "100p", "64kb", "drop-head", "starlink", "lte", "wifi",
];
pub(in crate::fuzz) const TRACE_WORDS: &[&str] = &[
    "# mmt netem path 1\n", "at_ns,delay_ns\n", "# mmt netem record 1\n", "timestamp,rtt\n", "timestamp,rtt,uplink,downlink\n", "PING ", "[1700182800.1] ",
    "icmp_seq=", " time=", "{\"round_trips\":[", "\"lost\":\"true\"", "\"true_up\"", "\"monotonic\":", "\"wall\":", "\"rtt\":", "\"send\":", "\"receive\":",
    "\n", ",", "-1", "icmp_seq=100000 ", "up,", "down,", ",sent,", ",dropped,loss",
];
pub(in crate::fuzz) const NUMBER_WORDS: &[&str] = &["\n", " ", ",", "#", "1", "0.5", "100", "-1e11", "1e11", "1e-9", "2", "3", "\t", ";", "1 0 0 0"];
pub(in crate::fuzz) const RECORD_WORDS: &[&str] = &[
    "# mmt netem record 1\n", "# seed ", "# up ", "# down ", "up,", "down,", ",sent,", ",copy,", ",dropped,", "corrupt", "socket", "loss", "queue", "\n", ",,",
    "mmtnetem2\n", "mmtnetem1\n",
];
pub(in crate::fuzz) const IDENTITY_WORDS: &[&str] = &[
    "token: ", "-----BEGIN PRIVATE KEY-----", "-----END PRIVATE KEY-----", "-----BEGIN CERTIFICATE-----", "-----END CERTIFICATE-----", "\n", "=", "A", "MC4CAQ",
];
pub(in crate::fuzz) const SETTING_WORDS: &[&str] = &[
    "\"earlier\":null", "\"bodies\":[", "\"samples_per_command\":", "\"delay_ms\":", "\"force_max_n\":", "\"step_max_n\":", "\"link\":true", "\"mass_kg\":",
    "\"latency_ms\":", "\"rate_hz\":", "\"tool_compliance\":{\"stiffness_n_per_m\":", "\"vertices_m\":[[", "null", "true", "\"paper\"", "{", "}", "]", ",",
];
pub(in crate::fuzz) const CONFIG_WORDS: &[&str] = &[
    "seed = ", "mode = \"paper\"\n", "mode = \"recommended\"\n", "[slave]\n", "[slave.environment]\n", "[environment]\n", "mass_kg = ", "friction_coefficient = ",
    "side_m = ", "shape = { disc = { diameter_m = 0.2 } }\n", "shape = { polygon = { vertices_m = [[0, 0], [0.3, 0], [0, 0.3]] } }\n", "[[bodies]]\n",
    "[[slave.scene.bodies]]\n", "[[walls]]\n", "pose = { position = [0.5, 0.1], angle = 0.4 }\n", "fixed = true\n", "distance_m = ", "angle_rad = ",
    "[sensing.vision]\n", "rate_hz = ", "latency_ms = ", "[playout]\n", "delay_ms = ", "[trigger]\nscheme = \"", "deadband 5%\"\n", "up = \"", "down = \"",
    "delay 50ms 5ms loss 1%\"\n", "samples_per_command = ", "repeats_ms = [", "stretch_max = ", "duration_s = ", "seeds = { count = ", "[base]\n", "[[axis]]\n",
    "key = \"", "values = [", "keys = [\"up\", \"down\"]\n", "slave.", ".", "a.", "\"", "]\n", "}\n", "\n", "[change]\nafter_pushes = 1\ncontact_s = ",
    "patches = [", "ripple = { share = 0.1, period_m = 0.01 }\n", "stiffness_n_per_m = ", "[operator]\n", "inf", "nan", "[", "{", "a={",
];
pub(in crate::fuzz) const DEVICE_WORDS: &[&str] = &[
    "axes = [\"x\", \"-z\"]\n", "centre_m = [0, 0.1, ", "scale = ", "workspace_m = ", "speed_max_m_per_s = ", "force_max_n = ", "step_max_n = ",
    "stiffness_n_per_m = ", "stiffness_max_n_per_m = ", "playout_ms = ", "silence_ms = ", "hold = \"rest\"\n", "hold = \"button\"\n", "button = ",
    "dialect = \"values\"\n", "version = \"2\"\n", "torque_max_nm = ", "\n", "nan", "inf",
];
