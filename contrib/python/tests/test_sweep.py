"""What `mmt.sweep` promises."""

import pathlib
import signal
import subprocess
import threading

import numpy as np
import pytest

import mmt

PLAN = """
duration_s = 2.0
seeds = { first = 4, count = 2 }

[base]
slave.environment.mass_kg = 0.9

[[axis]]
key = "slave.trigger.scheme"
values = ["deadband 10%", "useful 10% 150ms"]

[[axis]]
keys = ["up", "down"]
values = [["none", "none"], ["delay 20ms loss 1%", "delay 20ms loss 1%"]]

[[axis]]
key = "slave.environment.friction_coefficient"
values = [0.2, 0.4]
"""


def bytes_of(folder: pathlib.Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in ["plan.toml", "results.csv"]}


@pytest.fixture(scope="module")
def whole(program, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    plan = folder / "of.toml"
    plan.write_text(PLAN)
    subprocess.run([program, "sweep", str(plan), "--out", str(folder / "cli")], check=True, capture_output=True)
    return folder


def test_a_sweep_leaves_the_bytes_of_the_command(whole, tmp_path):
    table = mmt.sweep(PLAN, tmp_path / "py")
    assert bytes_of(tmp_path / "py") == bytes_of(whole / "cli")
    parts = {part.name for part in (tmp_path / "py" / "rows").iterdir()}
    assert parts == {part.name for part in (whole / "cli" / "rows").iterdir()}
    # one that the command has begun is gone on with: nothing is left to be done
    again = mmt.sweep(whole / "of.toml", whole / "cli")
    assert {name: list(column) for name, column in again.items() if name == "digest"} == {"digest": list(table["digest"])}


def test_the_table_has_the_rows_in_their_order(tmp_path):
    table = mmt.sweep(PLAN, tmp_path, jobs=2)
    assert list(table)[:6] == ["row", "slave.trigger.scheme", "up", "down", "slave.environment.friction_coefficient", "seed"]
    assert np.array_equal(table["row"], np.arange(1, 17)) and table["row"].dtype == np.uint64
    assert np.array_equal(table["seed"], [4, 5] * 8)
    assert list(table["slave.trigger.scheme"]) == ["deadband 10%"] * 8 + ["useful 10% 150ms"] * 8
    assert np.array_equal(table["slave.environment.friction_coefficient"], [0.2, 0.2, 0.4, 0.4] * 4)
    assert table["pmse"].dtype == np.float64 and np.isnan(table["recovered"]).all()
    config = {"slave.environment.mass_kg": 0.9, "slave.environment.friction_coefficient": 0.4, "slave.trigger.scheme": "useful 10% 150ms"}
    assert mmt.run(config, duration=2.0, seed=5).digest == table["digest"][11]


def test_shards_come_to_the_same_bytes(whole, tmp_path):
    first = mmt.sweep(PLAN, tmp_path, shard="1/3")
    assert list(first["row"]) == [1, 4, 7, 10, 13, 16] and not (tmp_path / "results.csv").exists()
    for shard in ["3/3", "2/3"]:
        mmt.sweep(PLAN, tmp_path, shard=shard, jobs=1)
    assert bytes_of(tmp_path) == bytes_of(whole / "cli")


def test_a_plan_may_be_a_dict_over_a_configuration(tmp_path):
    plan = {
        "duration_s": 1.0,
        "seeds": {"count": 1},
        "axis": [{"key": "up", "values": ["none", "delay 20ms"]}],
    }
    table = mmt.sweep(plan, tmp_path, config={"slave.environment.mass_kg": 1.4})
    assert len(table["row"]) == 2
    assert table["digest"][0] == mmt.run({"slave.environment.mass_kg": 1.4}, duration=1.0, seed=1).digest


def test_what_is_wrong_is_said(tmp_path):
    with pytest.raises(ValueError, match="line 5, column 1"):
        mmt.sweep(PLAN.replace("mass_kg = 0.9", "mass_kg = -1"), tmp_path)
    with pytest.raises(FileNotFoundError):
        mmt.sweep(tmp_path / "none.toml", tmp_path)
    with pytest.raises(ValueError, match="2/8"):
        mmt.sweep(PLAN, tmp_path, shard="4/3")
    with pytest.raises(ValueError, match="jobs"):
        mmt.sweep(PLAN, tmp_path, jobs=0)
    with pytest.raises(ValueError, match="line 1"):
        mmt.sweep(PLAN, tmp_path, config={"slave.environment.mass_kg": -1.0})
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError):
        mmt.sweep(PLAN, tmp_path / "file")
    assert not (tmp_path / "rows").exists()
    mmt.sweep(PLAN, tmp_path, shard="1/16")
    with pytest.raises(ValueError, match="another plan"):
        mmt.sweep(PLAN.replace("0.9", "0.8"), tmp_path)


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_keeps_what_is_done(tmp_path):
    long = PLAN.replace("count = 2", "count = 500")
    timer = threading.Timer(1.5, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        mmt.sweep(long, tmp_path)
    timer.join()
    (part,) = (tmp_path / "rows").iterdir()
    done = [line for line in part.read_text().splitlines() if line[0].isdigit()]
    assert done
    table = mmt.sweep(PLAN.replace("count = 2", "count = 500"), tmp_path, shard="4000/4000", jobs=1)
    assert len(done) <= len(table["row"]) <= len(done) + 1
