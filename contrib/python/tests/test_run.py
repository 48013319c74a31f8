"""What `mmt.run` promises."""

import math
import pathlib
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import mmt
from conftest import WAN

VECTORS = ["hip", "f_m", "hand_force", "tool", "f_s", "f_s_true", "f_shadow", "f_m_played"]
TRIPLES = ["pose_model", "parameters_model", "pose_true", "parameters_estimate"]


@pytest.fixture(scope="module")
def wan():
    return mmt.run(WAN, duration=8.0, seed=3)


def test_a_row_is_a_millisecond_in_every_array(wan):
    rows = 8000
    assert np.allclose(wan.time, np.arange(1, rows + 1) * 1e-3, atol=1e-12)
    for name in VECTORS:
        assert getattr(wan, name).shape == (rows, 2), name
    for name in TRIPLES:
        assert getattr(wan, name).shape == (rows, 3), name
    for name in ["time", "stamp"]:
        assert getattr(wan, name).shape == (rows,) and getattr(wan, name).dtype == np.float64
    for name in ["touching", "in_contact"]:
        assert getattr(wan, name).shape == (rows,) and getattr(wan, name).dtype == np.bool_
    assert wan.parameters_true.shape == (3,)
    assert "mmt.Run of" in repr(wan)
    assert wan.hip is wan.hip and wan.packets is wan.packets and wan.update is wan.update


def test_the_arrays_are_what_the_metrics_say(wan):
    plays = ~np.isnan(wan.stamp)
    # before the first sample comes there is nothing, and the slave is never ahead
    assert 0.04 < wan.time[plays][0] < 0.2
    assert np.all(wan.stamp[plays] < wan.time[plays])
    assert np.isnan(wan.f_s[~plays]).all()
    assert math.isclose(wan.in_contact.sum() * 1e-3, wan.metrics["contact_s"], abs_tol=1e-9)
    assert np.max(np.hypot(*wan.hand_force.T)) == pytest.approx(wan.metrics["force_peak_n"])
    for cause in ["deadband", "timer", "contact_lost", "slave_only_contact"]:
        assert np.sum(wan.update == cause) == wan.metrics[f"packets_{cause}"]
    assert np.sum(wan.update != "") == wan.metrics["packets"] > 0
    found = wan.parameters_estimate[-1] / wan.parameters_true - 1
    expected = [wan.metrics["m_error"], wan.metrics["b_error"], wan.metrics["c_error"]]
    assert np.allclose(found, expected)


def test_every_packet_has_a_cause_and_a_fate(wan):
    packets = wan.packets
    assert packets.dtype.names == (
        "direction", "number", "kind", "update", "cause", "repeat", "bytes", "sent", "arrived", "fate",
    )
    assert set(packets["direction"]) == {"up", "down"} and set(packets["kind"]) == {"command", "update", "heartbeat"}
    assert np.all(np.diff(packets["sent"]) >= 0)
    for way in ["up", "down"]:
        of = packets[packets["direction"] == way]
        assert np.array_equal(of["number"], np.arange(1, len(of) + 1))
        assert len(of) == round(wan.metrics[f"datagrams_{way}_hz"] * 8)
        assert 0.002 < np.mean(of["fate"] == "loss") < 0.06
    came = packets["fate"] == "delivered"
    assert np.array_equal(came, ~np.isnan(packets["arrived"]))
    delay = packets["arrived"][came] - packets["sent"][came]
    assert 0.045 <= delay.min() and delay.max() <= 0.056
    assert set(packets["fate"]) == {"delivered", "loss", "under_way"}
    updates = packets[(packets["kind"] == "update") & ~packets["repeat"]]
    assert np.all(updates["cause"] != "") and np.all(packets["cause"][packets["kind"] != "update"] == "")
    assert np.sum(packets["repeat"]) == wan.metrics["repeats"]
    assert np.sum(packets["kind"] == "command") == wan.metrics["commands"]


def test_equal_calls_are_equal_and_another_seed_is_another_run(wan):
    again = mmt.run(WAN, duration=8.0, seed=3)
    assert again.digest == wan.digest and np.array_equal(again.f_m, wan.f_m)
    assert mmt.run(WAN, duration=8.0, seed=4).digest != wan.digest


def test_a_configuration_is_a_text_a_path_or_a_dict(tmp_path: pathlib.Path):
    text = 'up = "delay 20ms"\n[slave.environment]\nmass_kg = 1.2\n[slave]\ntool_force_max_n = 12\n'
    place = tmp_path / "mine.toml"
    place.write_text(text)
    nested = {"up": "delay 20ms", "slave": {"environment": {"mass_kg": np.float64(1.2)}, "tool_force_max_n": np.int64(12)}}
    dotted = {"up": "delay 20ms", "slave.environment.mass_kg": 1.2, "slave.tool_force_max_n": 12}
    digests = {mmt.run(given, duration=2.0).digest for given in [text, place, str(place), nested, dotted]}
    assert len(digests) == 1
    assert digests != {mmt.run(duration=2.0).digest}
    assert mmt.run("", duration=2.0).digest == mmt.run({}, duration=2.0).digest == mmt.run(duration=2.0).digest


