#!/usr/bin/env python3
"""A blind comparison in a real browser: consent, a part, its question, the other part, its question, the end.

    blind.py [--shots DIR] [--browser PATH] MMT

MMT is the program. Each promise is printed when it holds; the first that does not ends with exit code 1.
"""

import argparse
import csv
import pathlib
import shutil
import signal
import subprocess
import tempfile
from urllib.parse import urlsplit

from check import PATIENCE_S, Tab, holds
from playwright.sync_api import sync_playwright

CONSENT = "You push a box with the pointer.\nYou may stop at any time."
QUESTION = "How heavy did the box feel?"
CONFIGURATIONS = {"near.toml": 'up = "delay 3ms"\ndown = "delay 3ms"\n[slave.environment]\nmass_kg = 0.7\n',
    "far.toml": 'up = "delay 171ms"\ndown = "delay 171ms"\n[slave]\nmode = "paper"\n'}
# what would tell which is which
TELLING = ["near", "far", "171", "3ms", "paper", "recommended", "delay 50", "hybrid", "useful"]


class Sitting(Tab):
    """A page of a study, and all that came over its socket."""

    def __init__(self, context, address):
        self.texts = []
        super().__init__(context, address)

    def _take(self, text):
        if '"about"' in text:
            self.texts.append(text)
        super()._take(text)

    def stage(self, name):
        self.until(f"the stage {name}", lambda: self.about["study"]["stage"] == name)

    def press(self, name):
        self.page.get_by_role("button", name=name).click()


def start(mmt, folder, more=()):
    """The program in its folder, and the address of its page."""
    command = [mmt, "demo", "--blind", "near.toml", "far.toml", "--consent", "consent.txt", "--question", QUESTION,
        "--study", "study", "--duration", "10s", *more]
    demo = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    line = next(line for line in demo.stderr if "http://" in line)
    return demo, urlsplit(line.split()[-1]).geturl()


def rows(folder, name):
    with open(folder / "study" / name, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def check_hidden(tab, where):
    page = tab.page.inner_text("body") + tab.page.title()
    found = [word for word in TELLING if word in page or any(word in text for text in tab.texts)]
    holds(f"{where} tells nothing of which it is", not found, found)
    for control in ["#delay", "#preset", "#mode", "#driver", "#end", ".charts", ".facts", ".log", "#setting"]:
        holds(f"{where} shows no {control}", not tab.page.locator(control).is_visible())


def check_part(tab, number, answer, shot):
    tab.stage("ready")
    shot("ready")
    tab.press("Begin")
    tab.stage("part")
    tab.until("a session", lambda: tab.about["state"] == "running" and tab.master["footprint"])
    for control in ["#stop", "#pause", "#scene"]:
        holds(f"part {number} has {control}", tab.page.locator(control).is_visible())
    check_hidden(tab, f"part {number}")
    holds(f"part {number}: no frame of the other side", tab.frame["slave"] is None and tab.master["rtt_ms"] is None)
    there, here = tab.master["model"]["position"], tab.master["hip"]
    tab.drag([there[axis] - here[axis] for axis in (0, 1)], 1.5)
    holds(f"part {number}: the remote object is not shown, nor its delay", tab.master["scene"] is None)
    tab.page.keyboard.press("s")
    shot("part")
    tab.page.mouse.up()
    tab.page.wait_for_timeout(300)
    holds(f"part {number}: the hand is the person's alone", tab.master["person"]["driver"] == "pointer", tab.master["person"])
    tab.stage("question")
    holds(f"part {number} asks the owner's question", QUESTION in tab.page.inner_text("#study"))
    check_hidden(tab, f"question {number}")
    button = tab.page.get_by_role("button", name="Answer")
    holds(f"question {number} wants an answer", button.is_disabled())
    tab.page.locator(f'input[value="{answer}"]').check(force=True)
    shot("question")
    button.click()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("mmt")
    parser.add_argument("--shots")
    parser.add_argument("--browser", default=shutil.which("chromium") or shutil.which("google-chrome"))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place, sync_playwright() as play:
        folder = pathlib.Path(place)
        for name, text in {**CONFIGURATIONS, "consent.txt": CONSENT}.items():
            (folder / name).write_text(text, encoding="utf-8")
        demo, address = start(arguments.mmt, folder)
        browser = play.chromium.launch(executable_path=arguments.browser, args=["--no-sandbox"])
        try:
            phone = {"viewport": {"width": 390, "height": 844}, "device_scale_factor": 2}
            wide = {"viewport": {"width": 1440, "height": 900}}
            tab = Sitting(browser.new_context(**wide), address)

            def shot(name):
                for size, more in [("wide", wide), ("phone", phone)] if arguments.shots else []:
                    tab.page.set_viewport_size(more["viewport"])
                    tab.page.wait_for_timeout(200)
                    tab.page.screenshot(path=f"{arguments.shots}/blind-{name}-{size}.png")
                if arguments.shots:
                    tab.page.set_viewport_size(wide["viewport"])

            tab.stage("consent")
            holds("the consent is the owner's", CONSENT.split("\n")[1] in tab.page.inner_text("#study"))
            check_hidden(tab, "the consent")
            shot("consent")
            tab.press("I agree")
            check_part(tab, 1, 3, shot)
            tab.stage("ready")
            # the program is killed between the parts
            demo.kill()
            demo.wait()
            holds("the first answer is there when the program is killed", [row["answer"] for row in rows(folder, "results.csv")] == ["3"])
            demo, address = start(arguments.mmt, folder)
            code = rows(folder, "participants.csv")[0]["participant"]
            tab = Sitting(browser.new_context(**wide), address)
            tab.stage("consent")
            tab.press(f"Go on as {code}")
            check_part(tab, 2, 6, shot)
            tab.stage("done")
            holds("the end shows the code", code in tab.page.inner_text("#study"))
            shot("done")
            tab.press("Next participant")
            tab.stage("consent")
            tab.press("I agree")
            tab.stage("ready")
            holds("no error in the browser's console", not tab.errors, tab.errors)
            demo.send_signal(signal.SIGTERM)
            out, _ = demo.communicate(timeout=PATIENCE_S)
            holds("SIGTERM ends the study in order", demo.returncode == 0 and "both parts: 1" in out, out)
        finally:
            demo.kill()
            browser.close()
        people, answers = rows(folder, "participants.csv"), rows(folder, "results.csv")
        holds("the next participant has the other order", sorted(row["order"] for row in people) == ["AB", "BA"], people)
        holds("one row a part", [(row["participant"], row["part"], row["answer"]) for row in answers] == [(code, "1", "3"), (code, "2", "6")], answers)
        order = people[0]["order"]
        holds("each with its condition", "".join(row["condition"] for row in answers) == order, answers)
        files = dict(zip("AB", CONFIGURATIONS))
        holds("and its file", all(row["configuration"] == files[row["condition"]] for row in answers), answers)
        for row in answers:
            report = subprocess.run([arguments.mmt, "report", str(folder / "study" / row["record"]), "--out", str(folder / "figures")], capture_output=True, text=True, check=False)
            holds(f"part {row['part']} is recorded", report.returncode == 0, report.stderr)


if __name__ == "__main__":
    main()
