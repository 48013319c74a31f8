"""Of ROS 2's Python interface what contrib/ros_node.py uses, in one process and without ROS; `install()` puts it where imports find it.

The messages are made from ROS 2's own definitions (those of Jazzy, in rosbags), and each goes through ROS 2's encoding (CDR, by rosbags). A field that
a definition does not have and a value of another type are errors, as they are in rclpy.
"""

import queue
import sys
import threading
import time
import types

from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.base import Nodetype

STORE = get_typestore(Stores.ROS2_JAZZY)
PYTHON = {"bool": bool, "string": str, "float64": float, "int32": int, "uint32": int}
classes, topics, overrides = {}, {}, {}


class Message:
    """A message whose fields are those of its definition."""

    NAME, FIELDS, __slots__ = "", {}, ()

    def __init__(self):
        for field, kind in self.FIELDS.items():
            object.__setattr__(self, field, kind())

    def __setattr__(self, field, value):
        if field not in self.FIELDS:
            raise AttributeError(f"{self.NAME} has no field {field}")
        if not isinstance(value, self.FIELDS[field]):
            raise AssertionError(f"{self.NAME}.{field} must be {self.FIELDS[field].__name__}, is {value!r}")
        object.__setattr__(self, field, value)


def message_class(name):
    """The class of a message such as geometry_msgs/msg/PoseStamped."""
    if name not in classes:
        _, definition = STORE.fielddefs[name]
        fields = {
            field: PYTHON[what[0]] if kind is Nodetype.BASE else message_class(what) for field, (kind, what) in definition
        }
        body = {"NAME": name, "FIELDS": fields, "__slots__": tuple(fields)}
        classes[name] = type(name.rsplit("/", 1)[1], (Message,), body)
    return classes[name]


def plain(message):
    """As rosbags has it."""
    values = [getattr(message, field) for field in message.FIELDS]
    return STORE.types[message.NAME](*[plain(value) if isinstance(value, Message) else value for value in values])


def taken(kind, decoded):
    """As a node has it."""
    message = kind()
    for field, inner in kind.FIELDS.items():
        value = getattr(decoded, field)
        setattr(message, field, taken(inner, value) if issubclass(inner, Message) else inner(value))
    return message


class Duration:
    def __init__(self, nanoseconds):
        self.nanoseconds = nanoseconds


class Time:
    def __init__(self, nanoseconds):
        self.nanoseconds = nanoseconds

    def __sub__(self, other):
        return Duration(self.nanoseconds - other.nanoseconds)

    @classmethod
    def from_msg(cls, stamp):
        return cls(stamp.sec * 10**9 + stamp.nanosec)

    def to_msg(self):
        stamp = message_class("builtin_interfaces/msg/Time")()
        stamp.sec, stamp.nanosec = divmod(self.nanoseconds, 10**9)
        return stamp


class Clock:
    def now(self):
        return Time(time.time_ns())


class Publisher:
    def __init__(self, kind, topic):
        self.kind, self.topic = kind, topic

    def publish(self, message):
        assert type(message) is self.kind, f"{self.topic} takes {self.kind.NAME}"
        data = STORE.serialize_cdr(plain(message), self.kind.NAME)
        for kind, callback in topics.get(self.topic, []):
            assert kind is self.kind, f"{self.topic} has {self.kind.NAME}, not {kind.NAME}"
            copy = taken(kind, STORE.deserialize_cdr(data, kind.NAME))
            executor.put((callback, copy))


class Node:
    def __init__(self, node_name):
        self.node_name, self.timers = node_name, []
        nodes.append(self)

    def declare_parameter(self, name, value):
        return types.SimpleNamespace(value=overrides.get(name, value))

    def topic(self, name):
        return name.replace("~", f"/{self.node_name}", 1)

    def create_publisher(self, kind, name, qos):
        return Publisher(kind, self.topic(name))

    def create_subscription(self, kind, name, callback, qos):
        topics.setdefault(self.topic(name), []).append((kind, callback))

    def create_timer(self, period_s, callback):
        def beat():
            while ok():
                executor.put((callback, None))
                time.sleep(period_s)

        threading.Thread(target=beat, daemon=True).start()

    def get_clock(self):
        return Clock()

    def destroy_node(self):
        nodes.remove(self)


nodes, executor, running = [], queue.Queue(), threading.Event()


def ok():
    return running.is_set()


def init():
    running.set()


def shutdown():
    running.clear()


def spin(node):
    """One callback after the other, as rclpy's single-threaded executor."""
    while ok():
        try:
            callback, message = executor.get(timeout=0.1)
        except queue.Empty:
            continue
        callback() if message is None else callback(message)


def install(**parameters):
    """Puts all this where `import rclpy` and imports of messages find it; these are the nodes' parameters."""
    overrides.update(parameters)
    modules = {
        "rclpy": {"init": init, "ok": ok, "spin": spin, "shutdown": shutdown},
        "rclpy.node": {"Node": Node},
        "rclpy.time": {"Time": Time},
        "rclpy.qos": {"qos_profile_sensor_data": object()},
        "rclpy.executors": {"ExternalShutdownException": type("ExternalShutdownException", (Exception,), {})},
        "geometry_msgs": {},
        "geometry_msgs.msg": {name: message_class(f"geometry_msgs/msg/{name}") for name in ("PoseStamped", "WrenchStamped")},
        "std_msgs": {},
        "std_msgs.msg": {"Bool": message_class("std_msgs/msg/Bool")},
    }
    for name, content in modules.items():
        module = types.ModuleType(name)
        module.__dict__.update(content)
        sys.modules[name] = module
