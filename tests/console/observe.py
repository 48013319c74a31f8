#!/usr/bin/env python3
"""The page of an observer in a real browser, beside a scripted operator: it shows the object and moves nothing.

    observe.py [--browser PATH] MMT

MMT is the program. Each promise is printed when it holds; the first that does not ends with exit code 1.
"""

import argparse
import json
import math
import shutil
import subprocess
from urllib.parse import urlsplit

from check import PATIENCE_S, Tab, holds
from playwright.sync_api import sync_playwright


class Looking(Tab):
    """A page that looks on."""

    def _take(self, text):
        super()._take(text)
        self.frame = json.loads(text).get("observer", self.frame)


def start(mmt, *words, **pipes):
    return subprocess.Popen([mmt, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **pipes)


def check_page(tab, operator):
    tab.until("a picture of the operator's work", lambda: tab.frame["scene"] and tab.frame["footprint"])
    holds("who looks on observes", tab.role == "observer", tab.role)
    shown = tab.page.locator("button:visible:not(#theme), input:visible, select:visible")
    holds("the page has no control but its theme", shown.count() == 0, shown.all_inner_texts())

    def box():
        return tab.frame["scene"]["object"]["position"]

    before = box()
    # whatever a person does here
    tab.drag([0.3, 0.1], 1.0)
    tab.page.mouse.up()
    for key in ["Escape", "Space", "s", "c", "q"]:
        tab.page.keyboard.press(key)
    tab.until("the box pushed by the operator", lambda: math.dist(box(), before) > 0.02)
    holds("it shows what the operator moves", operator.poll() is None)
    holds("and stops nothing", not tab.frame["stopped"] and tab.frame["link"] == "fresh", tab.frame)
    tab.until("an update of this session", lambda: tab.frame["change"] and sum(tab.frame["updates"]))
    holds("the model is that of the newest update", tab.frame["params"] and all(value > 0.0 for value in tab.frame["params"]))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("mmt")
    parser.add_argument("--browser", default=shutil.which("chromium") or shutil.which("google-chrome"))
    arguments = parser.parse_args()
    began = []

    def begin(*words, **pipes):
        began.append(start(arguments.mmt, *words, **pipes))
        return began[-1]

    try:
        slave = begin("slave", "--listen", "127.0.0.1:0", "--observers", "1", "--once", "--json")
        pairing = slave.stdout.readline().strip()
        viewer = begin("master", pairing, "--observe", "--console", "--json")
        address = urlsplit(next(line for line in viewer.stderr if "http://" in line).split()[-1])
        operator = begin("master", pairing, "--duration", "60s", "--json")
        with sync_playwright() as play:
            browser = play.chromium.launch(executable_path=arguments.browser, args=["--no-sandbox"])
            tab = Looking(browser.new_context(), address.geturl())
            check_page(tab, operator)
            holds("no error in the browser's console", not tab.errors, tab.errors)
            browser.close()
        report = json.loads(operator.communicate(timeout=2.0 * PATIENCE_S)[0])
        holds("the operator's session ends as it was asked for", operator.returncode == 0 and report["updates"]["applied"] > 0, report["ending"])
    finally:
        for process in began:
            process.kill()


if __name__ == "__main__":
    main()
