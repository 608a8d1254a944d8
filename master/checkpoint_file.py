"""What a checkpoint's file holds, checked."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from railcosim.master import plain
from railcosim.master.journal import Seals
from railcosim.storage.whole import TargetError, check_regular, write_whole

_FORMAT = "railcosim checkpoint 2"


class CheckpointError(ValueError):
    """A checkpoint cannot be written or does not fit; the message names file and difference."""


class Content(NamedTuple):
    """All that decides how a run goes on.

    Attributes
    ----------
    time : float
        s.
    seen, n_rows : int
        Points that were offered to the recorder, and kept.
    identity : dict of str to str
        What the run is made with, but its end.
    system, stepper, walk
        State of the components and of the exchange, memory of scheme and pace.
    options : dict of str to what JSON can hold
        The caller's.
    threads : str
        How many BLAS had.
    seals : Seals
        Of the rows beside it.
    """

    time: float
    seen: int
    n_rows: int
    identity: Mapping[str, str]
    system: Any
    stepper: Any
    walk: Any
    options: Mapping[str, Any]
    threads: str
    seals: Seals

    def write(self, path: Path) -> None:
        """Write it, whole or not at all."""
        texts: Any = {n: json.dumps(getattr(self, n)) for n in _MAPPINGS}
        write_whole(path, plain.dumps((_FORMAT, *self._replace(**texts))))


_MAPPINGS = ("identity", "options")  # as JSON: plain values have no mappings
_PLACES = {name: 1 + Content._fields.index(name) for name in _MAPPINGS}


def read_checkpoint(path: Path) -> Content:
    """Read a checkpoint, and see that it is one.

    Raises
    ------
    CheckpointError
        If not.
    """
    try:
        check_regular(path)
        value = plain.loads(path.read_bytes())
    except TargetError as error:
        raise CheckpointError(f"{error}, no checkpoint") from error
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read ({error.strerror})") from error
    except plain.PlainError as error:
        raise CheckpointError(f"{path}: damaged, or not a checkpoint ({error})") from error
    try:
        kind, *rest = value
        found = Content(*rest)
        mappings: Any = {n: dict(json.loads(value[_PLACES[n]])) for n in _MAPPINGS}
        found = found._replace(**mappings)
        good = kind == _FORMAT and math.isfinite(found.time)
        good = good and 0 < int(found.n_rows) <= int(found.seen)
        good = good and len(found.seals) > 0
        good = good and all(isinstance(e, int) and isinstance(d, str) for e, d in found.seals)
    except (TypeError, ValueError, AttributeError):
        good = False
    if not good:
        raise CheckpointError(f"{path}: not a {_FORMAT}")
    return found
