"""What the tests share: the program `mmt`, and a record that it made."""

import os
import pathlib
import signal
import subprocess

import pytest

# 50 ms each way with jitter and loss
WAN = {"up": "delay 50ms 5ms loss 2%", "down": "delay 50ms 5ms loss 2%"}


@pytest.fixture(scope="session")
def program() -> str:
    """The program to compare with; `.ci/python` names it."""
    found = os.environ.get("MMT")
    if not found:
        pytest.fail("the environment variable MMT has to name the program mmt")
    return found


@pytest.fixture
def interruptible():
    """Ctrl-C is heard: a shell in the background has its commands ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def recorded(program: str, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A session of two seconds over a real network on this machine."""
    record = tmp_path_factory.mktemp("record") / "run.mcap"
    command = [program, "demo", "--duration", "2s", "--no-console", "--record", str(record)]
    # it is real time: a machine that stands still for a second ends the session
    for _ in range(5):
        done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if done.returncode == 0:
            return record
        record.unlink(missing_ok=True)
    pytest.fail(f"no session on this machine: {done.stderr}")
