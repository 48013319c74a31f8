"""What `mmt.read` promises, beside a reader of somebody else's."""

import pathlib

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.msg import get_types_from_msg

import mmt


def by_rosbags(path: pathlib.Path) -> dict[str, list]:
    """The messages of each topic of mmt's, as rosbags reads them."""
    store, found = get_typestore(Stores.ROS2_JAZZY), {}
    with Reader(path) as reader:
        for connection in reader.connections:
            if connection.msgtype.startswith("mmt_msgs/"):
                store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for connection, _, data in reader.messages():
            if connection.msgtype.startswith("mmt_msgs/"):
                found.setdefault(connection.topic, []).append(store.deserialize_cdr(data, connection.msgtype))
    return found


def plain(value) -> str:
    """A value in words that are equal for equal bits."""
    if hasattr(value, "nanosec"):
        return repr(value.sec * 10**9 + value.nanosec)
    if isinstance(value, np.ndarray):
        value = bytes(value) if value.dtype == np.uint8 else value.tolist()
    return repr(value)


def rows(columns: dict[str, list]) -> list[tuple[str, ...]]:
    """Rows in one order: that of the file is not that of the stamps, by which rosbags goes."""
    return sorted(zip(*([plain(value) for value in column] for column in columns.values())))


def test_every_column_is_what_rosbags_reads(recorded):
    record, theirs = mmt.read(recorded), by_rosbags(recorded)
    assert not record.cut_off
    assert set(record.topics) == set(theirs)
    assert {"/master/ticks", "/slave/ticks", "/master/packets", "/slave/arrivals"} <= set(theirs)
    for topic, messages in theirs.items():
        names = [name for name in record[topic] if name != "time"]
        listed = {name: record[topic][name] for name in names}
        own = {name: column if isinstance(column, list) else column.tolist() for name, column in listed.items()}
        other = {name: [getattr(message, name) for message in messages] for name in names}
        assert len(messages) > 0 and rows(own) == rows(other), topic
    assert len(theirs["/master/ticks"]) > 100


def test_times_begin_with_the_record(recorded):
    record = mmt.read(recorded)
    first = min(columns["time"].min() for columns in record.topics.values())
    assert first == 0.0
    ticks = record["/master/ticks"]
    assert 1.0 < ticks["time"][-1] - ticks["time"][0] < 60.0
    assert ticks["time"].dtype == np.float64 and "topics" in repr(record)


def test_a_session_that_ended_in_the_middle_is_read_up_to_there(recorded, tmp_path):
    whole = mmt.read(recorded)
    content = recorded.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) // 2])
    half = mmt.read(str(cut))
    assert half.cut_off
    there, all_ticks = half["/slave/ticks"]["f_s_x_n"], whole["/slave/ticks"]["f_s_x_n"]
    assert 0 < len(there) < len(all_ticks)
    assert np.array_equal(there, all_ticks[: len(there)], equal_nan=True)


def test_what_is_no_record_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="none.mcap"):
        mmt.read(tmp_path / "none.mcap")
    text = tmp_path / "text.mcap"
    text.write_text("this is no record at all, whatever its name says")
    with pytest.raises(ValueError, match="text.mcap"):
        mmt.read(text)
    with pytest.raises(KeyError):
        text.write_bytes(b"")
        mmt.read(text)["/master/ticks"]
