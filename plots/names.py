"""What people call a variable: of its name where that is one of ours, else what its file says."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

import xarray as xr

from railcosim.mechanics.ports import DIRECTIONS, FORCE, IRREGULARITY, RAIL, WHEEL, Direction

BODIES = {"carbody": "car body", "bogie": "bogie", "wheelset": "wheelset", "axle": "axle"}
OWNERS = (("vehicle", None), ("track", None))  # of two components: which is plain from the rest
LONGEST = 60  # characters of a description that can stand for a name
_PART = re.compile(r"([A-Za-z_]+)(?:\[(\d+)\])?")


def _turns(direction: Direction) -> bool:
    return direction.motion == "rad"


def _way(direction: Direction) -> str:
    return direction.name if _turns(direction) else direction.positive


_OF_BODIES = {
    "pitch": "pitch",
    "position": "position",
    **{d.name: _way(d) for d in DIRECTIONS},
    **{f"v{d.name}": f"velocity {_way(d)}" for d in DIRECTIONS},
    **{f"a{d.name}": f"acceleration {_way(d)}" for d in DIRECTIONS},
}
_EFFORTS = {d.effort: f"{'moment' if _turns(d) else 'force'}, {_way(d)}" for d in DIRECTIONS}
_AT_PORTS = {
    **{FORCE.format(effort=effort): ("", words) for effort, words in _EFFORTS.items()},
    **{
        pattern.format(d.name): (face, _OF_BODIES[key.format(d.name)])
        for d in DIRECTIONS
        for face, pattern, key in (
            ("wheel", WHEEL.motion, "{}"), ("wheel", WHEEL.rate, "v{}"),
            ("rail", RAIL.motion, "{}"), ("rail", RAIL.rate, "v{}"),
            ("irregularity", IRREGULARITY, "{}"),
        )
    },
    **{
        face.effort.format(effort=effort): (face.name, words)
        for face in (WHEEL, RAIL)
        for effort, words in _EFFORTS.items()
    },
}  # fmt: skip


def words_of(name: str) -> tuple[str, str] | None:
    """Whose a variable is and what of it, such as ("wheelset 1, left", "force, down").

    None if the name is none that vehicles, tracks and their contacts have.
    """
    before, _, last = name.rpartition(".")
    face, what = _AT_PORTS.get(last, ("", _OF_BODIES.get(last, "")))
    whose = owner(before)
    if not what or whose == before:
        return None
    return (f"{whose}: {face}" if face else whose), what


def owner(name: str) -> str:
    """A wheelset, a wheel or a body by its name: ``wheelset[1].left`` is "wheelset 1, left"."""
    parts = [_PART.fullmatch(part) for part in name.split(".")]
    owners = [(part[1], part[2]) for part in parts if part is not None]
    if len(owners) != len(parts) or not any(stem in BODIES for stem, _ in owners):
        return name
    return ", ".join(
        BODIES.get(stem, stem.replace("_", " ")) + (f" {number}" if number else "")
        for stem, number in owners[owners[0] in OWNERS :]
    )


def place(name: str) -> str:
    """Whose it is, where an axis says what is shown."""
    found = words_of(name)
    return name if found is None else found[0]


def in_words(text: str) -> str:
    """A title with the names of variables in it as people call them."""
    return " ".join(", ".join(words_of(part) or (part,)) for part in text.split(" "))


def called(dataset: xr.Dataset, names: Sequence[str]) -> dict[str, str]:
    """What people call variables of a dataset, by their names; no two the same."""
    words = {name: _called(dataset[name], name) for name in names}
    count = Counter(words.values())
    return {n: said if count[said] == 1 else f"{said} ({n})" for n, said in words.items()}


def _called(variable: xr.DataArray, name: str) -> str:
    found = words_of(name)
    if found is not None:
        return ", ".join(found)
    text = str(variable.attrs.get("long_name", ""))
    return text if 0 < len(text) <= LONGEST else name
