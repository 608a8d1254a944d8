"""Where and how a rail was hit: what is given, what our own files tell, or what is usual."""

from __future__ import annotations

from dataclasses import dataclass, fields

from railcosim.analysis.response.track_words import place_of
from railcosim.track.parameters import Track

from .table import Table

SAME = 1e-6  # m: places


@dataclass(frozen=True, kw_only=True)
class Loading:
    """Of hammer and accelerometer; None where nobody says.

    Attributes
    ----------
    position : str or float, optional
        ``railseat``, ``midspan``, or m along the track.
    direction : str, optional
        ``z`` or ``y``.
    both_rails : bool, optional
        Whether the same force acts on both rails.
    """

    position: str | float | None = None
    direction: str | None = None
    both_rails: bool | None = None


USUAL = Loading(position="railseat", direction="z", both_rails=False)


def loading_of(table: Table, track: Track, given: Loading) -> Loading:
    """What is known all together.

    Raises
    ------
    ParameterError
        If what is given is not what the file says, or it says something that no hammer does.
    """
    told, found = _told(table, given), {}
    for one in fields(Loading):
        ours, theirs = getattr(given, one.name), getattr(told, one.name)
        if theirs is not None and ours is not None and _differ(track, one.name, ours, theirs):
            raise table.wrong(
                f"is {_option(one.name, theirs)}, as it says itself, not "
                f"{_option(one.name, ours)}: leave the option out"
            )
        usual = getattr(USUAL, one.name)
        found[one.name] = next(v for v in (ours, theirs, usual) if v is not None)
    return Loading(**found)


def _told(table: Table, given: Loading) -> Loading:
    """What a file of ours says; a stranger's says nothing."""
    about = table.about
    if about is None:
        return Loading()
    load = about.get("load")
    if load not in ("both", "single"):
        missing = [
            _option(name, value)
            for name, value in (("position", "PLACE"), ("both_rails", False))
            if getattr(given, name) is None and (name != "position" or about)
        ]
        if missing:
            raise table.wrong(
                "does not say where and on which rails the load was: add "
                f"{' and '.join(missing)} or what it was (track-receptance loads both if not "
                "told, and says so in a .nc)"
            )
        return Loading()
    odd = {
        "track": about.get("track", "endless") != "endless",
        "changed": "changed" in about,
        "offset": about.get("offset", 0.0) != 0,
        "response": about.get("response") != about.get("direction"),
        "direction": about.get("direction") not in ("z", "y"),
    }
    for name, is_odd in odd.items():
        if is_odd:
            raise table.wrong(
                f"{name} = {about[name]}: a fit is of an endless track that is the same all along, "
                "hit and seen in the middle of the head in z or y"
            )
    position = about.get("position")
    return Loading(
        position=None if position is None else str(position),
        direction=str(about["direction"]), both_rails=load == "both",
    )  # fmt: skip


def _differ(track: Track, name: str, one: object, other: object) -> bool:
    if name != "position":
        return one != other
    return abs(place_of(track, one) - place_of(track, other)) > SAME  # type: ignore[arg-type]


def _option(name: str, value: object) -> str:
    if name == "both_rails":
        return f"--load {'both' if value else 'single'}"
    return f"--{name} {value}"
