#!/usr/bin/env python3
"""What ten viewers of the operator's console cost the haptic tick: CPU time beside the same run without any.

    viewers.py MMT

Runs without and with viewers take turns, many short ones: a host is now fast and now slow by more than viewers could cost. Of the ten one
never reads. Ends with exit code 1 where the median tick with viewers costs more than 1.25 times that of the run before, by the median of all turns.
"""

import json
import socket
import subprocess
import sys
import threading
import time
from statistics import median
from urllib.parse import urlsplit

ROUNDS, LENGTH_S, VIEWERS, MOST = 15, 4, 10, 1.25


def join(address):
    """A viewer: the handshake of a WebSocket, what comes is left to whoever reads."""
    lines = [
        f"GET /ws?{address.query} HTTP/1.1",
        f"Host: {address.netloc}",
        f"Origin: http://{address.netloc}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    ]
    viewer = socket.create_connection((address.hostname, address.port))
    viewer.sendall("".join(f"{line}\r\n" for line in [*lines, ""]).encode())
    return viewer


def read(viewer, bytes_read):
    try:
        while part := viewer.recv(65536):
            bytes_read.append(len(part))
    except OSError:
        pass


def run(mmt, viewers):
    """CPU time of a tick, us: p50 and p99; and the bytes that were read."""
    command = [mmt, "demo", "--console", "--json", "--duration", f"{LENGTH_S}s"]
    demo = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        line = next(line for line in demo.stderr if "http://" in line)
        threading.Thread(target=demo.stderr.read, daemon=True).start()
        joined = [join(urlsplit(line.split()[-1])) for _ in range(viewers)]
        bytes_read = []
        for viewer in joined[1:]:
            threading.Thread(target=read, args=(viewer, bytes_read), daemon=True).start()
        time.sleep(LENGTH_S)
        for viewer in joined:
            viewer.close()
        cpu = json.loads(demo.communicate(timeout=60)[0])["haptic_loop"]["cpu_us"]
        return cpu["p50"], cpu["p99"], sum(bytes_read)
    finally:
        demo.kill()


def main():
    found = {0: [], VIEWERS: []}
    for _ in range(ROUNDS):
        for viewers, runs in found.items():
            runs.append(run(sys.argv[1], viewers))
    print(f"CPU time of a haptic tick, medians of {ROUNDS} runs of {LENGTH_S} s each")
    for viewers, runs in found.items():
        p50, p99, read_bytes = (median(column) for column in zip(*runs))
        print(f"  viewers {viewers:2}    p50 {p50:5.1f} us   p99 {p99:5.1f} us   {read_bytes / 1e6 / LENGTH_S:4.2f} MB/s read")
    ratio = median(after[0] / before[0] for before, after in zip(found[0], found[VIEWERS]))
    print(f"  ratio of p50   {ratio:.2f}, at most {MOST}; median over the turns")
    if not all(read_bytes > 1e6 for _, _, read_bytes in found[VIEWERS]) or ratio > MOST:
        sys.exit("BROKEN: ten viewers cost the tick nothing")


if __name__ == "__main__":
    main()
