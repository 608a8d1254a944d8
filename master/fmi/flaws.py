"""Model descriptions with formal flaws: told, and refused only where something would be wrong."""

from __future__ import annotations

import warnings
from collections import Counter
from pathlib import Path
from typing import Any

from fmpy.model_description import ValidationError, read_model_description

from railcosim.master.fmi.archive import DESCRIPTION, FmuError, parse_xml
from railcosim.master.fmi.fmi3_xml import complete

_SHOWN = 3
_NO_NUMBERS = {"String", "Binary", "Clock"}
_told: set[str] = set()


class FlawWarning(UserWarning):
    """A model description is not quite what FMI asks for; what was made of it."""


def read_raw(path: Path, folder: Path) -> Any:
    """Read the model description of an unpacked FMU, as FMPy does.

    Parameters
    ----------
    path : Path
        The FMU, for messages.
    folder : Path
        Where its model description is.

    Returns
    -------
    fmpy.model_description.ModelDescription
        Its content.

    Raises
    ------
    FmuError
        If it cannot be understood, or not without a guess.

    Warns
    -----
    FlawWarning
        Of formal flaws that change no value, once for each file.
    """
    try:
        return complete(read_model_description(folder), folder)
    except Exception as error:  # fmpy raises bare Exception, and IndexError for bad indices
        flawed = error
    try:
        raw = complete(read_model_description(folder, validate=False), folder)
        wrong = _what_is_wrong(raw)
    except Exception as error:  # likewise
        wrong = _one_line(error)
    if wrong:
        version = parse_xml(DESCRIPTION, (folder / DESCRIPTION).read_bytes()).get("fmiVersion")
        raise FmuError(
            f"{path}: modelDescription.xml is not valid FMI {version}: {wrong}"
        ) from flawed
    problems = flawed.problems if isinstance(flawed, ValidationError) else [_one_line(flawed)]
    text = f"{path.name}: its model description has formal flaws: {_some(problems)}"
    if text not in _told:
        _told.add(text)
        warnings.warn(text, FlawWarning, stacklevel=3)
    return raw


def _what_is_wrong(raw: Any) -> str:
    """What no guess can mend; empty if nothing is."""
    if not raw.guid:
        return "it has no guid or instantiationToken, which the library asks for"
    kinds = [kind for kind in (raw.coSimulation, raw.modelExchange) if kind is not None]
    if any(not kind.modelIdentifier for kind in kinds):
        return "it has no modelIdentifier, the name of the library"
    counts = Counter(v.name for v in raw.modelVariables)
    twice = [str(name) for name, n in counts.items() if n > 1 or not name]
    if twice:
        return f"several variables are called {twice[0]!r}"
    for v in raw.modelVariables:
        if v.valueReference is None:
            return f"{v.name} has no value reference"
        if v.causality == "input" and v.start is None and v.type not in _NO_NUMBERS:
            return f"the input {v.name} has no start value, which it keeps if nothing feeds it"
    return ""


def _some(problems: list[str]) -> str:
    """A few of them, in one line."""
    texts = [" ".join(str(problem).split()).rstrip(".") for problem in problems]
    more = len(texts) - _SHOWN
    return "; ".join(texts[:_SHOWN]) + (f"; and {more} more" if more > 0 else "")


def _one_line(error: Exception) -> str:
    """An exception's text without its line breaks."""
    return " ".join(str(error).split()) or type(error).__name__
