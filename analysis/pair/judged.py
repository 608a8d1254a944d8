"""A run that is judged: made once more with shorter steps if it looks unstable."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import xarray as xr

from railcosim.master.course import Course
from railcosim.master.recorded_run import Stopped

from .verdict import NotBelievedError, Signs, confirmed, signs_of

Change = Callable[[Course], Course]
Make = Callable[[Change], tuple[xr.Dataset, Stopped]]
"""Makes a run whose course is changed, and says what stopped it early."""


def judged(
    make: Make,
    *,
    believe: bool = False,
    keep: Callable[[xr.Dataset], None] = lambda dataset: None,
    doubt: Callable[[str], None] = lambda text: None,
) -> xr.Dataset:
    """Make a run, and say in its attribute ``verdict`` what it is worth.

    Parameters
    ----------
    make : callable
        Makes the run.
    believe : bool, optional
        Take a run with signs of an unstable coupling as it is.
    keep : callable, optional
        Given what was recorded, also of a run that failed, before it is judged and once more with
        the verdict of a repetition.
    doubt : callable, optional
        Told the signs, and what is done about them.

    Raises
    ------
    NotBelievedError
        If the run shows signs of an unstable coupling and shorter steps do not confirm them.
    Divergence, ComponentError, KeyboardInterrupt
        What stopped the run.

    Notes
    -----
    What was recorded by a run that failed is the attribute ``dataset`` of the exception.
    """
    dataset, stopped = make(lambda course: course)
    signs = signs_of(dataset)
    dataset.attrs["verdict"] = str(signs) or "no sign of an unstable coupling"
    error: BaseException | None = stopped
    if stopped is not None:
        dataset.attrs["verdict"] = f"stopped before its end; {dataset.attrs['verdict']}"
        stopped.dataset = dataset  # type: ignore[union-attr]  # nothing recorded is lost
    keep(dataset)
    if error is None and signs.texts:
        error = _doubted(make, dataset, signs, believe, keep, doubt)
    if error is not None:
        raise error
    return dataset


def _doubted(
    make: Make,
    dataset: xr.Dataset,
    signs: Signs,
    believe: bool,
    keep: Callable[[xr.Dataset], None],
    doubt: Callable[[str], None],
) -> NotBelievedError | None:
    """What is said of a run with signs of an unstable coupling, after repeating it."""
    if believe:
        doubt(f"{signs}: not checked (--believe)")
        return None
    doubt(f"{signs}: repeating the run with shorter steps")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what a repetition warns of has been said
        verdict = confirmed(
            dataset, signs, lambda factor, until: make(lambda course: course.again(factor, until))
        )
    dataset.attrs["verdict"] = str(verdict)
    keep(dataset)
    if verdict.believed:
        return None
    error = NotBelievedError(f"the run is {verdict}")
    error.dataset = dataset  # type: ignore[attr-defined]
    return error
