#!/usr/bin/env python3
"""The operator's console in a real browser, against a running demo.

    check.py [--shots DIR] [--browser PATH] MMT [-- ARGUMENT …]

MMT is the program. Each promise is printed when it holds; the first that does not ends with exit code 1. With --shots,
pictures at two sizes and in both themes are kept in DIR.
"""

import argparse
import http.client
import json
import math
import shutil
import subprocess
import sys
import time
from urllib.parse import urlsplit

from playwright.sync_api import sync_playwright

PATIENCE_S = 30.0
UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}


def holds(promise, kept, found=""):
    """Prints a promise that holds; one that does not ends the check."""
    if not kept:
        sys.exit(f"BROKEN: {promise}: {found}")
    print(f"holds: {promise}", flush=True)


class Tab:
    """A page, and what came over its socket."""

    def __init__(self, context, address):
        self.page, self.frame, self.about, self.role = context.new_page(), None, {}, None
        self.errors = []
        self.page.on("console", lambda line: line.type == "error" and self.errors.append(line.text))
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("websocket", lambda socket: socket.on("framereceived", self._take))
        self.requests = []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(address)

    def _take(self, text):
        message = json.loads(text)
        if "master" in message:
            self.frame = message
        self.about = message.get("about", self.about)
        self.role = message.get("role", self.role)

    def until(self, what, fulfilled):
        """Waits for it; a missing key counts as not yet."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            try:
                if fulfilled():
                    return
            except (KeyError, TypeError, IndexError):
                pass
            self.page.wait_for_timeout(30)
        sys.exit(f"BROKEN: never: {what}; role {self.role}, about {self.about}, frame {self.frame}")

    @property
    def master(self):
        return self.frame["master"]

    def drag(self, way, seconds, each=lambda: None):
        """Presses in the scene and drags along `way`, m; it stays pressed."""
        box = self.page.locator("#scene").bounding_box()
        scale = min(box["width"], box["height"] * 1.15) / 0.86
        x, y = box["x"] + box["width"] * 0.5, box["y"] + box["height"] / 2
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        steps = int(seconds / 0.02)
        for n in range(1, steps + 1):
            self.page.mouse.move(x + way[0] * scale * n / steps, y - way[1] * scale * n / steps)
            self.page.wait_for_timeout(16)
            each()


def status(address, path, headers):
    """The status that the console answers a plain request with."""
    connection = http.client.HTTPConnection(address.hostname, address.port, timeout=PATIENCE_S)
    connection.request("GET", path, headers=headers)
    return connection.getresponse().status


def check_admission(address):
    whole, host = f"/ws?{address.query}", address.netloc
    own, evil = f"http://{host}", "http://evil.example"
    wrong = f"/ws?token={'0' * 32}"
    for promise, path, headers, wanted in [
        ("the page wants the token", "/", {}, 403),
        ("a wrong token is refused", f"/?token={'0' * 32}", {}, 403),
        ("the right token is let in", f"/?{address.query}", {}, 200),
        ("a foreign Host is refused", f"/?{address.query}", {"Host": "evil.example"}, 403),
        ("a foreign Origin is refused", whole, UPGRADE | {"Origin": evil}, 403),
        ("a socket without Origin is refused", whole, UPGRADE, 403),
        ("a socket with a wrong token is refused", wrong, UPGRADE | {"Origin": own}, 403),
        ("the page's own socket is let in", whole, UPGRADE | {"Origin": own}, 101),
    ]:
        found = status(address, path, headers)
        holds(promise, found == wanted, found)


def check_hand(tab):
    tab.until("the first picture", lambda: tab.master["footprint"] and tab.frame["slave"])
    holds("the first page operates", tab.role == "operator", tab.role)
    tab.page.locator("#driver").click()
    tab.until("the hand let go", lambda: not tab.master["engaged"])
    before, sent = tab.frame["slave"]["truth"]["position"], sum(tab.frame["slave"]["updates"])
    forces, engaged = [], []

    def look():
        forces.append(math.hypot(*tab.master["hand_force"]))
        engaged.append(tab.master["engaged"])

    def pushed():
        return math.dist(tab.frame["slave"]["truth"]["position"], before) > 0.03

    # a page that stands for 120 ms on a busy host is let go, as it should be, and presses again
    for _ in range(6):
        there, here = tab.master["model"]["position"], tab.master["hip"]
        tab.drag([there[axis] - here[axis] for axis in (0, 1)], 2.0, look)
        if pushed() and max(forces) > 1.0:
            break
        tab.page.mouse.up()
    holds("a pressed pointer engages", any(engaged))
    holds("force is felt", max(forces) > 1.0, max(forces))
    tab.page.mouse.up()
    tab.until("force zero after the release", lambda: tab.master["hand_force"] == [0, 0] and not tab.master["engaged"])
    holds("release lets the force go", True)
    held = tab.master["hip"]
    tab.page.mouse.move(10, 10)
    tab.page.wait_for_timeout(400)
    holds("and the hand stays", tab.master["hip"] == held)
    tab.until("the box pushed", pushed)
    holds("a drag moves the box", True)
    holds("and yields packets", sum(tab.frame["slave"]["updates"]) > sent)


def check_layout(tab):
    before = tab.page.viewport_size
    for width in [360, 1010, 1280, 3840]:
        tab.page.set_viewport_size({"width": width, "height": 800})
        tab.page.wait_for_timeout(200)
        wide = "[document.documentElement, document.querySelector('.facts')].map((of) => of.scrollWidth - of.clientWidth)"
        over = tab.page.evaluate(wide)
        holds(f"nothing is cut off at {width} px", max(over) <= 0, over)
    tab.page.set_viewport_size(before)
    # the mouse stays on the page: the middle of the scene to its lower right
    tab.drag([0.34, -0.28], 2.0)
    lens = tab.page.locator(".lens.up")
    for _ in range(3):
        if lens.count():
            break
        tab.page.mouse.up()
        tab.drag([0.34, -0.28], 2.0)
    holds("the lens gives way to the hand", lens.count() == 1, tab.master["hip"])
    tab.page.mouse.up()


def check_observer(context, address, tab):
    other = Tab(context, address)
    other.until("a picture for the second tab", lambda: other.frame)
    holds("a second tab observes", other.role == "observer", other.role)
    held = tab.master["hip"]
    other.drag([0.2, 0.0], 0.5)
    other.page.mouse.up()
    other.page.keyboard.press("s")
    tab.page.bring_to_front()
    tab.page.wait_for_timeout(400)
    holds("and moves nothing", tab.master["hip"] == held and not tab.master["engaged"])
    holds("no error in the second tab", not other.errors, other.errors)
    other.page.close()


def check_controls(tab):
    tab.page.locator("#delay").fill("200")
    tab.until("the network changed", lambda: tab.about["network"]["up"].startswith("delay 200ms"))
    tab.until("an older picture", lambda: tab.master["scene_age_s"] > 0.38)
    holds("the delay acts at once", True)
    tab.page.locator("#preset").select_option("lan")
    tab.until("a preset", lambda: tab.master["scene_age_s"] < 0.2)
    holds("a preset acts at once", True)
    tab.page.locator("#mode").select_option("paper")
    tab.page.locator("#mass").fill("1.4")
    tab.page.locator("#session-form button").click()
    tab.until("a second session", lambda: tab.about["session"] == 2 and tab.about["state"] == "running")
    settings = tab.about["settings"]
    holds("a new session is as it was asked for", settings["mode"] == "paper" and settings["mass_kg"] == 1.4, settings)


def check_stop(tab):
    tab.until("the script at work", lambda: tab.master["engaged"] and tab.master["elapsed_s"] > 0.5)
    tab.page.keyboard.press("Escape")
    tab.until("the emergency stop on both sides", lambda: tab.master["stopped_by"] == tab.frame["slave"]["stopped_by"] == "master")
    tab.until("no force", lambda: tab.master["hand_force"] == [0, 0])
    stood = tab.master["hip"]
    time.sleep(0.5)
    holds("an emergency stop takes the force and holds the hand", tab.master["hip"] == stood and tab.master["hand_force"] == [0, 0])
    tab.page.locator("#banner button").click()
    tab.until("the script at work again", lambda: tab.master["stopped_by"] is None and tab.master["hip"] != stood)
    holds("and is cleared where it was set", True)
    tab.page.locator("#end").click()
    tab.until("the end", lambda: tab.about["state"] == "ended")
    holds("the end leaves no force", tab.master["hand_force"] == [0, 0], tab.master["hand_force"])
    tab.page.locator("#banner button").click()
    tab.until("a third session", lambda: tab.about["session"] == 3 and tab.about["state"] == "running")
    holds("and a person may start again", True)


def take_shots(browser, address, place):
    for name, size, scale in [("wide", (1440, 900), 1), ("phone", (390, 844), 2)]:
        for theme in ["light", "dark"]:
            viewport = {"width": size[0], "height": size[1]}
            context = browser.new_context(viewport=viewport, device_scale_factor=scale, color_scheme=theme)
            tab = Tab(context, address)
            tab.until("the first picture", lambda: tab.master["footprint"])
            # the charts are full
            full = tab.master["elapsed_s"] + 11
            tab.until("a push", lambda: tab.master["elapsed_s"] > full and tab.master["in_contact"])
            tab.page.wait_for_timeout(500)
            tab.page.screenshot(path=f"{place}/console-{name}-{theme}.png")
            context.close()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("mmt")
    parser.add_argument("--shots")
    parser.add_argument("--browser", default=shutil.which("chromium") or shutil.which("google-chrome"))
    parser.add_argument("more", nargs="*", help="further arguments of mmt demo, after --")
    arguments = parser.parse_args()
    command = [arguments.mmt, "demo", "--console", "--json", "--duration", "600s" if arguments.shots else "8s"]
    demo = subprocess.Popen([*command, *arguments.more], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        line = next(line for line in demo.stderr if "http://" in line)
        address = urlsplit(line.split()[-1])
        with sync_playwright() as play:
            browser = play.chromium.launch(executable_path=arguments.browser, args=["--no-sandbox"])
            if arguments.shots:
                take_shots(browser, address.geturl(), arguments.shots)
            else:
                context = browser.new_context()
                tab = Tab(context, address.geturl())
                check_admission(address)
                check_hand(tab)
                check_layout(tab)
                check_observer(context, address.geturl(), tab)
                check_controls(tab)
                check_stop(tab)
                foreign = [url for url in tab.requests if urlsplit(url).netloc != address.netloc and not url.startswith("data:")]
                holds("nothing is fetched from elsewhere", not foreign, foreign)
                holds("no error in the browser's console", not tab.errors, tab.errors)
            browser.close()
        if arguments.shots:
            demo.terminate()
        out, _ = demo.communicate(timeout=PATIENCE_S)
        holds("a demo that nobody watches ends by itself, its report the only data", demo.returncode == 0 and json.loads(out))
    finally:
        demo.kill()


if __name__ == "__main__":
    main()
