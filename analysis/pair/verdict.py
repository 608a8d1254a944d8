"""Whether a run is to be believed.

An unstable coupling need not blow up: where wheels can leave the rail, it hammers for ever with
finite forces, and the run comes to its end. Signs of that cost nothing to look for. A sign is no
proof, for true defects throw wheels off the rail too, so a run that shows one is repeated over the
first of them with ever shorter steps. What the steps have made is gone when they are short enough;
what the system does stays, and settles. That needs no model of the run and holds for every owner,
scheme, law and FMU.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from railcosim.master.component import FloatArray
from railcosim.master.recorded_run import Stopped
from railcosim.mechanics.ports import FORCE, MOST_WHEELSETS, Layout

PEAK = 3.0
"""Times the force at rest: bad joints and the limit value for wheel flats (350 kN) are beyond."""
GROWN = 5.0
"""Of what moves, RMS in the last quarter of a run over that in the second. Irregularity does not
grow by so much; if a defect comes late, the repetition shows it too."""
ALTERNATING = 3.5
"""RMS of second differences over that of deviations: 4 where values go up and down from step to
step, 2.4 for noise without memory, less for all that the steps resolve."""
DISAGREE = 0.7
"""RMS of the change by another step, over that of the dynamic part: nothing is known of it any
more. It is above 1 between two runs that both are noise of the coupling."""
MADE = 2.0
"""Likewise, where shorter steps show the sign too: signals of one size differ by twice it at most,
so beyond that most of what moves was made by the coupling."""
_FORCES = Layout(MOST_WHEELSETS).names(FORCE)
WINDOW, STEPS = 0.1, 50
"""Length of what is compared at once: s, and steps. A contact's bounce lasts some ms."""
HALVINGS, SHORTEST = 10, 5e-6
"""How often, and down to what (s), steps are halved: no pair of ours needs shorter ones."""

Repeat = Callable[[int, float], tuple[xr.Dataset, Stopped]]
"""Makes the run once more, with steps so many times shorter, until another end (s)."""


class NotBelievedError(ArithmeticError):
    """A run came to its end, but its result is the coupling's, not the system's."""


