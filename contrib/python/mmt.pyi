"""Types of the package `mmt` (docs/python.md)."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, ClassVar, Literal, TypeAlias, final

import numpy as np
import numpy.typing as npt

__version__: str
__all__ = [
    "Command",
    "Departure",
    "Device",
    "Env",
    "Link",
    "Measured",
    "Plant",
    "Record",
    "Run",
    "TriggerInput",
    "__version__",
    "default_config",
    "read",
    "run",
    "sweep",
]

_Numbers: TypeAlias = npt.NDArray[np.float64]
_Wholes: TypeAlias = npt.NDArray[np.uint64]
_Truths: TypeAlias = npt.NDArray[np.bool_]
_Words: TypeAlias = npt.NDArray[np.str_]
_Pair: TypeAlias = tuple[float, float]
_Triple: TypeAlias = tuple[float, float, float]
_Given: TypeAlias = str | PathLike[str] | dict[str, Any]
_Start: TypeAlias = Literal["live", "paper-experiment"]
_Cause: TypeAlias = Literal["deadband", "timer", "every_sample"]
_Two: TypeAlias = Sequence[float] | _Numbers
_Three: TypeAlias = Sequence[float] | _Numbers
_Column: TypeAlias = _Numbers | _Wholes | _Truths | _Words | list[bytes]

def default_config(mode: Literal["recommended", "paper"] = "recommended") -> str: ...
def run(
    config: _Given | None = None,
    *,
    duration: float = 20.0,
    start: _Start = "live",
    seed: int | None = None,
    hip: npt.ArrayLike | None = None,
    operator: Callable[[float, _Pair, _Pair, _Triple], _Two] | None = None,
    trigger: Callable[[TriggerInput], bool | np.bool_ | _Cause | None] | None = None,
    estimator: Callable[[Measured], _Three | None] | None = None,
) -> Run: ...
def sweep(
    plan: _Given,
    out: str | PathLike[str],
    *,
    config: _Given | None = None,
    jobs: int | None = None,
    shard: str | None = None,
) -> dict[str, Any]: ...
def read(record: str | PathLike[str]) -> Record: ...
@final
class Run:
    """N rows, one a millisecond; lengths in m, forces in N, angles in rad, times in s."""

    @property
    def time(self) -> _Numbers:
        """Since the start by the master's clock, s; (N,)."""
    @property
    def hip(self) -> _Numbers:
        """HIP as it is used and sent, m; (N, 2)."""
    @property
    def f_m(self) -> _Numbers:
        """Force on the object that is felt, N; (N, 2)."""
    @property
    def hand_force(self) -> _Numbers:
        """Force on the hand, limited, N; (N, 2)."""
    @property
    def touching(self) -> _Truths:
        """Whether the HIP touches the master's model; (N,)."""
    @property
    def pose_model(self) -> _Numbers:
        """x, y, angle of the master's model, m, m, rad; (N, 3)."""
    @property
    def parameters_model(self) -> _Numbers:
        """m, b, c of the master's model, kg, N s/m, N; (N, 3)."""
    @property
    def stamp(self) -> _Numbers:
        """Time of the sample that the slave plays, s; (N,), NaN before the first."""
    @property
    def tool(self) -> _Numbers:
        """The slave's tool, m; (N, 2)."""
    @property
    def f_s(self) -> _Numbers:
        """Measured force on the object, N; (N, 2)."""
    @property
    def f_s_true(self) -> _Numbers:
        """The same as it is, N; (N, 2)."""
    @property
    def f_shadow(self) -> _Numbers:
        """f_m as the slave knows it, N; (N, 2)."""
    @property
    def f_m_played(self) -> _Numbers:
        """f_m as rendered for the sample that is played, N; (N, 2), NaN where that was lost."""
    @property
    def in_contact(self) -> _Truths:
        """Whether the tool touches the object; (N,)."""
    @property
    def pose_true(self) -> _Numbers:
        """x, y, angle of the object, m, m, rad; (N, 3)."""
    @property
    def parameters_estimate(self) -> _Numbers:
        """m, b, c of mmt's own estimator, kg, N s/m, N; (N, 3)."""
    @property
    def parameters_true(self) -> _Numbers:
        """m, b, c of the object at the end, kg, N s/m, N; (3,)."""
    @property
    def update(self) -> _Words:
        """Cause of the update of this sample, "" for none; (N,)."""
    @property
    def packets(self) -> npt.NDArray[np.void]:
        """Fields direction, number, kind, update, cause, repeat, bytes, sent (s), arrived (s, NaN if not), fate."""
    @property
    def metrics(self) -> dict[str, Any]:
        """The measured columns of a sweep; None where one has no meaning."""
    @property
    def digest(self) -> str:
        """SHA-256 of everything that happened."""
    @property
    def config(self) -> str:
        """The whole configuration, TOML."""

@final
class TriggerInput:
    @property
    def time(self) -> float:
        """Stamp of the HIP sample, s."""
    @property
    def f_s(self) -> _Pair:
        """Measured force on the object, N."""
    @property
    def f_m(self) -> _Pair:
        """Force of the master's model, N."""
    @property
    def noise_n(self) -> float:
        """Noise of f_s per axis beyond the default sensor's, N."""
    @property
    def slave_in_contact(self) -> bool: ...
    @property
    def shadow_in_contact(self) -> bool: ...
    @property
    def hip_stands(self) -> bool: ...
    @property
    def sticking(self) -> bool: ...
    @property
    def speed(self) -> float:
        """Of the object along the push, m/s."""
    @property
    def acceleration(self) -> float:
        """m/s^2."""
    @property
    def force_deviation(self) -> float:
        """Of the predicted force, N."""
    @property
    def parameters(self) -> _Triple:
        """m, b, c, kg, N s/m, N."""
    @property
    def only_friction_holds(self) -> bool:
        """The tool is in front of another face than it touched last, of an object that has been moved."""
    @property
    def shift(self) -> _Pair:
        """From the pose that the master's object is on its way to, by an update, m."""
    @property
    def shift_deviation(self) -> float:
        """Of the shift per axis while nobody touches the object, m; else 0."""
    @property
    def turn(self) -> float:
        """The same, rad."""
    @property
    def turn_deviation(self) -> float:
        """Of the turn, rad."""

