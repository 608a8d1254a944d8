"""A few dozen of the damaged files of `fuzzed`, which makes as many as one likes."""

import pytest

from .fuzzed import KINDS, outcome

# The newer versions are slow ones only to keep the others within what a person waits for.
NEWER = {"description of FMI 3", "system of SSP 2"}
EACH = [pytest.param(k, marks=[pytest.mark.slow] if k in NEWER else []) for k in KINDS]


@pytest.mark.parametrize("kind", EACH)
def test_damaged_files_run_or_are_told_in_a_sentence(kind, tmp_path) -> None:
    found = []
    for number in range(20):
        folder = tmp_path / str(number)
        folder.mkdir()
        found.append(outcome(kind, folder, seed=7, number=number))
    assert set(found) <= {"runs", "told"}, found
    assert {"runs", "told"} <= set(found)  # neither was everything harmless, nor all refused