@dataclass(frozen=True, kw_only=True)
class Signs:
    """What makes a run suspicious.

    Attributes
    ----------
    texts : tuple of str
        In words; none if nothing does.
    times : array, shape (n,)
        Where, s.
    columns : tuple of str
        The outputs that are compared.
    """

    texts: tuple[str, ...]
    times: FloatArray
    columns: tuple[str, ...]

    def __str__(self) -> str:
        return ", ".join(self.texts)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether a run is believed, and why."""

    believed: bool
    reason: str

    def __str__(self) -> str:
        return self.reason if self.believed else f"not to be believed: {self.reason}"


def signs_of(run: xr.Dataset) -> Signs:
    """Look for signs that a coupling is unstable; contact forces if there are, else all outputs."""
    forces = tuple(name for name in _FORCES if name in run)
    columns = forces or tuple(str(name) for name in run.data_vars)
    times, values = np.asarray(run["time"], dtype=float), _values(run, columns)
    texts: list[str] = []
    marked: NDArray[np.bool_] = np.zeros(len(times), dtype=bool)
    if len(times) < 8 or not np.isfinite(values).all():
        return Signs(texts=(), times=times[:0], columns=columns)
    if forces:
        lost, rest = (values <= 0.0).any(axis=1), float(np.abs(values[0]).max())
        if lost.any():
            texts.append(
                f"a wheel is off the rail (or its spring pulls) at {lost.mean():.2%} of the points"
            )
        high = (np.abs(values) > PEAK * rest).any(axis=1)
        if high.any():
            texts.append(f"forces up to {1e-3 * np.abs(values).max():.4g} kN")
        marked |= lost | high
        if _grown(values) > GROWN:
            texts.append(f"forces grow by {_grown(values):.2g} in the second half")
            marked[-1] = True
    wild = tuple(c for c, x in zip(columns, values.T, strict=True) if _alternates(x))
    if wild:
        texts.append(f"{wild[0]} goes up and down from step to step")
        marked[-1] = True
    return Signs(texts=tuple(texts), times=times[marked], columns=forces or wild)


def confirmed(run: xr.Dataset, signs: Signs, again: Repeat) -> Verdict:
    """Repeat a run with shorter steps over its first sign, then with half the step over its last.

    Parameters
    ----------
    run : Dataset
        Outputs over ``time``, from its start.
    signs : Signs
        From `signs_of`.
    again : callable
        Repeats it.

    Raises
    ------
    KeyboardInterrupt
        If a repetition was interrupted.
    """
    times = np.asarray(run["time"], dtype=float)
    step = float(np.median(np.diff(times)))
    window = max(WINDOW, STEPS * step)
    first, last = (min(float(t) + window, float(times[-1])) for t in signs.times[[0, -1]])
    verdict = _over_first(run, signs, again, step, (first, window))
    if not verdict.believed or last == first:
        return verdict
    other = _repeated(again, 2, last)
    change, where = (np.inf, last) if other is None else _difference(run, other, signs, window)
    calm = other is None or not _inside(signs_of(other), where, window)
    if change > DISAGREE and calm:
        return _condemned(signs, change, 0.5 * step, where)
    return verdict


def _over_first(
    run: xr.Dataset, signs: Signs, again: Repeat, step: float, over: tuple[float, float]
) -> Verdict:
    """Halve the step (s) until the sign is gone or settles; over until when, and how long, s."""
    until, window = over
    before: xr.Dataset | None = None
    change, where = np.inf, float(signs.times[0])
    for k in range(1, HALVINGS + 1):
        shorter = step / 2**k
        if shorter < SHORTEST and k > 1:
            break
        other = _repeated(again, 2**k, until)
        if other is not None:
            change, where = _difference(run, other, signs, window)
            if change <= DISAGREE:
                return Verdict(
                    believed=True,
                    reason=f"{signs}; a step of {1e3 * shorter:.3g} ms confirms it, within "
                    f"{change:.0%} of the dynamic part",
                )
            if not signs_of(other).texts:
                return _condemned(signs, change, shorter, where)
            settled = (
                before is not None and _difference(before, other, signs, window)[0] <= DISAGREE
            )
            if settled and change > MADE:
                return _condemned(signs, change, shorter, where)
            if settled:
                return Verdict(
                    believed=True,
                    reason=f"{signs}; so it is with shorter steps, but this one is too long: the "
                    f"dynamic part differs by {change:.0%} from that with {1e3 * shorter:.3g} ms",
                )
        before = other
    return _condemned(signs, change, shorter, where)


def _condemned(signs: Signs, change: float, step: float, where: float) -> Verdict:
    return Verdict(
        believed=False,
        reason=f"{signs}; with a step of {1e3 * step:.3g} ms it differs by {change:.0%} of its "
        f"dynamic part near {where:.4g} s",
    )


def _repeated(again: Repeat, factor: int, until: float) -> xr.Dataset | None:
    """The run once more; None if it does not come to its end."""
    other, stopped = again(factor, until)
    if isinstance(stopped, KeyboardInterrupt):
        raise stopped
    return None if stopped is not None else other


def _inside(signs: Signs, begin: float, window: float) -> bool:
    """Whether there is a sign in a window."""
    return bool(((signs.times >= begin - window / 2) & (signs.times <= begin + window)).any())


def _difference(
    run: xr.Dataset, other: xr.Dataset, signs: Signs, window: float
) -> tuple[float, float]:
    """The largest relative difference in any window with a sign, and where that begins, s."""
    times, until = np.asarray(run["time"], dtype=float), np.asarray(other["time"], dtype=float)
    covered = times <= until[-1] * (1 + 1e-12)
    times, ours = times[covered], _values(run, signs.columns)[covered]
    theirs = np.stack(
        [np.interp(times, until, column) for column in _values(other, signs.columns).T], axis=1
    )
    # Contact forces make one whole: a wheel that hardly moves says nothing by itself.
    axis = None if set(signs.columns) <= set(_FORCES) else 0
    found, begin = [(0.0, float(times[0]))], -np.inf
    for t in signs.times[signs.times <= times[-1]]:
        if t < begin + window:
            continue
        begin = float(t)
        inside = (times >= t - window / 2) & (times <= t + window)
        size = np.linalg.norm(theirs[inside] - theirs[0], axis=axis)
        change = np.linalg.norm(ours[inside] - theirs[inside], axis=axis)
        with np.errstate(divide="ignore", invalid="ignore"):  # what does not move at all
            ratio = np.where(change > 0.0, change / size, 0.0)
        found.append((float(np.max(ratio)), begin))
    return max(found)


def _values(run: xr.Dataset, columns: tuple[str, ...]) -> FloatArray:
    return np.stack([np.asarray(run[name], dtype=float) for name in columns], axis=1)


def _grown(values: FloatArray) -> float:
    quarter = len(values) // 4
    before, after = (
        np.linalg.norm(part - values[0])
        for part in (values[quarter : 2 * quarter], values[-quarter:])
    )
    return float(after / before) if before > 0 else 1.0


def _alternates(x: FloatArray) -> bool:
    late = x[len(x) // 2 :]
    size = np.std(late)
    if not size > 1e-9 * np.abs(late).max():
        return False
    return bool(np.sqrt(np.mean(np.diff(late, 2) ** 2)) > ALTERNATING * size)
