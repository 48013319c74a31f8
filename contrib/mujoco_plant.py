#!/usr/bin/env python3
"""MuJoCo as the object of a session (docs/plugs.md): a cube, a cylinder, a wedge or a hinged door, pushed by a sphere.

    pip install -r contrib/requirements.txt
    mmt slave --listen 127.0.0.1:0 --plant link         # prints: plant: udp://127.0.0.1:PORT?token=…
    python3 mujoco_plant.py --object cylinder           # asks for that address

Real contact in three dimensions with friction: between the object and the table, and between the sphere and the object. The sphere
is the tip of an arm under impedance control: a small mass on the spring and the damper that mmt asks for, and its place and its
contact force are what is sent back. With --stiffness it is position controlled: a stiff spring, whatever mmt asks for. Nothing of mmt's own
world is used.
"""

import argparse
import json
import math
import sys

import mujoco
import numpy

from plant import Plant, asked, serve

SUBSTEPS = 2
TOOL_KG = 0.1
OBJECTS = {
    # 0.36 m and 0.7 kg, as the default object of mmt
    "cube": '<freejoint/><geom type="box" size="0.18 0.18 0.18" mass="0.7"/>',
    "cylinder": '<freejoint/><geom type="cylinder" size="0.18 0.15" mass="0.7"/>',
    "wedge": '<freejoint/><geom type="mesh" mesh="wedge" mass="0.7"/>',
    # it turns about a post at its one end; the plane that it is pushed over carries nothing of it
    "door": '<joint type="hinge" axis="0 0 1" pos="0 0.4 0" damping="0.3" frictionloss="0.3"/>'
            '<geom type="box" size="0.03 0.4 0.15" mass="2"/>',
}
HEIGHTS = {"cube": 0.18, "cylinder": 0.15, "wedge": 0.15, "door": 0.2}
SCENE = """
<mujoco>
  <option timestep="{step}" integrator="implicitfast" cone="elliptic" impratio="20" noslip_iterations="5"/>
  <asset><mesh name="wedge" vertex="-0.2 -0.2 -0.15  -0.2 0.2 -0.15  0.2 0.2 -0.15  -0.2 -0.2 0.15  -0.2 0.2 0.15  0.2 0.2 0.15"/></asset>
  <worldbody>
    <geom name="table" type="plane" size="5 5 0.1" friction="{friction} 0.001 0.0001"/>
    <body name="object" pos="0 0 {height}">{geometry}</body>
    <body name="tool" pos="0 0 {tool_height}">
      <joint name="tool_x" type="slide" axis="1 0 0"/><joint name="tool_y" type="slide" axis="0 1 0"/>
      <geom name="tool" type="sphere" size="{radius}" mass="{tool_mass}" priority="1"
            friction="{tool_friction} 0.001 0.0001" solref="0.004 1" contype="2" conaffinity="1"/>
    </body>
  </worldbody>
</mujoco>
"""


