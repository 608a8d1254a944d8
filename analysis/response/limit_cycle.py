"""How far a vehicle hunts: amplitude of its limit cycles against speed, up and down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from railcosim.master.component import FloatArray
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError
from railcosim.storage.interruption import finishing, noting
from railcosim.vehicle.eigenmodes import SLOW, poles_of
from railcosim.vehicle.hunting import Critical, critical_speed
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.running import Equations, running
from railcosim.vehicle.train import Train

from .hunting import KMH
from .running import SPEEDS

PERIODS = 3  # in a window whose greatest displacement is an amplitude
USUAL = 2.0  # Hz: of hunting, where no linear critical speed tells it
EXACT = 1e-3  # of an amplitude: what is still to come when it counts as settled
ROUNDED = 1e-6  # of an amplitude: changes so small are those of how tops are found
STILL = 1e-6  # m: what is smaller has died out
SMALL, LARGE = 1e-5, 8e-3  # m, with which a run begins: up, and down where nothing hunts at the top
OFF = 0.05  # m: no wheel is on its rail there any more
LONGEST = 60.0  # s
MOST = 200  # speeds

WAYS = ("up", "down")

BoolArray: TypeAlias = NDArray[np.bool_]
IndexArray: TypeAlias = NDArray[np.intp]


@dataclass
class Branch:
    """Runs at speeds, each with what is known of it.

    Attributes
    ----------
    state : array, shape (m, 2 n)
        Where each has come to.
    amplitude, frequency : array, shape (m,)
        m and Hz; nan: not settled, or off the rails.
    settled, off : array, shape (m,)
        Which have settled, and which have left the rails.
    finished : bool
        Whether those that have not settled had all their time.
    """

    state: FloatArray
    amplitude: FloatArray = field(init=False)
    frequency: FloatArray = field(init=False)
    finished: bool = False

    def __post_init__(self) -> None:
        m = len(self.state)
        self.amplitude, self.frequency = np.full((2, m), np.nan)
        self.settled, self.off = np.zeros((2, m), dtype=bool)

    @property
    def alive(self) -> BoolArray:
        """Which hunt for ever."""
        hunts: BoolArray = self.settled & (self.amplitude > 0)
        return hunts


def limit_cycles(
    stock: Vehicle | Train | None = None,
    speeds: FloatArray | None = None,
    *,
    longest: float = LONGEST,
    folder: Path | None = None,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Amplitudes with which a vehicle hunts on rigid rails, of nonlinear runs, up and down.

    Parameters
    ----------
    stock : Vehicle or Train, optional
        Parameters; its wheels roll as its ``[rolling]`` says. The paper's vehicle if not given.
    speeds : array, shape (m,), optional
        Increasing, m/s; from 0.7 to 1.3 of the linear critical speed if not given.
    longest : float
        How long a run may take to settle, s.
    folder : Path, optional
        Of the vehicle's file, where its profiles are.
    progress : callable
        Told how many runs have settled, and of how many.

    Returns
    -------
    Dataset
        Over ``speed`` (km/h): ``amplitude_up`` and ``amplitude_down`` (m), the greatest
        displacement across of a wheelset in its limit cycle, 0 where all motion dies out;
        ``frequency_up`` and ``frequency_down`` (Hz), nan there. All are nan where a run did not
        settle, or left the rails; ``how_up`` and ``how_down`` say so: 0 settled, 1 not settled, 2
        off the rails, 3 interrupted before.
        Attributes: ``critical_speed`` (km/h) and ``frequency`` (Hz) of the same law, linear;
        ``stopped``: no, or interrupted. An interrupted sweep ends with what it has found.

    Raises
    ------
    ArgumentError
        If speeds do not increase, or the time is not above 0.

    Notes
    -----
    Up, a run goes on from where that at the speed below has settled, and from a hundredth of a
    millimetre if nothing moves there; down, from where that at the speed above has. All runs are
    made at once at first, down from the state at the highest speed; those that die out although
    the one above hunts are then made anew from its state. A run has settled when amplitudes of
    windows of three periods differ, and will still differ by their geometric series, by less than
    1e-3, or are below 1 micrometre.
    """
    vehicle = running(stock or Vehicle(), folder)
    critical = critical_speed(vehicle.poles, SPEEDS)
    if speeds is None:
        if not critical.speed > 0:
            raise ArgumentError(
                "speeds", None, "no linear critical speed from 5 to 1000 km/h: say which"
            )
        speeds = critical.speed * np.linspace(0.7, 1.3, 21)
    speeds = np.asarray(speeds, dtype=float)
    if not (1 <= speeds.size <= MOST and speeds[0] > 0 and (np.diff(speeds) > 0).all()):
        raise ArgumentError("speeds", None, f"must be above 0 and increase, at most {MOST}")
    if not longest > 0:
        raise ArgumentError("longest", longest, "must be above 0 s")
    sweep = Sweep(vehicle, speeds, critical, longest, progress)
    stopped = "no"
    with finishing():
        try:
            with noting() as obey:
                sweep.obey = obey
                sweep.up()
                sweep.down()
        except KeyboardInterrupt:
            stopped = "interrupted"
        return _told(sweep).assign_attrs(stopped=stopped)


