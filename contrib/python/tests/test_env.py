"""What `mmt.Env` promises, and that Gymnasium takes it."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import mmt
from conftest import WAN


def go(env, actions):
    return [env.step(action) for action in actions]


def test_the_same_way_is_the_same_run_however_it_is_cut():
    way = mmt.run(WAN, duration=4.0).hip
    expected = mmt.run(WAN, duration=4.0).digest
    for ticks in [1, 10, 250]:
        env = mmt.Env(WAN, duration=4.0, ticks=ticks)
        env.reset()
        steps = go(env, way.reshape(-1, ticks, 2))
        *_, truncated, info = steps[-1]
        assert truncated and info["metrics"]["digest"] == expected, ticks
        assert not any(step[3] for step in steps[:-1])


def test_what_a_dict_leaves_out_is_mmts_own():
    run = mmt.run(WAN, duration=3.0)
    env = mmt.Env(WAN, duration=3.0, ticks=100)
    env.reset()
    steps = go(env, [{}] * 30)
    assert steps[-1][4]["metrics"]["digest"] == run.digest
    seen = np.array([step[0] for step in steps])
    at = np.arange(99, 3000, 100)
    # where the hand is; a run has what is sent of it, in steps of 0.1 um
    assert np.abs(seen[:, :2] - run.hip[at]).max() <= 0.51e-7
    for columns, array in [((2, 3), run.hand_force), ((4, 5, 6), run.pose_model), ((8, 9, 10), run.parameters_model)]:
        assert np.array_equal(seen[:, columns], array[at])
    assert np.array_equal(seen[:, 7], run.touching[at])
    for name in ["tool", "f_s", "f_shadow", "f_m_played", "pose_true"]:
        unknown = np.full(3 if name == "pose_true" else 2, np.nan)
        there = np.array([step[4].get(name, unknown) for step in steps])
        assert np.array_equal(there[1:], getattr(run, name)[at][1:], equal_nan=True), name
    causes = [cause for step in steps for cause in step[4]["updates"]]
    assert causes == list(run.update[run.update != ""])
    assert len(mmt.Env.OBSERVATION) == seen.shape[1]


def test_the_hand_goes_evenly_to_where_it_is_sent():
    env = mmt.Env(duration=1.0, ticks=100)
    start, info = env.reset()
    assert info["time"] == 0.0 and "stamp" not in info
    seen, reward, terminated, truncated, info = env.step(start[:2] + [0.01, 0.02])
    assert np.allclose(seen[:2], start[:2] + [0.01, 0.02], atol=1e-5)
    assert (reward, terminated, truncated) == (0.0, False, False) and info["time"] == pytest.approx(0.1)
    assert info["link"] == "fresh" and "metrics" not in info


def test_parameters_and_updates_are_those_of_the_agent():
    env = mmt.Env({"slave.trigger.scheme": "every-sample"}, duration=1.0, ticks=10)
    env.reset()
    env.step({})
    *_, info = env.step({"parameters": (1.25, 4.0, 3.0), "send": "timer"})
    assert info["updates"] == ["timer"] and info["parameters_refused"] == 0
    for _ in range(50):
        seen, *_, info = env.step({"parameters": np.array([1.25, 4.0, 3.0]), "send": True})
        assert info["updates"] == ["deadband"]
    assert np.allclose(seen[8:], (1.25, 4.0, 3.0), rtol=1e-3)
    *_, info = env.step({"send": False})
    assert info["updates"] == []
    *_, info = env.step({"parameters": (-1.0, 4.0, 3.0)})
    assert info["parameters_refused"] == 10 and info["updates"] == ["every_sample"] * 10


def test_seeds_are_the_runs_own():
    env = mmt.Env(WAN, duration=0.5, ticks=500)

    def digest(**how):
        env.reset(**how)
        return env.step({})[4]["metrics"]["digest"]

    assert digest(seed=7) == mmt.run(WAN, duration=0.5, seed=7).digest
    assert digest() == mmt.run(WAN, duration=0.5, seed=8).digest
    assert digest() == mmt.run(WAN, duration=0.5, seed=9).digest
    assert digest(seed=7, options={"config": {}}) == mmt.run(duration=0.5, seed=7).digest


def test_an_env_reports_what_is_wrong():
    env = mmt.Env(duration=0.02, ticks=10)
    with pytest.raises(RuntimeError, match="reset"):
        env.step((0.0, 0.0))
    env.reset()
    for action in [(0.0,), np.zeros((3, 2)), (0.0, np.nan), {"hip": np.zeros(4)}, {"hop": 1}, {"send": 2.5}]:
        with pytest.raises((ValueError, TypeError)):
            env.step(action)
    go(env, [{}, {}])
    with pytest.raises(RuntimeError, match="over"):
        env.step({})
    env.close()
    with pytest.raises(ValueError, match="1 to 1000"):
        mmt.Env(ticks=0)
    with pytest.raises(ValueError, match="line 1"):
        env.reset(options={"config": {"seed": -1}})


def test_a_link_that_falls_silent_ends_the_episode():
    env = mmt.Env({"down": "outage 500ms for 60s"}, duration=5.0, ticks=100)
    env.reset()
    for step in range(50):
        *_, terminated, truncated, info = env.step({})
        if terminated:
            break
    assert terminated and not truncated and info["link"] == "released" and "metrics" in info


class Push(gymnasium.Env):
    """mmt under Gymnasium: the wrapper of docs/python.md."""

    def __init__(self):
        self.mmt = mmt.Env(WAN, duration=1.0, ticks=10)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (11,), np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.mmt.reset(seed=seed, options=options)

    def step(self, action):
        seen, _, terminated, truncated, info = self.mmt.step(action)
        return seen, float(seen[4]), terminated, truncated, info


def test_gymnasium_takes_it():
    with warnings.catch_warnings():
        # that the space of what is seen has no bounds
        warnings.simplefilter("ignore", UserWarning)
        check_env(Push(), skip_render_check=True)
