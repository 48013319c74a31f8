"""What operators, estimators and update schemes of Python are promised."""

import math

import numpy as np
import pytest

import mmt
from conftest import WAN


def test_the_deadband_in_python_is_the_deadband_to_the_bit():
    def deadband(now: mmt.TriggerInput) -> bool:
        if not (now.slave_in_contact and now.shadow_in_contact):
            return False
        f_s, f_m = now.f_s, now.f_m
        error = math.sqrt((f_s[0] - f_m[0]) ** 2 + (f_s[1] - f_m[1]) ** 2)
        felt = 0.1 * max(math.sqrt(f_s[0] ** 2 + f_s[1] ** 2), 0.04)
        return error > max(felt, 3.5 * now.noise_n)

    base = {"slave.mode": "paper", "slave.trigger.scheme": "deadband 10%"}
    own = mmt.run(base, duration=6.0, start="paper-experiment")
    assert own.metrics["packets_deadband"] > 10
    other = {"slave.mode": "paper", "slave.trigger.scheme": "every-sample"}
    # what a config says of a scheme only stands in the welcome: under another one it is the same
    assert mmt.run(other, duration=6.0, start="paper-experiment", trigger=deadband).digest == own.digest
    assert mmt.run(other, duration=6.0, start="paper-experiment").digest != own.digest


def test_a_scheme_states_what_cause_its_updates_have():
    names = iter(["deadband", "timer", "every_sample"])
    run = mmt.run(duration=0.5, trigger=lambda now: next(names, None))
    assert list(run.update[run.update != ""][:3]) == ["deadband", "timer", "every_sample"]
    assert mmt.run({"slave.trigger.scheme": "every-sample"}, duration=4.0).digest == (
        mmt.run(duration=4.0, trigger=lambda now: "every_sample").digest
    )
    with pytest.raises(ValueError, match="every_sample"):
        mmt.run(duration=1.0, trigger=lambda now: "contact_lost")
    with pytest.raises(ValueError, match="no answer of a scheme"):
        mmt.run(duration=1.0, trigger=lambda now: 3.5)


def test_the_inputs_of_a_scheme_are_those_of_its_sample():
    seen = []
    run = mmt.run(WAN, duration=3.0, trigger=lambda now: seen.append(now))
    plays = ~np.isnan(run.stamp)
    assert np.array_equal([now.time for now in seen], run.stamp[plays])
    assert np.array_equal([now.slave_in_contact for now in seen], run.in_contact[plays])
    assert all(len(now.parameters) == 3 and len(now.shift) == 2 for now in seen)


def test_an_estimator_is_what_the_master_gets():
    theirs, seen = (1.25, 4.0, 3.0), []

    def estimator(measured: mmt.Measured):
        seen.append(measured)
        return theirs

    run = mmt.run(WAN, duration=6.0, estimator=estimator)
    assert np.allclose(run.parameters_model[-1], theirs)
    plays = ~np.isnan(run.stamp)
    assert np.array_equal([measured.time for measured in seen], run.stamp[plays])
    assert all(measured.side > 0.1 and len(measured.centre) == 2 for measured in seen)
    touched = [measured.normal for measured in seen if measured.normal]
    assert touched and np.allclose(np.hypot(*np.array(touched).T), 1.0)
    # none, and what no model may have, leave mmt's own
    own = mmt.run(WAN, duration=6.0).digest
    assert own != run.digest
    assert mmt.run(WAN, duration=6.0, estimator=lambda measured: None).digest == own
    assert mmt.run(WAN, duration=6.0, estimator=lambda measured: np.array([-1.0, 0.0, 0.0])).digest == own


def test_an_operator_that_repeats_a_run_makes_it_again():
    first = mmt.run(WAN, duration=4.0)
    given = []

    def operator(time, hip, force_on_hand, pose):
        given.append((time, *hip, *force_on_hand, *pose))
        return first.hip[len(given) - 1]

    again = mmt.run(WAN, duration=4.0, operator=operator)
    assert again.digest == first.digest
    given = np.array(given)
    assert np.allclose(given[:, 0], first.time)
    assert np.array_equal(given[1:, 1:3], first.hip[:-1])
    assert np.array_equal(given[1:, 3:5], first.hand_force[:-1])


@pytest.mark.parametrize("port", ["operator", "trigger", "estimator"])
def test_what_a_function_raises_ends_the_run(port):
    def fails(*_):
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        mmt.run(duration=1.0, **{port: fails})


@pytest.mark.parametrize("answer", [None, (1.0,), (1.0, math.nan), "xy"])
def test_a_hip_that_is_none_is_refused(answer):
    with pytest.raises((ValueError, TypeError)):
        mmt.run(duration=1.0, operator=lambda *_: answer)
