#!/usr/bin/env python3
"""An emulated Haply Inverse Service with one Inverse3 and one wireless Verse Grip, by the vendor's pages of version 3.5.

    python3 tests/devices/inverse3.py                 # prints: inverse3: 127.0.0.1:PORT
    mmt device test --device inverse3 --device-at 127.0.0.1:PORT

One inventory on connecting, one frame for each message, commands that act once (docs.haply.co, inverseSDK/service/realtime).
3.5 takes the force as `vector`, and as `values` still; before, only `values`. What breaks a rule of those pages is refused: it
is reported at the end and commands nothing. The hand that holds it presses button a after half a second. Standard library only.
"""

import base64
import hashlib
import json
import math
import socket
import struct
import threading
import time

from emulated import Hand, Log, arguments

DEVICE, GRIP = "049D", "61548"
COMMANDS = {"set_cursor_force", "set_cursor_position", "set_angular_torques", "set_angular_position", "set_transform",
            "probe_position"}
# a command acts for one tick of the device; who sends no next one has none
TICK_S = 0.020


class Refused(Exception):
    """A message against a rule of the vendor's pages."""


class Gone(Exception):
    """The client has gone."""


class Service:
    def __init__(self, options, log):
        self.options, self.log = options, log
        self.hand = Hand(options.start, options.goal, options.speed, options.rest)
        self.force, self.commanded = [0.0, 0.0, 0.0], -math.inf
        self.now, self.begun = time.monotonic(), None
        self.garbled = self.silenced = False

    def step(self):
        now = time.monotonic()
        acts = now - self.commanded <= TICK_S
        self.hand.step(min(now - self.now, 0.05), self.force if acts else [0.0, 0.0, 0.0])
        self.now = now
        self.log.place(self.hand.place)

    def frame(self, whole):
        """The state of all devices; with their configuration if it is whole."""
        vector = lambda numbers: dict(zip("xyz", numbers))
        zero = vector([0.0, 0.0, 0.0])
        state = {
            "cursor_position": vector(self.hand.place), "cursor_velocity": vector(self.hand.velocity),
            "angular_position": {"a0": 0.0, "a1": 0.0, "a2": 0.0}, "angular_velocity": {"a0": 0.0, "a1": 0.0, "a2": 0.0},
            "body_orientation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}, "current_cursor_force": vector(self.force),
            "current_cursor_position": zero, "control_domain": "cartesian", "control_mode": "idle", "mode": "idle",
            "transform": {}, "transform_velocity": {},
        }
        status = {"calibrated": True, "in_use": True, "power_supply": True, "ready": True, "started": True}
        cursor = {"device_id": DEVICE, "state": state, "status": status}
        pressed = self.begun is not None and time.monotonic() - self.begun > 0.5
        grip = {
            "device_id": GRIP, "status": {"ready": True, "connected": True, "awake": True},
            "state": {"battery_level": 0.9, "buttons": {"a": pressed, "b": False, "c": False}, "hall": 0,
                      "orientation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}},
        }
        if whole:
            cursor["config"] = {
                "type": "inverse3", "port": "COM12", "handedness": "right", "streaming_mode": "USB", "preset": "defaults",
                "device_info": {"major_version": 7, "minor_version": 4, "id": DEVICE, "device_type": 4, "uuid": "0" * 32},
                "extended_device_id": "0" * 32, "extended_firmware_version": "0" * 32,
                "gravity_compensation": {"enabled": True, "scaling_factor": 1.0}, "torque_scaling": {"enabled": True},
                "home_return": {"enabled": False}, "basis": {"permutation": "XYZ"},
            }
            grip["config"] = {"port": "COM3", "type": "wireless_verse_grip", "major_version": 1, "minor_version": 0,
                              "hardware_version": 1}
        return {"session_id": 7, "inverse3": [cursor], "wireless_verse_grip": [grip]}

    def take(self, text):
        """A message; what it asks for is done once. Returns the answer."""
        try:
            message = json.loads(text)
            if not isinstance(message, dict):
                raise Refused("no object")
            session = message.get("session") or {}
            name = session.get("configure", {}).get("profile", {}).get("name")
            self.log.greeted = name or self.log.greeted
            for entry in message.get("inverse3", []):
                self.command(entry)
            self.log.taken += 1
            return json.dumps(self.frame("force_render_full_state" in session))
        except (ValueError, Refused, KeyError, TypeError, AttributeError) as error:
            self.log.refuse(f"{error}: {text[:120]}")
            return json.dumps(self.frame(False))

    def command(self, entry):
        if entry["device_id"] != DEVICE:
            raise Refused("no such device")
        commands = entry.get("commands") or {}
        if unknown := set(commands) - COMMANDS:
            raise Refused(f"unknown commands {unknown}")
        force = commands.get("set_cursor_force")
        if force is None:
            return
        known = [key for key in ("vector", "values") if key in force and (key == "values" or self.options.version >= "3.5")]
        if not known:
            raise Refused("no force in this version's words")
        if force.get("execute", True):
            vector = force[known[0]]
            self.force = [float(vector[axis]) for axis in "xyz"]
            if not all(map(math.isfinite, self.force)):
                raise Refused("no finite force")
            self.commanded = time.monotonic()
            self.log.force(self.force)

    def serve(self, client):
        """A connection until it ends."""
        self.begun = None
        send(client, 1, json.dumps(self.frame(True)).encode())
        while True:
            opcode, payload = receive(client)
            self.begun = self.begun or time.monotonic()
            since = time.monotonic() - self.begun
            if opcode == 8:
                send(client, 8, payload)
                return
            if opcode == 9:
                send(client, 10, payload)
                continue
            if opcode != 1:
                self.log.refuse(f"opcode {opcode}")
                continue
            answer = self.take(payload.decode())
            self.step()
            if since > self.options.silent_at and not self.silenced:
                self.silenced = True
                time.sleep(0.3)
            if since > self.options.garbage_at and not self.garbled:
                self.garbled = True
                answer = answer[: len(answer) // 2]
            send(client, 1, answer.encode())


def exactly(client, count):
    data = b""
    while len(data) < count:
        more = client.recv(count - len(data))
        if not more:
            raise Gone
        data += more
    return data


def receive(client):
    """A frame of RFC 6455: its opcode and payload. A client's is masked and, here, whole."""
    first, second = exactly(client, 2)
    if not second & 0x80 or not first & 0x80:
        send(client, 8, struct.pack(">H", 1002))
        raise Gone
    length = second & 0x7F
    if length == 126:
        (length,) = struct.unpack(">H", exactly(client, 2))
    elif length == 127:
        (length,) = struct.unpack(">Q", exactly(client, 8))
    if length > 1 << 20:
        send(client, 8, struct.pack(">H", 1009))
        raise Gone
    mask, payload = exactly(client, 4), exactly(client, length)
    return first & 0x0F, bytes(byte ^ mask[n % 4] for n, byte in enumerate(payload))


def send(client, opcode, payload):
    length = len(payload)
    head = bytes([0x80 | opcode]) + (bytes([length]) if length < 126 else b"\x7e" + struct.pack(">H", length))
    client.sendall(head + payload)


def answer(client, service):
    """A request: a WebSocket, or one of the pages about the service. Whether it was a WebSocket."""
    request = b""
    while b"\r\n\r\n" not in request:
        more = client.recv(4096)
        if not more or len(request) > 65536:
            raise Gone
        request += more
    first, *lines = request.decode("latin-1").split("\r\n\r\n")[0].split("\r\n")
    fields = dict((name.strip().lower(), value.strip()) for name, _, value in (line.partition(":") for line in lines))
    method, path, _ = first.split(" ")
    if fields.get("upgrade", "").lower() == "websocket":
        key = fields["sec-websocket-key"] + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
        accept = base64.b64encode(hashlib.sha1(key.encode()).digest()).decode()
        client.sendall(("HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                        f"Sec-WebSocket-Accept: {accept}\r\n\r\n").encode())
        service.serve(client)
        return True
    pages = {
        "/version": {"build_time": "2026-04-21T00:00:00Z", "git_branch": "main", "git_describe": service.options.version,
                     "git_hash": "0", "git_tag": service.options.version, "project_name": "haply-inverse-service",
                     "project_version": service.options.version},
        "/devices": service.frame(True),
    }
    status = "200 OK" if method == "GET" and path in pages else "404 Not Found"
    body = json.dumps(pages.get(path, {"ok": False, "error": "no such route"}))
    client.sendall((f"HTTP/1.1 {status}\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n"
                    f"Connection: close\r\n\r\n{body}").encode())
    return False


def main():
    options = arguments(__doc__.split("\n")[0], [0.0, -0.12, 0.15], [0.06, -0.12, 0.15])
    options.add_argument("--port", type=int, default=0, help="where it listens on this host; 0: any free port")
    options.add_argument("--version", default="3.5.0.0", help="the service's version")
    options = options.parse_args()
    log = Log()
    service = Service(options, log)
    listener = socket.create_server(("127.0.0.1", options.port))
    print(f"inverse3: 127.0.0.1:{listener.getsockname()[1]}", flush=True)
    ended = threading.Event()

    def attend(client):
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        was_a_socket = True
        with client:
            try:
                was_a_socket = answer(client, service)
            except (Gone, OSError, ValueError, KeyError):
                pass
        # whoever goes takes its force along
        service.commanded = -math.inf if was_a_socket else service.commanded
        if options.once and was_a_socket and log.taken:
            ended.set()

    def accept():
        while True:
            threading.Thread(target=attend, args=(listener.accept()[0],), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    try:
        while not ended.wait(0.2):
            pass
    except KeyboardInterrupt:
        pass
    log.show()


if __name__ == "__main__":
    main()
