"""Ranges of steps with growth, found again where they are known."""

import numpy as np
import pytest

from railcosim.master.stability.windows import FINE, RESOLUTION, Probe, unstable_ranges

KNOWN = [  # s: just above each other, as narrow as half the distance of looks, wide, slow then fast
    (1.0e-4, 1.03e-4, 1),
    (1.05e-4, 1.07e-4, 2),
    (5e-4, 5.01e-4, 2),
    (6e-4, 7e-4, 1),
    (7e-4, 9.9e-4, 2),
    (1.2e-3, 1.201e-3, 1),  # slow, then fast, between two looks
    (1.201e-3, 1.4e-3, 2),
    (3e-3, np.inf, 2),
]


def grade(h):
    return next((g for begin, end, g in KNOWN if begin < h < end), 0)


def ends(steps):
    """A determinant with a zero at each edge of a window where a mode meets its mirror image."""
    return np.prod([(steps / b - 1) * (steps / e - 1) for b, e, _ in KNOWN[:3]], axis=0)[:, None]


def test_windows_are_found_whatever_their_width() -> None:
    found = unstable_ranges(Probe(grade, ends), 2e-6, 8e-5, 1e-2)
    assert [g for _, _, g, _ in found] == [g for _, _, g in KNOWN]
    assert all(grade(inside) == g for _, _, g, inside in found)
    for edges, known in zip(found, KNOWN, strict=True):
        assert edges[:2] == pytest.approx(known[:2], rel=2 * RESOLUTION)


@pytest.mark.parametrize("k", range(8))
def test_a_window_between_two_looks(k) -> None:
    """An eighth as wide as looks are apart, wherever it is between them."""
    begin = 5e-4 * FINE ** (k / 8)
    end = begin * FINE ** (1 / 8)
    probe = Probe(
        lambda h: 2 * (begin < h < end),
        lambda h: ((h / begin - 1) * (h / end - 1) * (1 + 1e3 * h))[:, None],
    )
    ((*edges, grade, inside),) = unstable_ranges(probe, 2e-6, 8e-5, 2e-3)
    assert grade == 2
    assert begin < inside < end
    assert edges == pytest.approx([begin, end], rel=2 * RESOLUTION)


def test_growth_at_every_step_leaves_no_stable_one() -> None:
    (only,) = unstable_ranges(Probe(lambda h: 2, ends), 2e-6, 8e-5, 1e-2)
    assert only[:3] == (0.0, np.inf, 2)
    calm = Probe(lambda h: 0, lambda steps: np.ones((len(steps), 1)))
    assert unstable_ranges(calm, 2e-6, 8e-5, 1e-2) == []
