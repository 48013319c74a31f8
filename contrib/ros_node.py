#!/usr/bin/env python3
"""A ROS 2 node at one of mmt's plugs (docs/plugs.md#ros-2): a robot becomes the plant of a slave, or a device the hand of a master.

    python3 ros_node.py --ros-args -p plant:=ask        # asks for the address that mmt printed: udp://127.0.0.1:PORT?token=…
    python3 ros_node.py --ros-args -p hand:=ask

It needs rclpy, geometry_msgs and std_msgs, as every ROS 2 has them, and hand.py and plant.py beside it.
"""

import math
import threading
import time

import rclpy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from std_msgs.msg import Bool

from hand import Device, asked
from plant import Plant

# a robot of which nothing came for so long is not there: mmt then holds the tool and takes the force from the hand
SILENCE_S = 0.050
# a lone `-` is no word for the parameters of ROS
ASK = {"ask": "-"}


class Speed:
    """Velocity along each axis (m/s) from places and their times (s): the difference over at least 5 ms."""

    def __init__(self, axes):
        self.at_s, self.place, self.speed = None, None, (0.0,) * axes

    def follow(self, at_s, place):
        if self.place is None or not 0.0 < at_s - self.at_s < 1.0:
            self.at_s, self.place, self.speed = at_s, place, (0.0,) * len(place)
        elif at_s - self.at_s >= 0.005:
            self.speed = tuple((b - a) / (at_s - self.at_s) for a, b in zip(self.place, place))
            self.at_s, self.place = at_s, place
        return self.speed


def seconds(stamp):
    """A header's stamp, s."""
    return stamp.sec + 1e-9 * stamp.nanosec


def yaw(q):
    """The angle (rad) about z of a quaternion."""
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))


class PlantNode(Node):
    """The robot's side: ~/tool_command out; ~/tool, ~/wrench and, where the object is seen, ~/object in."""

    def __init__(self, node_name="mmt_plant"):
        super().__init__(node_name)
        address = self.declare_parameter("plant", "").value
        self.frame = self.declare_parameter("frame", "world").value
        self.height_m = self.declare_parameter("height_m", 0.0).value
        self.plug, self.lock = Plant(asked(ASK.get(address, address), "plant")), threading.Lock()
        self.tool = self.seen = None
        self.force, self.speed, self.heard_s = (0.0, 0.0), Speed(2), -math.inf
        self.command = self.create_publisher(PoseStamped, "~/tool_command", qos_profile_sensor_data)
        self.create_subscription(PoseStamped, "~/tool", self.take_tool, qos_profile_sensor_data)
        self.create_subscription(WrenchStamped, "~/wrench", self.take_wrench, qos_profile_sensor_data)
        self.create_subscription(PoseStamped, "~/object", self.take_object, qos_profile_sensor_data)
        threading.Thread(target=self.serve, daemon=True).start()

    def take_tool(self, message):
        """Where the tool is."""
        place = (message.pose.position.x, message.pose.position.y)
        with self.lock:
            velocity = self.speed.follow(seconds(message.header.stamp), place)
            self.tool, self.heard_s = (place, velocity), time.monotonic()

    def take_wrench(self, message):
        """The force of the tool on the object; a sensor at the wrist measures the opposite."""
        with self.lock:
            self.force = (message.wrench.force.x, message.wrench.force.y)

    def take_object(self, message):
        """The object's centre and angle, as a camera saw them at the stamp."""
        at = message.pose.position
        with self.lock:
            self.seen = (at.x, at.y, yaw(message.pose.orientation)), Time.from_msg(message.header.stamp)

    def serve(self):
        """Answers the slave's commands with what was measured last, and sends them on."""
        while rclpy.ok():
            command = self.plug.command(0.010)
            if command:
                self.publish(command)
            with self.lock:
                silent = time.monotonic() - self.heard_s > SILENCE_S
                tool, force, seen, self.seen = self.tool, self.force, self.seen, None
            if tool is None or silent:
                continue  # no answer: mmt takes a silent robot for what it is
            pose, age_s = None, 0.0
            if seen:
                pose, then = seen
                age_s = min(max((self.get_clock().now() - then).nanoseconds * 1e-9, 0.0), 10.0)
            self.plug.answer(*tool, force, pose, age_s)

    def publish(self, command):
        message = PoseStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = self.frame
        message.pose.position.x, message.pose.position.y = command.tool
        message.pose.position.z = self.height_m
        message.pose.orientation.w = 1.0
        self.command.publish(message)


class HandNode(Node):
    """The device's side: ~/device and ~/button in, ~/force out."""

    def __init__(self, node_name="mmt_hand"):
        super().__init__(node_name)
        address = self.declare_parameter("hand", "").value
        self.frame = self.declare_parameter("frame", "world").value
        self.device, self.speed, self.down = Device(asked(ASK.get(address, address), "device")), Speed(3), False
        self.force = self.create_publisher(WrenchStamped, "~/force", qos_profile_sensor_data)
        self.create_subscription(PoseStamped, "~/device", self.take_device, qos_profile_sensor_data)
        self.create_subscription(Bool, "~/button", self.take_button, qos_profile_sensor_data)
        # a device that is not read any more gets the force taken away
        self.create_timer(0.010, self.publish)

    def take_button(self, message):
        """Whether the button that holds the hand is down."""
        self.down = message.data

    def take_device(self, message):
        """A reading: where the device is, m, along its own axes."""
        at = message.pose.position
        place = (at.x, at.y, at.z)
        velocity = self.speed.follow(seconds(message.header.stamp), place)
        # messages may come in a bunch: the time is that of the reading
        self.device.send(place, velocity, int(self.down), Time.from_msg(message.header.stamp).nanoseconds)
        self.publish()

    def publish(self):
        self.device.receive()
        message = WrenchStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = self.frame
        # also after a release: the force that ramps out
        newtons = message.wrench.force
        newtons.x, newtons.y, newtons.z = self.device.force
        self.force.publish(message)


def role():
    """Which node the parameters ask for."""
    node = Node("mmt")
    names = ("plant", "hand")
    plant, hand = (node.declare_parameter(name, "").value for name in names)
    node.destroy_node()
    if bool(plant) == bool(hand):
        raise SystemExit("give one: -p plant:=ask for the address that mmt slave printed, or -p hand:=ask for that of mmt master")
    return PlantNode if plant else HandNode


def main():
    rclpy.init()
    node = role()()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
