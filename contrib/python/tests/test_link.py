"""What `mmt.Link` promises."""

import numpy as np
import pytest

import mmt

WORDS = "delay 50ms 5ms loss 10% duplicate 5% corrupt 1%"


def test_a_packet_comes_after_the_delay():
    link = mmt.Link("delay 50ms")
    assert link.offer(1.0, b"hello") == 0
    assert link.next_time == pytest.approx(1.05) and link.in_flight == 1
    assert link.poll(1.0499) == []
    (out,) = link.poll(1.06)
    assert (out.number, out.offered, out.payload, out.fate) == (0, 1.0, b"hello", "delivered")
    assert out.time == pytest.approx(1.05) and not (out.copy or out.corrupted or out.marked)
    assert link.next_time is None and link.in_flight == 0
    assert link.words == "delay 50ms" and "delay 50ms" in repr(link)


def test_the_counts_are_those_of_what_comes_out():
    link = mmt.Link(WORDS, seed=4)
    outs = []
    for n in range(4000):
        link.offer(n * 1e-3, bytes(50))
        outs += link.poll(n * 1e-3)
    outs += link.poll(10.0)
    stats = link.stats
    assert stats["offered"] == 4000 and stats["bytes_offered"] == 200_000
    assert stats["offered"] + stats["duplicated"] == stats["delivered"] + sum(stats["dropped"].values()) + link.in_flight
    assert sum(out.fate == "delivered" for out in outs) == stats["delivered"]
    assert sum(out.copy for out in outs) > 50 and 300 < stats["dropped"]["loss"] < 550
    corrupted = [out for out in outs if out.corrupted]
    assert len(corrupted) == stats["corrupted"] > 10
    assert all(sum(byte.bit_count() for byte in out.payload) == 1 for out in corrupted)
    assert [out.time for out in outs] == sorted(out.time for out in outs)


# in a chain a copy may come of what was lost later
@pytest.mark.parametrize("words", [WORDS, "delay 5ms duplicate 100%; then delay 50ms 5ms loss 30%"])
def test_many_at_once_are_the_same_as_one_by_one(words):
    times = np.arange(3000) * 2e-3
    arrived, fate = mmt.Link(words, seed=2).send(times, 50)
    link, outs = mmt.Link(words, seed=2), []
    for time in times:
        link.offer(time, bytes(50))
        outs += link.poll(time)
    outs += link.poll(times[-1] + 1)
    first = {}
    for out in outs:
        known = first.get(out.number)
        if known is None or (known.fate == "loss" and out.fate == "delivered"):
            first[out.number] = out
    for n, (time, name) in enumerate(zip(arrived, fate)):
        out = first[n]
        if out.fate == "delivered":
            assert time == out.time and name == ("corrupted" if out.corrupted else "delivered")
        else:
            assert np.isnan(time) and name == out.fate


def test_equal_links_are_equal_and_each_direction_of_a_seed_draws_its_own():
    times = np.arange(500) * 1e-2
    one, again = mmt.Link(WORDS).send(times), mmt.Link(WORDS).send(times)
    assert np.array_equal(one[0], again[0], equal_nan=True) and np.array_equal(one[1], again[1])
    assert not np.array_equal(one[1], mmt.Link(WORDS, seed=2).send(times)[1])
    assert not np.array_equal(one[1], mmt.Link(WORDS, direction="down").send(times)[1])


def test_a_link_is_the_link_of_a_run():
    words = {"up": "delay 30ms 5ms loss 5%", "down": "delay 30ms 5ms loss 5%"}
    packets = mmt.run(words, duration=5.0, seed=6).packets
    for way in ["up", "down"]:
        of = packets[packets["direction"] == way]
        arrived, fate = mmt.Link(words[way], seed=6, direction=way).send(of["sent"], of["bytes"])
        done = of["fate"] != "under_way"
        assert np.array_equal(fate[done], of["fate"][done])
        assert np.allclose(arrived[done], of["arrived"][done], atol=1e-9, rtol=0, equal_nan=True)


def test_a_queue_is_a_queue():
    # 1000 bytes at 1 Mbit/s take 8 ms
    arrived, fate = mmt.Link("rate 1mbit").send(np.zeros(10), 1000)
    assert np.allclose(arrived, 8e-3 * np.arange(1, 11), atol=1e-6)
    link = mmt.Link("rate 1mbit")
    for _ in range(3):
        link.offer(0.0, bytes(1000))
    assert [round(out.queued, 6) for out in link.poll(1.0)] == [0.0, 0.008, 0.016]
    arrived, fate = mmt.Link("mtu 500").send([0.0, 1.0], [500, 501])
    assert list(fate) == ["delivered", "mtu"] and np.isnan(arrived[1])


def test_time_does_not_go_back_and_wrong_things_are_named():
    link = mmt.Link("delay 10ms")
    link.offer(1.0, b"")
    for time in [0.5, -1.0, float("nan"), 1e12]:
        with pytest.raises(ValueError, match="time is"):
            link.offer(time, b"")
    with pytest.raises(ValueError, match="must not fall"):
        link.send([2.0, 1.5])
    with pytest.raises(ValueError, match="3 sizes for 2"):
        link.send([2.0, 2.5], [1, 2, 3])
    with pytest.raises(ValueError, match="65535"):
        link.send([2.0], 70_000)
    with pytest.raises(ValueError, match="expected a unit"):
        mmt.Link("delay 50 parsecs")
    with pytest.raises(ValueError, match="none.csv"):
        mmt.Link("trace none.csv")
    with pytest.raises(ValueError, match="sideways"):
        mmt.Link("none", direction="sideways")
    empty = mmt.Link("none").send([])
    assert empty[0].shape == (0,) and empty[1].shape == (0,)
