"""What makes a run suspicious, and what clears or condemns it."""

import numpy as np
import pytest
import xarray as xr

from railcosim.analysis.pair.verdict import DISAGREE, Signs, confirmed, signs_of
from railcosim.mechanics.ports import FORCE, Layout

FORCES = Layout().names(FORCE)

LOAD, STEP = 8e4, 1e-3
TIMES = np.arange(0.0, 1.0, STEP)


def run(force, times=TIMES):
    """All eight contacts alike, at rest at first."""
    values = LOAD + np.where(times == 0, 0.0, force)
    return xr.Dataset(dict.fromkeys(FORCES, ("time", values)), {"time": times})


def system(values):
    """Anything else than our pair."""
    return xr.Dataset({"x": ("time", values), "y": ("time", np.sin(30 * TIMES))}, {"time": TIMES})


WAVE = 0.5 * LOAD * np.sin(2 * np.pi * 60 * TIMES)
DEFECT = 1.3 * LOAD * np.exp(-(((TIMES - 0.3) / 0.005) ** 2))
LATE = 1.3 * LOAD * np.exp(-(((TIMES - 0.8) / 0.005) ** 2))


@pytest.mark.parametrize(
    ("force", "sign"),
    [
        (WAVE, ""),
        (WAVE - DEFECT, "a wheel is off the rail"),
        (3 * DEFECT, "forces up to"),  # 3.9 and 1 times the static load
        (0.5 * LOAD * np.exp(8 * (TIMES - 1)) * np.sin(400 * TIMES), "forces grow"),
        (0.1 * LOAD * (-1.0) ** np.arange(len(TIMES)), "goes up and down from step to step"),
        (0.1 * LOAD * np.random.default_rng(1).standard_normal(len(TIMES)), ""),
    ],
)
def test_signs(force, sign) -> None:
    found = signs_of(run(force))
    assert sign in str(found)
    assert bool(found.texts) == bool(sign)


def test_of_any_system_only_alternation_is_a_sign() -> None:
    assert not signs_of(system(-5 * np.exp(TIMES))).texts
    assert not signs_of(system(np.zeros(len(TIMES)))).texts
    found = signs_of(system(1.0 + 0.1 * (-1.0) ** np.arange(len(TIMES))))
    assert found.columns == ("x",)


def judge(force, others):
    """Against other forces, one each time the step is halved; and when the repetitions ended."""
    asked = []

    def again(factor, until):
        asked.append(until)
        step = STEP / factor
        times = np.arange(0.0, until + step / 2, step)
        k = min(round(np.log2(factor)), len(others)) - 1
        return run(np.interp(times, TIMES, others[k]), times), None

    ours = run(force)
    return confirmed(ours, signs_of(ours), again), asked


def test_a_defect_that_half_the_step_confirms_is_believed() -> None:
    verdict, asked = judge(WAVE - DEFECT, [WAVE - 1.1 * DEFECT])
    assert verdict.believed
    assert "a wheel is off the rail" in str(verdict)
    # A tenth of a second beyond the first sign, then beyond the last.
    assert asked == pytest.approx([0.39, 0.4], abs=0.01)


def test_what_shorter_steps_do_not_show_is_not_believed() -> None:
    verdict, _ = judge(WAVE - DEFECT, [0.2 * WAVE])
    assert not verdict.believed
    assert str(verdict).startswith("not to be believed: a wheel is off the rail")


def test_hammering_that_half_the_step_does_not_end_is_not_believed() -> None:
    """Two runs that both hammer differ by 1.4 of either, whatever they look like."""
    rng = np.random.default_rng(2)
    first, second, third = 2 * LOAD * rng.standard_normal((3, len(TIMES)))
    assert DISAGREE < 1.0
    verdict, asked = judge(first, [second, 3 * third, WAVE])
    assert not verdict.believed
    assert len(asked) == 3
    assert "0.125 ms" in str(verdict)


def test_true_loss_of_contact_with_too_long_steps_is_said_and_not_condemned() -> None:
    """The forces of a short defect are far off, but it is there with every step."""
    verdict, _ = judge(WAVE - DEFECT, [WAVE - 6 * DEFECT, WAVE - 5.5 * DEFECT])
    assert verdict.believed
    assert "this one is too long" in str(verdict)


def test_what_no_step_settles_is_not_believed() -> None:
    rng = np.random.default_rng(3)
    noise = [2 * LOAD * n for n in rng.standard_normal((12, len(TIMES)))]
    verdict, asked = judge(noise[0], noise[1:])
    assert not verdict.believed
    assert len(asked) == 7  # from 0.5 ms to 8 us


def test_the_last_sign_counts_as_the_first() -> None:
    """A first defect that is true does not clear the hammering that a second one starts."""
    verdict, asked = judge(WAVE - DEFECT - LATE, [WAVE - DEFECT])
    assert not verdict.believed
    assert asked[0] < 0.5 < asked[1]


def test_a_repetition_that_fails_clears_nothing_and_an_interruption_is_one() -> None:
    ours = run(WAVE - DEFECT)
    signs = signs_of(ours)
    verdict = confirmed(ours, signs, lambda factor, until: (ours, ArithmeticError("diverged")))
    assert not verdict.believed
    with pytest.raises(KeyboardInterrupt):
        confirmed(ours, signs, lambda factor, until: (ours, KeyboardInterrupt()))


def test_outputs_of_different_units_count_alike() -> None:
    """A large output that agrees does not hide a small one that does not."""
    swing = (-1.0) ** np.arange(len(TIMES)) * (TIMES > 0)
    ours, other = (
        xr.Dataset({"large": ("time", 1e6 * swing), "small": ("time", s * swing)}, {"time": TIMES})
        for s in (1.0, 5.0)
    )
    signs = Signs(texts=("x",), times=TIMES[-1:], columns=("large", "small"))
    assert "differs by 80%" in str(confirmed(ours, signs, lambda factor, until: (other, None)))
    assert "within 0%" in str(confirmed(ours, signs, lambda factor, until: (ours, None)))
