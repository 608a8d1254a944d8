"""Help with misspelt names."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def suggest(name: str, candidates: Iterable[str]) -> str:
    """End of an error message about an unknown name.

    Parameters
    ----------
    name : str
        What was given.
    candidates : iterable of str
        What exists.

    Returns
    -------
    str
        ``"; did you mean a, b?"``, or nothing if none is close.
    """
    close = difflib.get_close_matches(name, list(candidates), n=3)
    return f"; did you mean {', '.join(close)}?" if close else ""
