"""Frequency responses: sums over poles, and their names."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.component import Variable
from railcosim.master.linear.linearise import LinearModel
from railcosim.master.linear.pulse_response import PulseResponse
from railcosim.master.linear.realisation import Realisation
from railcosim.master.linear.receptance import FrequencyResponse, frequency_response, lag

OMEGA = np.linspace(1.0, 300.0, 50)


def oscillator() -> tuple[Realisation, Realisation]:
    """m = 2 kg, c = 8 N s/m, k = 2e4 N/m: displacement and acceleration; and nothing."""
    pole = -2.0 + 1j * np.sqrt(1e4 - 4.0)
    poles = np.array([pole, pole.conjugate()])
    residue = 0.5 / (poles - poles[::-1])
    one = Realisation(
        poles=poles, residues=np.stack([residue, residue * poles**2]), direct=np.array([0.0, 0.5])
    )
    none = Realisation(
        poles=poles[:0], residues=np.zeros((2, 0), dtype=complex), direct=np.zeros(2)
    )
    return one, none


def oscillator_model() -> LinearModel:
    """Displacement and acceleration of the oscillator for two forces, one without effect."""
    one, none = oscillator()
    nothing = np.zeros((0, 2))
    return LinearModel(
        name="oscillator",
        inputs=(Variable(name="push", unit="N"), Variable(name="idle", unit="N")),
        outputs=(Variable(name="z", unit="m"), Variable(name="az", unit="m/s2")),
        responses=tuple(
            PulseResponse(lasting=part, rest=nothing, first=none, step=1e-3) for part in (one, none)
        ),
        mixing=np.eye(2),
        rougher=None,
        error_floor=np.zeros((2, 2)),
        error_estimate=np.zeros((2, 2)),
        steps=0,
        advice=(),
    )


def test_oscillator() -> None:
    exact = 1.0 / (2e4 + 8j * OMEGA - 2.0 * OMEGA**2)
    response = frequency_response(oscillator_model(), OMEGA)
    # Rounding of two terms that cancel to a hundredth at the lowest frequency.
    np.testing.assert_allclose(response.of("z", "push"), exact, rtol=1e-12)
    np.testing.assert_allclose(response.of("az", "push"), -(OMEGA**2) * exact, rtol=1e-11)
    assert not response.of("z", "idle").any()


def test_pulse_response_against_the_static_limit() -> None:
    """Held for ever, an input leads to the receptance at zero frequency."""
    one, _ = oscillator()
    total = one.direct + one.after_pulse(1e-3, 1e-3, 12_000).sum(axis=0)
    # e^-24 is left after 12 s.
    np.testing.assert_allclose(total, [1.0 / 2e4, 0.0], rtol=1e-9, atol=1e-9)


def test_samples_and_what_their_sum_misses() -> None:
    """The oscillator as samples alone, four to a period, is exact again up to the sampling rate."""
    one, none = oscillator()
    step = np.pi / 200.0
    rest = one.after_pulse(step, step, 1000)  # until e^-31
    without = Realisation(poles=none.poles, residues=none.residues, direct=one.direct)
    omega = np.linspace(5.0, 250.0, 60)
    exact = one.frequency_response(omega)
    # The transform's own error, 1e-13 of the largest sample, over the smallest response.
    response = PulseResponse(lasting=without, rest=rest, first=one, step=step)
    np.testing.assert_allclose(response.frequency_response(omega), exact, rtol=1e-9)
    # Without the first poles the sum aliases.
    wrong = PulseResponse(lasting=without, rest=rest, first=none, step=step)
    assert np.abs(wrong.frequency_response(omega) / exact - 1.0)[:, 0].max() > 0.1


def test_delayed_inputs_act_together() -> None:
    response = frequency_response(oscillator_model(), OMEGA)
    together = response.combined(["push", "push"], lag(OMEGA, [0.0, 0.1]))
    expected = response.of("z", "push") * (1.0 + np.exp(-0.1j * OMEGA))
    np.testing.assert_allclose(together[:, 0], expected, rtol=1e-12)  # rounding
    np.testing.assert_allclose(
        response.combined(["push", "idle"], [2.0, 5.0])[:, 0], 2.0 * response.of("z", "push")
    )


def test_refusals() -> None:
    response = frequency_response(oscillator_model(), OMEGA)
    with pytest.raises(ValueError, match="no input pusch; did you mean push"):
        response.of("z", "pusch")
    with pytest.raises(ValueError, match="no output y"):
        response.of("y", "push")
    with pytest.raises(ValueError, match="values are"):
        FrequencyResponse(
            name="x", omega=OMEGA, outputs=("a",), inputs=("b",), values=response.values
        )