@pytest.mark.parametrize("start", ["live", "paper-experiment"])
def test_the_configuration_of_a_run_makes_the_same_run(start):
    first = mmt.run(WAN, duration=3.0, start=start, seed=9)
    assert mmt.run(first.config, duration=3.0).digest == first.digest


def test_the_default_configuration_changes_nothing():
    for mode in ["recommended", "paper"]:
        text = mmt.default_config(mode)
        assert mmt.run(text, duration=1.0).digest == mmt.run({"slave.mode": mode}, duration=1.0).digest


def test_a_run_is_the_row_of_a_sweep(program, tmp_path: pathlib.Path):
    plan = tmp_path / "plan.toml"
    plan.write_text('duration_s = 6\nseeds = { first = 5, count = 1 }\nstart = "paper-experiment"\n[base]\nslave.mode = "paper"\n')
    subprocess.run([program, "sweep", str(plan), "--out", str(tmp_path / "out")], check=True, capture_output=True)
    head, row = (tmp_path / "out" / "results.csv").read_text().splitlines()
    there = dict(zip(head.split(","), row.split(",")))
    run = mmt.run({"slave.mode": "paper"}, duration=6.0, start="paper-experiment", seed=5)
    for name, value in run.metrics.items():
        text = "" if value is None else value
        assert there[name] == text or float(there[name]) == value, name


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"slave.environment.mass_kg": -2.0}, ["line 1, column 29", "slave.environment.mass_kg = -2.0", "0.05 to 50"]),
        ("[slave.environment]\nmas_kg = 1", ["line 2, column 1", "did you mean `mass_kg`"]),
        ({"up": "delay 50 parsecs"}, ["line 1", "parsecs"]),
        ({"seed": -1}, ["line 1", "seed = -1"]),
        ({"slave.trigger.scheme": "deadbnd 5%"}, ["deadbnd"]),
        ({"up": {1, 2}}, ["line 1"]),
        ({"up": object()}, ["up:", "no place"]),
        ({"slave": None}, ["slave:", "no place"]),
    ],
)
def test_what_is_wrong_is_named_with_key_line_and_range(given, words):
    with pytest.raises(ValueError) as error:
        mmt.run(given)
    for word in words:
        assert word in str(error.value)


def test_other_refusals_have_their_kind(tmp_path: pathlib.Path):
    with pytest.raises(FileNotFoundError, match="none.toml"):
        mmt.run(tmp_path / "none.toml")
    with pytest.raises(OSError):
        mmt.run(tmp_path)
    with pytest.raises(TypeError, match="TOML"):
        mmt.run(3)
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("seed = -1")
    with pytest.raises(ValueError, match="wrong.toml: line 1"):
        mmt.run(wrong)
    for duration in [0.0, -1.0, math.nan, math.inf, 1e9]:
        with pytest.raises(ValueError, match="0.001 to 604800 s"):
            mmt.run(duration=duration)
    with pytest.raises(ValueError, match="paper-experiment"):
        mmt.run(start="paper")
    with pytest.raises(ValueError, match="recommended"):
        mmt.default_config("best")


def test_a_way_is_gone_whatever_it_feels():
    way = np.stack([np.linspace(0, 0.3, 3000), np.zeros(3000)], axis=1)
    run = mmt.run(duration=4.0, hip=way)
    # a HIP is counted in steps of the wire
    assert np.allclose(run.hip[:3000], way, atol=1e-5)
    assert np.allclose(run.hip[3000:], way[-1], atol=1e-5)
    assert run.in_contact.any() and run.metrics["pushes"] == 0
    assert mmt.run(duration=4.0, hip=way.tolist()).digest == run.digest
    for wrong in [way.T, way[:0], way * np.nan, np.zeros(4)]:
        with pytest.raises((ValueError, TypeError)):
            mmt.run(hip=wrong)
    with pytest.raises(ValueError, match="not both"):
        mmt.run(hip=way, operator=lambda *_: (0.0, 0.0))


def test_other_threads_go_on_while_a_run_goes_on():
    seen, go = [], threading.Event()

    def other():
        go.wait()
        seen.append("other")

    thread = threading.Thread(target=other)
    thread.start()
    interval = sys.getswitchinterval()
    # nobody is interrupted: the other thread comes to its turn only where this one lets go by itself
    sys.setswitchinterval(1000.0)
    try:
        go.set()
        for _ in range(500):
            mmt.run(duration=1.0)
            if seen:
                break
        seen.append("this")
    finally:
        sys.setswitchinterval(interval)
    thread.join()
    assert seen == ["other", "this"]


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_ends_a_run():
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        mmt.run(duration=3600.0)
    timer.join()
