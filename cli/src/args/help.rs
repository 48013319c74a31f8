//! The prose and the examples of `--help`.

/// One line on the whole.
pub(super) const ABOUT: &str = "Model-mediated teleoperation: feel a box that stands far away without the network in your hand";

/// Below the list of commands.
pub(super) const AFTER: &str = "\
Examples:
  mmt demo                                     20 s on this machine, real sockets, emulated network
  mmt slave --listen 0.0.0.0:4433              on the host with the object: prints a pairing string
  mmt master 'mmt://HOST:4433?pin=…&token=…'   on the host with the hand
  mmt reproduce fig5                           the paper's fig. 5, in virtual time

Data goes to stdout, messages to stderr. MMT_LOG=debug shows more messages.
Exit codes: 0 ok, 1 failed, 2 wrong input, 3 refused, 4 no answer, 5 address not to be had,
130 interrupted twice.";

/// Examples of `mmt demo`.
pub(super) const DEMO: &str = "\
Examples:
  mmt demo
  mmt demo --duration 60s --netem \"delay 200ms 20ms distribution normal loss 5%\"
  mmt demo --netem-up \"preset 5g-up\" --netem-down \"preset 5g-down\" --netem-record run.csv
  mmt demo --mode paper --scheme \"hybrid 10% 150ms\"
  mmt demo --json > report.json

q or Ctrl-C ends it; the table comes at the end.";

/// Examples of `mmt slave`.
pub(super) const SLAVE: &str = "\
Examples:
  mmt slave --listen 0.0.0.0:4433 --advertise robot.example.org
  mmt slave --listen 127.0.0.1:0 --once --json
  mmt slave --listen [::]:4433 --mode paper --scheme \"deadband 10%\" --netem \"delay 50ms 5ms loss 1%\"

stdout: the pairing string, alone on the first line; with --json the report after the last session.
The pairing string is a secret: whoever has it can operate this slave.

Schemes: \"deadband 10%\", \"hybrid 10% 150ms\", \"timer 150ms\", every-sample, \"dis 0.3N 1s\",
\"useful 10% 150ms\", \"adaptive 10% 50ms\".";

/// Examples of `mmt master`.
pub(super) const MASTER: &str = "\
Examples:
  mmt master 'mmt://192.0.2.1:4433?pin=…&token=…' --duration 20s
  mmt master - < pairing.txt
  mmt master 'mmt://…' --operator trace:path.csv --device falcon
  mmt master 'mmt://…' --operator trace:black-patch.txt --push 3

A trace ends in .csv (t_s,x_m,y_m) or holds recorded pushes; it is carried to start in front of the
object's west face. Quotes around the pairing string keep the shell from ending the command at the &.";

/// Examples of `mmt netem`.
pub(super) const NETEM: &str = "\
Examples:
  mmt netem --listen 0.0.0.0:4434 --to 192.0.2.1:4433 --up \"delay 50ms 5ms\" --down \"loss 1%\"
  mmt netem --listen [::]:4434 --to 192.0.2.1:4433 --up \"preset 5g-up\" --record run.csv
  mmt netem --listen 127.0.0.1:0 --to localhost:4433 --down \"delay 80ms order free\" --json
  mmt netem report run.csv

Masters use the slave's pairing string with the relay's address in it. Other UDP goes through, too.

The words of tc netem and more, in any order:
  delay TIME [JITTER [PERCENT | tau TIME] [distribution SHAPE]]
      SHAPE: uniform, normal, lognormal, gamma, pareto, paretonormal, table FILE
  delay cdf FILE [tau TIME]             a measured distribution
  order free, reorder PERCENT [gap N]   jitter keeps the order unless told otherwise
  slot TIME [TIME] [packets N]          packets leave in batches
  loss PERCENT, loss burst PERCENT TIME, loss gemodel P [R [1-H [1-K]]],
  loss state P13 [P31 [P32 [P23 [P14]]]], loss every N, loss list 3,17,100-120
  ecn                                   mark instead of losing what says that it understands
  outage TIME for TIME [every TIME]
  duplicate PERCENT, corrupt PERCENT, mtu BYTES, limit PACKETS
  rate RATE [OVERHEAD], rate trace FILE, queue 64kb 50p 20ms, codel [TARGET INTERVAL]
  trace FILE [up | down]                a recorded path: irtt, ping -D, LENS, a record of mmt
  preset NAME                           lan, wifi, 4g, 5g, 5g-up, 5g-down, starlink, geo,
                                        transatlantic, paper
  ; at TIME [over TIME] WORDS           these settings from then on; over: step by step
  ; loop TIME                           and again

stderr: what the words will really do. stdout: the address that the relay listens on, alone on the
first line; at the end the counters.";

/// Examples of `mmt replay`.
pub(super) const REPLAY: &str = "\
Examples:
  mmt replay black-patch.txt
  mmt replay --deadband 5% --t-update none *.txt
  mmt replay --splits 100 wood-patch.txt
  mmt replay --json wood-patch.txt > report.json";

/// Examples of `mmt reproduce`.
pub(super) const REPRODUCE: &str = "\
Examples:
  mmt reproduce fig5
  mmt reproduce all --out figures
  mmt reproduce fig5 --seeds 1 --duration 10s --samples --out trial
  mmt reproduce physics --mass 1.4 --mu 0.2

Every run is a function of its configuration and seed: the files are the same, byte for byte, on every
machine and with any number of threads. manifest.json says what was run and holds the files' SHA-256.";

/// Examples of `mmt sweep`.
pub(super) const SWEEP: &str = "\
Examples:
  mmt sweep plan.toml --dry-run
  mmt sweep plan.toml --out loss
  mmt sweep plan.toml --out loss --shard 2/8 --jobs 4
  mmt sweep plan.toml --out loss --merge

A plan:
  duration_s = 30
  seeds = { first = 1, count = 10 }
  [base]
  slave.mode = \"paper\"
  [[axis]]
  key = \"slave.trigger.scheme\"
  values = [\"deadband 10%\", \"hybrid 10% 150ms\"]

results.csv is the same, byte for byte, however the rows are cut into shards, threads and runs. Ctrl-C keeps
what is done; the same command goes on. Exit code 1: rows are missing. docs/sweep.md tells everything.";

/// Examples of `mmt bench`.
pub(super) const BENCH: &str = "\
Examples:
  mmt bench transport
  mmt bench transport --rate 150 --size 180
  mmt bench transport --cores any
  mmt bench transport --duration 5min --json > transport.json

Bare sockets, raw UDP and QUIC take turns. Real time: repeat it, and compare within one run only.";
