"""Kalker's table, how it is read between its numbers, and linear creep with its signs."""

import numpy as np
import pytest

from railcosim.mechanics.contact.creep import LinearCreep, Patch
from railcosim.mechanics.contact.kalker import RATIOS, TABLE, kalker

STEEL = {"shear_modulus": 2.059e11 / 2.6, "poisson_ratio": 0.3}


def values(ratio, nu):
    k = kalker(ratio, nu)
    return np.array([k.C11, k.C22, k.C23, k.C33])


@pytest.mark.parametrize(("column", "nu"), [(0, 0.0), (1, 0.25), (2, 0.5)])
def test_the_tables_own_numbers(column, nu):
    assert pytest.approx(TABLE[:, :, column], rel=1e-14) == values(RATIOS, nu).T


def test_read_between():
    """C11 of a circle at 0.3: 4.300, where parabola and line of C itself give 4.307 and 4.336."""
    assert values(1.0, 0.3)[0] == pytest.approx(4.300, abs=5e-4)
    half = values(0.45, 0.25)
    assert half == pytest.approx(TABLE[3:5, :, 1].mean(axis=0), rel=1e-14)


def test_table_is_the_numbers_of_a_smooth_function():
    """A slip of a digit would stand out: third differences in the logarithm of a/b are small."""
    # C11 and C22 at nu = 0 are the same number: Kalker's theory has the symmetry.
    assert np.array_equal(TABLE[:, 0, 0], TABLE[:, 1, 0])
    x = np.log(RATIOS)
    for row in np.log(TABLE).reshape(len(RATIOS), -1).T:
        for i in range(2, len(x) - 2):
            around = [i - 2, i - 1, i + 1, i + 2]
            guess = np.polyval(np.polyfit(x[around], row[around], 3), x[i])
            # 1 %: three digits, and the cubic through four of the neighbours.
            assert row[i] == pytest.approx(guess, abs=0.012)


@pytest.mark.parametrize(("ratio", "nu"), [(0.09, 0.3), (10.1, 0.3), (1.0, 0.51), (1.0, -0.1)])
def test_outside_the_table_is_refused(ratio, nu):
    with pytest.raises(ValueError, match="Kalker's table"):
        kalker(ratio, nu)


PATCH = Patch.of(1 / 0.43, 1 / 0.3, **STEEL)
N = np.array([79265.0])


def creep(x=0.0, y=0.0, spin=0.0):
    return LinearCreep().force(PATCH, N, np.array([[x, y, spin]]))[0]


def test_forces_oppose_creepages():
    assert creep(x=1e-4)[0] < 0
    assert creep(y=1e-4)[1] < 0
    assert creep(spin=0.1)[2] < 0
    assert np.count_nonzero(creep(x=1e-4)) == 1


def test_spin_pushes_across_and_sliding_across_turns():
    """One coefficient, f23, of opposite signs: neither takes energy with the other."""
    by_spin, by_sliding = creep(spin=0.1)[1] / 0.1, creep(y=1e-4)[2] / 1e-4
    assert by_spin < 0
    assert by_sliding == pytest.approx(-by_spin, rel=1e-12)


def test_a_leaning_wheel_is_pushed_to_where_it_leans():
    """A right wheel is a cone whose tip is to its right: the tip draws, as on a motorcycle."""
    slope, r0 = 0.05, 0.43
    # The axle turns by -1/r0 per metre about +y; the normal into the right rail leans to the right.
    normal, axle = np.array([0, slope, 1]), np.array([0, -1 / r0, 0])
    assert creep(spin=float(normal @ axle))[1] > 0


def test_by_the_load():
    """f11, f22 as N^(2/3), f23 as N, f33 as N^(4/3)."""
    once = np.array(PATCH.creep_coefficients(np.array(1e4)))
    eight = np.array(PATCH.creep_coefficients(np.array(8e4)))
    assert eight / once == pytest.approx([4, 4, 8, 16], rel=1e-12)


def test_creep_coefficients_of_the_paper():
    """f = G a b C with C at a/b = 1.271, by hand from the table's rows 1.25 and 1.42857."""
    f11, f22, f23, _ = PATCH.creep_coefficients(np.array(79265.0))
    area, G = 6.455e-3 * 5.079e-3, 2.059e11 / 2.6
    share = (6.455 / 5.079 - 1.25) / (1 / 0.7 - 1.25)

    def at(column):
        inverse = 1 / TABLE[[11, 12], column]
        rows = 1 / (inverse @ [-0.08, 0.96, 0.12])
        return rows[0] * (1 - share) + rows[1] * share

    assert f11 == pytest.approx(G * area * at(0), rel=3e-4)  # four digits of a and b
    assert f22 == pytest.approx(G * area * at(1), rel=3e-4)
    assert f23 == pytest.approx(G * area**1.5 * at(2), rel=4e-4)
