"""Watches a session on the WebSocket of `mmt live` as Lichtblick does, and prints what came as one JSON document.

Usage: viewer.py ws://127.0.0.1:PORT SECONDS

Written from Foxglove's description of its WebSocket protocol (foxglove.sdk.v1) alone; messages are decoded by rosbags, by the
schemas that the server advertises. It also tries what a viewer must not be able to do: to publish.
"""

import asyncio
import json
import struct
import sys

import websockets
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MESSAGE_DATA = 1
WANTED = ("/tf", "/master/force", "/slave/parameters")


async def watch(url, seconds):
    """What came on each of the topics, decoded, and what the server offers."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    subscribed, messages, found = {}, {topic: [] for topic in WANTED}, {"status": []}
    async with websockets.connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
        end = asyncio.get_running_loop().time() + seconds
        try:
            while True:
                frame = await asyncio.wait_for(socket.recv(), end - asyncio.get_running_loop().time())
                if isinstance(frame, str):
                    said = json.loads(frame)
                    if said["op"] == "serverInfo":
                        found["capabilities"] = said["capabilities"]
                        attempt = {"op": "advertise", "channels": [{"id": 1, "topic": "/x", "encoding": "json", "schemaName": ""}]}
                        await socket.send(json.dumps(attempt))
                    elif said["op"] == "advertise":
                        for channel in said["channels"]:
                            if channel["topic"] not in WANTED:
                                continue
                            name = channel["schemaName"]
                            known = name.replace("/msg/", "/") if name.count("/") == 1 else name
                            if name not in store.types and known.replace("/", "/msg/", 1) not in store.types:
                                store.register(get_types_from_msg(channel["schema"], name))
                            number = len(subscribed) + 1
                            subscribed[number] = (channel["topic"], name if name in store.types else name.replace("/", "/msg/", 1))
                            await socket.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": number, "channelId": channel["id"]}]}))
                    elif said["op"] == "status":
                        found["status"].append(said["message"])
                elif frame[0] == MESSAGE_DATA:
                    number, _ = struct.unpack_from("<IQ", frame, 1)
                    topic, kind = subscribed[number]
                    messages[topic].append(store.deserialize_cdr(frame[13:], kind))
        except (asyncio.TimeoutError, websockets.ConnectionClosed):
            return messages, found


def main():
    url, seconds = sys.argv[1], float(sys.argv[2])
    messages, found = asyncio.run(watch(url, seconds))
    places = [
        one.transform.translation.x
        for message in messages["/tf"]
        for one in message.transforms
        if one.child_frame_id == "master/hip"
    ]
    found["messages"] = {topic: len(of) for topic, of in messages.items()}
    found["hip_way_m"] = max(places) - min(places) if places else None
    found["force_max_n"] = max((abs(message.wrench.force.x) for message in messages["/master/force"]), default=None)
    found["mass_kg"] = messages["/slave/parameters"][-1].m_kg if messages["/slave/parameters"] else None
    print(json.dumps(found))


main()
