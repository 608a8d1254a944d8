"""How long work takes is told once, early, by what has been done of it."""

import pytest

from railcosim.master import progress
from railcosim.master.progress import foretold


@pytest.mark.parametrize(
    ("least", "said"),
    [(0.0, ["about 38 s more"]), (4.0, ["about 30 s more"]), (19.0, [])],
)  # fmt: skip
def test_what_comes_is_told_by_what_was(monkeypatch, least, said) -> None:
    """A step takes 2 s, of 20: after the first 38 s are left, and nothing is known before it."""
    clock = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    heard, told = [], []
    update = foretold(lambda done, total: heard.append(done), told.append, least)
    for done in range(21):
        update(done, 20)
        clock[0] += 2.0
    assert heard == list(range(21))
    assert told == said