class World:
    """A world that mmt pushes."""

    def __init__(self, options):
        self.friction_is_dry = options.object != "door"
        self.model = mujoco.MjModel.from_xml_string(SCENE.format(
            step=0.001 / SUBSTEPS, friction=options.friction, height=HEIGHTS[options.object],
            geometry=OBJECTS[options.object].replace("<geom ", f'<geom name="object" friction="{options.friction} 0.001 0.0001" contype="1" conaffinity="3" '),
            radius=options.radius, tool_mass=TOOL_KG, tool_height=options.tool_height or HEIGHTS[options.object], tool_friction=options.tool_friction))
        self.data = mujoco.MjData(self.model)
        self.object = self.model.body("object").id
        self.tool_geom = self.model.geom("tool").id
        self.tool_at = [self.model.joint(name).qposadr[0] for name in ("tool_x", "tool_y")]
        self.tool_speed = [self.model.joint(name).dofadr[0] for name in ("tool_x", "tool_y")]
        self.damping = options.damping
        self.stiffness = options.stiffness
        self.noise, self.random = options.force_noise, numpy.random.default_rng(1)
        self.sensor = 1.0 - math.exp(-2.0 * math.pi * options.sensor_hz * 0.001)
        self.force = (0.0, 0.0)
        self.periods, self.measure_every = 0, options.measure_every
        self.data.qpos[self.tool_at] = (-0.45, 0.0)
        for _ in range(500 * SUBSTEPS):
            self.substep((-0.45, 0.0), (0.0, 0.0), 500.0, 10.0, 15.0)
        self.measured = (*self.state(), (0.0, 0.0))

    def step(self, command):
        """One millisecond."""
        if command.begins:
            self.data.qpos[self.tool_at] = command.tool
            self.data.qvel[self.tool_speed] = 0.0
        total = numpy.zeros(2)
        control = (command.stiffness, command.damping, command.force_max)
        if self.stiffness:
            control = (self.stiffness, 1.4 * math.sqrt(self.stiffness * TOOL_KG), math.inf)
        for n in range(SUBSTEPS):
            ahead = (n + 1) * 0.001 / SUBSTEPS - 0.001
            goal = [t + v * ahead for t, v in zip(command.tool, command.velocity)]
            self.substep(goal, command.velocity, *control)
            total += self.contact_force()
        # the filter of a force sensor: stiff bodies chatter at some 100 Hz
        self.force = tuple(f + self.sensor * (t - f) for f, t in zip(self.force, total / SUBSTEPS))
        if self.periods % self.measure_every == 0:
            noise = self.noise * self.random.standard_normal(2)
            self.measured = (*self.state(), tuple(self.force + noise))
        self.periods += 1

    def substep(self, goal, velocity, stiffness, damping, force_max):
        at, speed = self.data.qpos[self.tool_at], self.data.qvel[self.tool_speed]
        force = stiffness * (numpy.asarray(goal) - at) + damping * (numpy.asarray(velocity) - speed)
        size = numpy.linalg.norm(force)
        self.data.qfrc_applied[self.tool_speed] = force * min(1.0, force_max / size) if size > 0.0 else force
        if self.friction_is_dry:
            # the film under the object: b v, and b l^2/6 omega as of mmt's own world
            spin, way = self.data.cvel[self.object][2], self.body_velocity()
            self.data.xfrc_applied[self.object] = (*(-self.damping * way), 0.0, 0.0, 0.0, -self.damping * 0.0216 * spin)
        mujoco.mj_step(self.model, self.data)

    def body_velocity(self):
        found = numpy.zeros(6)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_BODY, self.object, found, 0)
        return found[3:5]

    def contact_force(self):
        """Force of the sphere on whatever it touches, N, world."""
        total, one = numpy.zeros(2), numpy.zeros(6)
        for index in range(self.data.ncon):
            contact = self.data.contact[index]
            if self.tool_geom not in contact.geom:
                continue
            mujoco.mj_contactForce(self.model, self.data, index, one)
            # along the frame's axes, on the second geom
            world = contact.frame.reshape(3, 3).T @ one[:3]
            total += world[:2] * (-1.0 if contact.geom[1] == self.tool_geom else 1.0)
        return total

    def state(self):
        return tuple(self.data.qpos[self.tool_at]), tuple(self.data.qvel[self.tool_speed])

    def tool_state(self):
        return self.measured

    def pose(self):
        x, y, _ = self.data.xpos[self.object]
        w, i, j, k = self.data.xquat[self.object]
        return (x, y, math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k)))

    def tilt(self):
        """How far the object leans, rad."""
        return math.acos(min(1.0, max(-1.0, self.data.xmat[self.object][8])))


def at_least(least):
    """A whole number that is not below this, for argparse."""
    def number(text):
        if int(text) < least:
            raise argparse.ArgumentTypeError(f"{text} is below {least}")
        return int(text)
    return number


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("address", nargs="?", default="-", help="as mmt printed it after “plant: ”; `-`, the default, asks for it or reads it from standard input")
    arguments.add_argument("--object", choices=sorted(OBJECTS), default="cube")
    arguments.add_argument("--friction", type=float, default=0.3, help="of object and table")
    arguments.add_argument("--damping", type=float, default=3.0, help="b of the film under the object, N s/m")
    arguments.add_argument("--tool-friction", type=float, default=0.05, help="of sphere and object")
    arguments.add_argument("--tool-height", type=float, help="of the sphere above the table, m [default: that of the middle of the object]")
    arguments.add_argument("--radius", type=float, default=0.01, help="of the sphere, m")
    arguments.add_argument("--stiffness", type=float, help="of a position-controlled tool, N/m [default: the tool is under impedance control]")
    arguments.add_argument("--sensor-hz", type=float, default=100.0, help="corner frequency of the force sensor's own filter")
    arguments.add_argument("--force-noise", type=float, default=0.0, help="of the force sensor, N per axis")
    arguments.add_argument("--measure-every", type=at_least(1), default=1, help="so many periods: a robot that is slower than mmt")
    arguments.add_argument("--image-hz", type=at_least(0), default=30, help="images of the object a second; 0: no camera")
    arguments.add_argument("--seconds", type=float, default=math.inf, help="how long")
    options = arguments.parse_args()
    world, plug = World(options), Plant(asked(options.address, "plant"))
    begin = world.pose()
    try:
        serve(plug, world, options.seconds, options.image_hz)
    except KeyboardInterrupt:
        pass
    end = world.pose()
    json.dump({
        "object": options.object,
        "commands": plug.received,
        "lost": plug.lost,
        "moved_m": round(math.dist(begin[:2], end[:2]), 4),
        "turned_rad": round(end[2] - begin[2], 4),
        "tilt_rad": round(world.tilt(), 4),
    }, sys.stdout)
    print()


if __name__ == "__main__":
    main()
