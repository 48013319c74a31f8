"""What a user with a type checker writes; `.ci/python` holds it to `mypy --strict`."""

import numpy as np
import numpy.typing as npt

import mmt


def trigger(now: mmt.TriggerInput) -> bool:
    return now.slave_in_contact and abs(now.f_s[0] - now.f_m[0]) > 0.3


def estimator(measured: mmt.Measured) -> tuple[float, float, float] | None:
    return (0.7, 3.0, 2.0) if measured.normal is not None else None


def operator(
    time: float, hip: tuple[float, float], force: tuple[float, float], pose: tuple[float, float, float]
) -> npt.NDArray[np.float64]:
    return np.array([0.1 * time, pose[1]])


run: mmt.Run = mmt.run({"up": "delay 50ms"}, duration=0.1, trigger=trigger, estimator=estimator, operator=operator)
error: npt.NDArray[np.float64] = run.f_s - run.f_m_played
sent: npt.NDArray[np.void] = run.packets[run.packets["fate"] == "loss"]
arrived, fate = mmt.Link("delay 50ms loss 1%").send(np.arange(10) * 1e-3)
late: float = float(np.nanmax(arrived))
env = mmt.Env(duration=0.1)
seen, info = env.reset(seed=1)
seen, reward, terminated, truncated, info = env.step(seen[:2])
env.step({"hip": (0.0, 0.0), "parameters": (0.7, 3.0, 2.0), "send": True})
