"""Reads a record of mmt by two decoders that know nothing of mmt, and prints what they found as one JSON document.

Usage: read_record.py FILE.mcap

mcap-ros2-support decodes each message by the schema in the file; rosbags opens the file as a bag of ROS 2 and decodes it by
its own typesystem. Both must agree on every number of every message.
"""

import json
import math
import sys
from dataclasses import is_dataclass
from pathlib import Path

import numpy
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore


def plain(value):
    """A decoded value of either decoder as plain numbers, texts, lists and dictionaries."""
    if isinstance(value, (bytes, bytearray, memoryview)):
        return list(bytes(value))
    if isinstance(value, numpy.ndarray):
        return [plain(part) for part in value.tolist()]
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    if isinstance(value, float):
        return None if math.isnan(value) else value
    if isinstance(value, (bool, int, str)):
        return value
    if is_dataclass(value):
        names = [name for name in value.__dataclass_fields__ if name != "__msgtype__"]
    else:
        names = list(value.__slots__)
    # constants stand in capitals beside the fields
    return {name: plain(getattr(value, name)) for name in names if not name.isupper()}


def by_schema(path):
    """Topic, time and message, by the schemas in the file."""
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2", reader.get_header()
        for _, channel, message, decoded in reader.iter_decoded_messages():
            yield channel.topic, message.log_time, plain(decoded)


def as_bag(path):
    """The same, as a bag of ROS 2."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([Path(path)], default_typestore=store) as reader:
        for connection, time, raw in reader.messages():
            yield connection.topic, time, plain(reader.deserialize(raw, connection.msgtype))


def main():
    path = sys.argv[1]
    of_schema, of_bag = {}, {}
    for found, decoder in ((of_schema, by_schema), (of_bag, as_bag)):
        for topic, time, message in decoder(path):
            found.setdefault(topic, []).append((time, message))
    assert of_schema.keys() == of_bag.keys(), (of_schema.keys(), of_bag.keys())
    messages = 0
    for topic, theirs in of_schema.items():
        # of one moment either may come first
        theirs.sort(key=lambda one: (one[0], json.dumps(one[1])))
        others = sorted(of_bag[topic], key=lambda one: (one[0], json.dumps(one[1])))
        assert theirs == others, f"{topic}: the decoders differ"
        messages += len(theirs)
    print(
        json.dumps(
            {
                "messages": messages,
                "topics": {topic: len(found) for topic, found in sorted(of_schema.items())},
                "last": {topic: found[-1][1] for topic, found in sorted(of_schema.items())},
            }
        )
    )


main()
