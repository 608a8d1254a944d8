"""A few dozen of the damaged files of `fuzzed`, which makes as many as one likes."""

import pytest

from .fuzzed import KINDS, outcome


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_run_or_are_told_in_a_sentence(kind, tmp_path) -> None:
    found = []
    for number in range(20):
        folder = tmp_path / str(number)
        folder.mkdir()
        found.append(outcome(kind, folder, seed=7, number=number))
    assert set(found) <= {"runs", "told"}, found
    assert {"runs", "told"} <= set(found)  # neither was everything harmless, nor all refused
