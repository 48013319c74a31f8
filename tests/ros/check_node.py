"""Holds contrib/ros_node.py to its topics and its packets: this end of each plug is a socket here, ROS is the stand-in of ros2.py.

Prints what was checked, one line each; fails with what is wrong.
"""

import math
import pathlib
import socket
import sys
import threading
import time

import ros2

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "contrib"))
TOKEN = bytes(range(16))
PATIENCE_S = 30.0


def end_of_plug():
    """A socket where mmt would be, and its address as mmt prints it."""
    at = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    at.bind(("127.0.0.1", 0))
    at.settimeout(PATIENCE_S)
    return at, f"udp://127.0.0.1:{at.getsockname()[1]}?token={TOKEN.hex()}"


def stamped(kind, at_ns):
    message = ros2.message_class(kind)()
    message.header.stamp = ros2.Time(at_ns).to_msg()
    return message


def pose(x, y, angle=0.0, at_ns=None):
    message = stamped("geometry_msgs/msg/PoseStamped", at_ns or time.time_ns())
    message.pose.position.x, message.pose.position.y = x, y
    message.pose.orientation.z, message.pose.orientation.w = math.sin(angle / 2), math.cos(angle / 2)
    return message


def close(found, wanted):
    return all(abs(a - b) < 1e-6 for a, b in zip(found, wanted, strict=True))


def until(what, step):
    """Takes steps until one gives something."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        found = step()
        if found:
            print(what)
            return found
        time.sleep(0.002)
    raise SystemExit(f"never: {what}")


def plant_side(plant, ros_node):
    mmt, address = end_of_plug()
    ros2.overrides.update(plant=address, hand="")
    assert ros_node.role() is ros_node.PlantNode
    node, robot, commands = ros_node.PlantNode(), ros2.Node("robot"), []
    kinds = [ros2.message_class(f"geometry_msgs/msg/{name}") for name in ("PoseStamped", "WrenchStamped")]
    robot.create_subscription(kinds[0], "/mmt_plant/tool_command", commands.append, None)
    topics = {name: robot.create_publisher(kinds[name == "wrench"], f"/mmt_plant/{name}", None) for name in ("tool", "wrench", "object")}

    def measured():
        topics["tool"].publish(pose(0.25, -0.5))
        wrench = stamped("geometry_msgs/msg/WrenchStamped", time.time_ns())
        wrench.wrench.force.x, wrench.wrench.force.y = 3.0, -4.0
        topics["wrench"].publish(wrench)
        topics["object"].publish(pose(1.5, 2.5, 0.75, time.time_ns() - 200_000_000))
        packet, peer = mmt.recvfrom(256)
        head, numbers = plant.HEAD.unpack_from(packet), plant.NUMBERS.unpack_from(packet, plant.HEAD.size)
        assert (head[0], head[1], head[2], head[7]) == (b"MMTL", 1, 4, TOKEN), head
        is_seen = head[3] == 1 and close(numbers[:2], (0.25, -0.5)) and close(numbers[4:9], (3.0, -4.0, 1.5, 2.5, 0.75))
        return peer if is_seen and 0.15 < numbers[9] < 10.0 else None

    peer = until("tool, wrench and object of the robot are in an answer, with the age of the image", measured)
    head = plant.HEAD.pack(b"MMTL", 1, 3, plant.SESSION, 1, 0, 1, TOKEN)
    mmt.sendto(head + plant.NUMBERS.pack(0.5, 0.125, 0.1, 0.2, 1000.0, 10.0, 15.0, 0.0, 0.0, 0.0), peer)
    command = until("a command of the slave is a pose of the tool", lambda: commands and commands[0])
    place = command.pose.position
    assert close((place.x, place.y, place.z, command.pose.orientation.w), (0.5, 0.125, node.height_m, 1.0))
    assert command.header.frame_id == "world"

    def silent():
        mmt.settimeout(1.0)
        try:
            mmt.recv(256)
        except TimeoutError:
            return True

    until("a robot that is silent is answered for by nobody", silent)


def hand_side(hand, ros_node):
    mmt, address = end_of_plug()
    ros2.overrides.update(plant="", hand=address)
    assert ros_node.role() is ros_node.HandNode
    ros_node.HandNode()
    device, forces = ros2.Node("device"), []
    kind = ros2.message_class("geometry_msgs/msg/PoseStamped")
    device.create_subscription(ros2.message_class("geometry_msgs/msg/WrenchStamped"), "/mmt_hand/force", forces.append, None)
    place = device.create_publisher(kind, "/mmt_hand/device", None)
    button = device.create_publisher(ros2.message_class("std_msgs/msg/Bool"), "/mmt_hand/button", None)
    down = ros2.message_class("std_msgs/msg/Bool")()
    down.data = True
    button.publish(down)
    # two readings, 10 ms apart, that come at once
    for n in (0, 1):
        place.publish(pose(0.1 + 0.01 * n, 0.2, 0.0, 5_000_000_000 + n * 10_000_000))
    readings = []
    for _ in (0, 1):
        packet, peer = mmt.recvfrom(256)
        head, numbers = hand.HEAD.unpack_from(packet), hand.READING.unpack_from(packet, hand.HEAD.size)
        assert (head[0], head[1], head[2], head[3], head[7]) == (b"MMTL", 1, 1, 1, TOKEN), head
        readings.append((head[6], numbers))
    assert [stamp for stamp, _ in readings] == [5_000_000_000, 5_010_000_000], readings
    assert close(readings[1][1], (0.11, 0.2, 0.0, 1.0, 0.0, 0.0)), readings
    print("readings that come at once keep their own times, and the velocity is between them")
    sequence = 0

    def felt(state, newtons):
        nonlocal sequence
        sequence += 1
        head = hand.HEAD.pack(b"MMTL", 1, 2, state, sequence, 0, sequence, TOKEN)
        mmt.sendto(head + hand.FORCE.pack(*newtons, 0.0, 0.0, 0.0), peer)
        force = forces[-1].wrench.force if forces else None
        return force and close((force.x, force.y, force.z), newtons)

    until("the force of the master is a wrench on the hand", lambda: felt(hand.SESSION | hand.ENGAGED, (1.0, -2.0, 0.5)))
    until("and so is what ramps out after a release", lambda: felt(hand.SESSION, (0.5, -1.0, 0.25)))
    until("without the master there is none", lambda: forces[-1].wrench.force.x == 0.0)


def main():
    ros2.install()
    import hand
    import plant
    import ros_node

    ros2.init()
    threading.Thread(target=ros2.spin, args=(None,), daemon=True).start()
    plant_side(plant, ros_node)
    hand_side(hand, ros_node)
    ros2.shutdown()


if __name__ == "__main__":
    main()
