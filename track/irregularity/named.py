"""An irregularity by the name of its class or of its file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from railcosim.parameters import ArgumentError

from .files import read_profile
from .profile import Profile, flat
from .quantities import ALL
from .repetition import repeated
from .spectra import QUALITIES
from .synthesis import synthesise
from .usual import SEED

NONE = "none"


def irregularity(
    name: str | Path,
    length: float,
    *,
    seed: int | None = None,
    quantities: Sequence[str] | None = None,
    spatial: bool = False,
    fade: float | None = None,
    repeat: bool = False,
) -> Profile:
    """The irregularity of a name, for a run over `length`.

    Parameters
    ----------
    name : str or Path
        ``none``, a class of `QUALITIES`, or a CSV file.
    length : float
        m.
    seed : int, optional
        Which track of a class; 1 if not given.
    quantities : sequence of str, optional
        Of a class: which of vertical, cross_level, alignment and gauge act, or ``all`` that it has;
        if not given the vertical one alone, or all of a run in space.
    spatial : bool
        Whether the run is one in space.
    fade : float, optional
        Length over which it fades in ahead of the first wheelset, m; the usual one of a class, 0
        for a file if not given.
    repeat : bool
        Repeat a file that is shorter than the run.

    Raises
    ------
    ArgumentError
        If there is no such class, or an argument says nothing of this irregularity.
    ParameterError
        If the file cannot be read, or ends before the run.

    Examples
    --------
    >>> irregularity("german-low", 100.0).check_covers(100.0)
    """
    text = str(name)
    kind = "a file" if text.lower().endswith(".csv") else NONE if text == NONE else "a class"
    for argument, value, given, kinds in (
        ("seed", seed, seed is not None, ("a class",)),
        ("quantities", None, quantities is not None, ("a class",)),
        ("fade", fade, fade is not None, ("a class", "a file")),
        ("repeat", None, repeat, ("a file",)),
    ):
        if given and kind not in kinds:
            raise ArgumentError(argument, value, f"says nothing of {text}, which is {kind}")
    if kind == NONE:
        profile = flat()
    elif kind == "a file":
        profile = read_profile(Path(name))
    elif text not in QUALITIES:
        classes = ", ".join(QUALITIES)
        must = f"must be {NONE}, {classes}, or a file that ends in .csv"
        raise ArgumentError("irregularity", text, must)
    elif not length > 0:
        raise ArgumentError(
            "speed", None, f"wheels stand still, and meet no irregularity of {text}: must be > 0 "
            f"at some time, or the irregularity {NONE}",
        )  # fmt: skip
    else:
        usual = (ALL,) if spatial else ("vertical",)
        acting = usual if quantities is None else quantities
        profile = synthesise(text, length, SEED if seed is None else seed, quantities=acting)
    if repeat:
        profile = repeated(profile, length)
    profile.check_covers(length)
    return profile if fade is None else replace(profile, fade=fade)