@final
class Measured:
    @property
    def time(self) -> float:
        """Stamp of the HIP sample, s."""
    @property
    def tool(self) -> _Pair:
        """m."""
    @property
    def back(self) -> _Pair:
        """How far the tool stands back from there by a spring of its own, m."""
    @property
    def force(self) -> _Pair:
        """f_s on the object, N."""
    @property
    def force_noise_n(self) -> float:
        """N."""
    @property
    def held_back(self) -> bool:
        """Whether the limit of the tool's force keeps the tool from the HIP."""
    @property
    def normal(self) -> _Pair | None:
        """Inward unit normal of the touched face."""
    @property
    def centre(self) -> _Pair | None:
        """Of the object as it is seen, m."""
    @property
    def side(self) -> float | None:
        """Of the object as the model has it, m."""
    @property
    def turning(self) -> float | None:
        """Of the touched face, rad/s."""

@final
class Link:
    def __new__(cls, words: str, *, seed: int = 1, direction: Literal["up", "down"] = "up") -> Link: ...
    def offer(self, time: float, payload: bytes) -> int: ...
    def poll(self, time: float) -> list[Departure]: ...
    def send(self, times: npt.ArrayLike, sizes: int | Sequence[int] | npt.NDArray[np.integer[Any]] | None = None) -> tuple[_Numbers, _Words]: ...
    @property
    def next_time(self) -> float | None:
        """When to poll next, s."""
    @property
    def in_flight(self) -> int:
        """Packets on the link."""
    @property
    def words(self) -> str:
        """Its settings."""
    @property
    def stats(self) -> dict[str, Any]:
        """Packets by what became of them."""

@final
class Departure:
    @property
    def number(self) -> int:
        """Of its offer, from 0."""
    @property
    def offered(self) -> float:
        """s."""
    @property
    def time(self) -> float:
        """When it left or was dropped, s."""
    @property
    def payload(self) -> bytes:
        """One bit flipped where it is corrupted."""
    @property
    def fate(self) -> str:
        '''"delivered" or the cause of the drop.'''
    @property
    def copy(self) -> bool:
        """Whether it is a second one of its offer."""
    @property
    def corrupted(self) -> bool:
        """Whether a bit is flipped."""
    @property
    def marked(self) -> bool:
        """Whether it met congestion (ECN)."""
    @property
    def queued(self) -> float:
        """Wait before the bottleneck, s."""

@final
class Record:
    @property
    def topics(self) -> dict[str, dict[str, _Column]]:
        """By topic a dict of columns, a row a message."""
    @property
    def cut_off(self) -> bool:
        """Whether the file ends in the middle."""
    def __getitem__(self, topic: str, /) -> dict[str, _Column]: ...

@final
class Env:
    OBSERVATION: ClassVar[tuple[str, ...]]
    def __new__(
        cls, config: _Given | None = None, *, duration: float = 20.0, ticks: int = 10, start: _Start = "live"
    ) -> Env: ...
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Numbers, dict[str, Any]]: ...
    def step(self, action: npt.ArrayLike | dict[str, Any]) -> tuple[_Numbers, float, bool, bool, dict[str, Any]]: ...
    def close(self) -> None: ...

@final
class Device:
    def __new__(cls, address: str) -> Device: ...
    def send(self, position: _Three, velocity: _Three = ..., buttons: int = 0, stamp_ns: int | None = None) -> None: ...
    def receive(self) -> _Triple: ...
    @property
    def force(self) -> _Triple:
        """On the hand along the device's axes, N."""
    @property
    def hip(self) -> _Pair:
        """The HIP in the world, m."""
    @property
    def state(self) -> int:
        """Bits: session, held, in contact, emergency stop, slave late, refused."""
    @property
    def sequence(self) -> int:
        """Readings sent."""
    @property
    def received(self) -> int:
        """Forces that came."""
    @property
    def lost_up(self) -> int:
        """Readings that never came."""
    @property
    def lost_down(self) -> int:
        """Forces that never came."""

@final
class Command:
    @property
    def tool(self) -> _Pair:
        """Where the tool has to be, m."""
    @property
    def velocity(self) -> _Pair:
        """m/s."""
    @property
    def stiffness(self) -> float:
        """k_p, N/m."""
    @property
    def damping(self) -> float:
        """k_d, N s/m."""
    @property
    def force_max(self) -> float:
        """N."""
    @property
    def begins(self) -> bool:
        """A session begins."""
    @property
    def held(self) -> bool:
        """An emergency stop is set."""
    @property
    def periods(self) -> int:
        """Of 1 ms since the command before."""

@final
class Plant:
    def __new__(cls, address: str) -> Plant: ...
    def command(self, wait_s: float) -> Command | None: ...
    def answer(
        self, tool: _Two, velocity: _Two, force: _Two, pose: _Three | None = None, image_age_s: float = 0.0
    ) -> None: ...
    @property
    def received(self) -> int:
        """Commands that came."""
    @property
    def lost(self) -> int:
        """Commands that never came."""
