"""How long work tells how far it is."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeAlias

Tell: TypeAlias = Callable[[str], None]
"""Told in words what comes, before it does."""
SOON = 1.0  # s of work from which its rate is known
LONG = 5.0  # s that are worth a word
Progress: TypeAlias = Callable[[float, float], None]
"""Told what is done and the total, now and then; may raise to stop the work."""


def unheard(done: float, total: float) -> None:
    """Nobody listens."""


def unsaid(text: str) -> None:
    """Likewise."""


def foretold(progress: Progress, tell: Tell, least: float = 0.0) -> Progress:
    """Progress that also tells once how long the rest takes: by what has been done and its time.

    Parameters
    ----------
    progress : callable
        Told as ever.
    tell : callable
        Told ``about 40 s more``; nothing if it is short.
    least : float
        What must have been done before that is known.
    """
    begun, asked = time.monotonic(), False

    def update(done: float, total: float) -> None:
        nonlocal asked
        progress(done, total)
        spent = time.monotonic() - begun
        if not asked and done > least and spent > SOON:
            asked = True
            more = spent * (total - done) / done
            if more > LONG:
                tell(f"about {more:.0f} s more")

    return update