class Sweep:
    """Runs of a vehicle at speeds, up and down."""

    def __init__(
        self,
        vehicle: Equations,
        speeds: FloatArray,
        critical: Critical,
        longest: float,
        progress: Progress,
    ) -> None:
        self.vehicle, self.speeds, self.critical = vehicle, speeds, critical
        self.longest, self.progress = longest, progress
        self.obey: Callable[[], None] = lambda: None
        frequency = critical.frequency if critical.frequency > 0 else USUAL
        self.step = vehicle.step_of(speeds)
        self.window = round(PERIODS / frequency / self.step)
        self.across = vehicle.across
        self.done = 0
        none = np.tile(vehicle.rest, (len(speeds), 1))
        self.branches = {way: Branch(none) for way in WAYS}

    def up(self) -> None:
        """From rest, where it is stable, and from the smallest motion, where it is not."""
        begins = [self.growing(speed, SMALL) for speed in self.speeds.tolist()]
        branch = self.branches["up"] = Branch(np.array([state for state, _ in begins]))
        stable = np.array([growth <= 0 for _, growth in begins])
        branch.settled[stable], branch.amplitude[stable] = True, 0.0
        self._count(branch)
        self.settle(branch, np.flatnonzero(~stable))
        for k in range(1, len(self.speeds)):
            if not (stable[k] or branch.settled[k] or branch.off[k]) and branch.alive[k - 1]:
                branch.state[k] = self._moved(branch.state[k - 1], k - 1, k)
                self.settle(branch, np.array([k]))
        self.done, branch.finished = len(self.speeds), True

    def down(self) -> None:
        """From the limit cycle at the highest speed, or from a large motion if there is none."""
        up = self.branches["up"]
        top = len(self.speeds) - 1
        large = up.state[top] if up.alive[top] else self.growing(self.speeds[top], LARGE)[0]
        begins = [self._moved(large, top, k) for k in range(top + 1)]
        branch = self.branches["down"] = Branch(np.array(begins))
        self.settle(branch, np.arange(top + 1))
        for k in range(top - 1, -1, -1):
            if branch.alive[k + 1] and not branch.alive[k] and not branch.off[k]:
                branch.state[k] = self._moved(branch.state[k + 1], k + 1, k)
                branch.settled[k], branch.amplitude[k] = False, np.nan
                self.settle(branch, np.array([k]))
        branch.finished = True

    def growing(self, speed: float, amplitude: float) -> tuple[FloatArray, float]:
        """A state that moves as what grows fastest, and by how much that grows, 1/s."""
        poles, vectors = poles_of(*self.vehicle.matrices(speed))
        swings = np.flatnonzero((np.abs(poles) > SLOW) & (poles.imag > 0))
        first = swings[np.argmax(poles[swings].real)]
        shape = vectors[:, first] / np.abs(vectors[self.across, first]).max()
        n = len(shape)
        state = self.vehicle.rest.copy()
        state[n:] *= speed
        state[:n] += amplitude * shape.real
        state[n:] += amplitude * (poles[first] * shape).real
        everything = poles[np.abs(poles) > SLOW].real.max()
        return state, float(everything)

    def settle(self, branch: Branch, which: IndexArray) -> None:
        """Go on with runs until they have settled, left the rails or taken too long."""
        seen: list[FloatArray] = []
        for _ in range(int(np.ceil(self.longest / (self.window * self.step)))):
            if not which.size:
                return
            y: list[FloatArray] = []
            with np.errstate(all="ignore"):  # of a run that leaves the rails
                branch.state[which] = self.vehicle.run(
                    branch.state[which], self.speeds[which], self.step, self.window,
                    lambda now: y.append(np.abs(now[:, self.across]).max(axis=1)),  # noqa: B023
                )  # fmt: skip
            amplitude = _greatest(np.array(y))
            branch.off[which] = ~(amplitude < OFF)
            seen = [*seen[-2:], amplitude]
            settled = _settled(seen) & ~branch.off[which]
            branch.settled[which] = settled
            found = which[settled]
            branch.amplitude[found] = np.where(amplitude < STILL, 0.0, amplitude)[settled]
            goes_on = ~(settled | branch.off[which])
            which, seen = which[goes_on], [one[goes_on] for one in seen]
            self._count(branch)

    def frequency(self, branch: Branch) -> FloatArray:
        """Of what hunts, Hz: upward passages of the wheelset that moves most."""
        which = np.flatnonzero(branch.alive)
        found = np.full(len(self.speeds), np.nan)
        if not which.size:
            return found
        y: list[FloatArray] = []
        self.vehicle.run(
            branch.state[which], self.speeds[which], self.step, self.window + 1,
            lambda state: y.append(state[:, self.across]),
        )  # fmt: skip
        every = np.array(y)
        most = np.abs(every).max(axis=0).argmax(axis=1)
        for k, one in enumerate(which.tolist()):
            found[one] = _passages(every[:, k, most[k]], self.step)
        return found

    def _moved(self, state: FloatArray, of: int, to: int) -> FloatArray:
        """A state at another speed: slopes over the track are the same."""
        moved = state.copy()
        moved[state.size // 2 :] *= self.speeds[to] / self.speeds[of]
        return moved

    def _count(self, branch: Branch) -> None:
        done = int((branch.settled | branch.off).sum())
        self.progress(self.done + done, 2 * len(self.speeds))
        self.obey()


def _greatest(y: FloatArray) -> FloatArray:
    """Greatest values over the first axis, of what is a parabola between samples there."""
    first = np.clip(y.argmax(axis=0), 1, len(y) - 2)
    before, at, after = (np.take_along_axis(y, first[None] + k, axis=0)[0] for k in (-1, 0, 1))
    bend = 2 * at - before - after
    more = np.divide((after - before) ** 2, 8 * bend, out=np.zeros_like(at), where=bend > 0)
    greatest: FloatArray = y.max(axis=0)
    inside = (at >= before) & (at >= after)  # else it is at an end
    return np.where(inside, greatest + more, greatest)


def _settled(seen: list[FloatArray]) -> BoolArray:
    """Which amplitudes, of three windows or fewer, are known."""
    last = seen[-1]
    dead: BoolArray = last < STILL
    if len(seen) < 3:
        return dead
    before, change = np.abs(seen[1] - seen[0]), np.abs(last - seen[1])
    ratio = np.divide(change, before, out=np.zeros_like(change), where=before > 0)
    to_come = np.where(ratio < 1, change * ratio / np.maximum(1 - ratio, 1e-12), np.inf)
    to_come[change < ROUNDED * last] = 0.0
    known: BoolArray = dead | (np.maximum(change, to_come) < EXACT * last)
    return known


def _passages(y: FloatArray, step: float) -> float:
    """Frequency from the first upward passage of 0 to the last."""
    before = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    if before.size < 2:
        return float("nan")
    at = before + y[before] / (y[before] - y[before + 1])
    return float((before.size - 1) / ((at[-1] - at[0]) * step))


def _told(sweep: Sweep) -> xr.Dataset:
    found = xr.Dataset(
        coords={"speed": ("speed", KMH * sweep.speeds, {"units": "km/h"})},
        attrs={
            "title": "limit cycles on rigid rails",
            "critical_speed": KMH * sweep.critical.speed,
            "frequency": sweep.critical.frequency,
            "longest": sweep.longest,
            "step": sweep.step,
        },
    )
    for way, branch in sweep.branches.items():
        about = {"units": "m", "long_name": f"greatest displacement across of a wheelset, {way}"}
        found[f"amplitude_{way}"] = ("speed", branch.amplitude, about)
        frequency = sweep.frequency(branch)
        found[f"frequency_{way}"] = ("speed", frequency, {"units": "Hz"})
        how = np.where(branch.settled, 0, np.where(branch.off, 2, 1 if branch.finished else 3))
        words = "0 settled, 1 not settled, 2 off the rails, 3 interrupted"
        found[f"how_{way}"] = ("speed", how, {"units": "1", "long_name": words})
    return found
