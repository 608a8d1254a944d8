"""Frequency responses: sums over poles, and their names."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.component import Variable
from railcosim.master.linearise import LinearModel
from railcosim.master.realisation import Realisation
from railcosim.master.receptance import FrequencyResponse, frequency_response, lag, receptance

OMEGA = np.linspace(1.0, 300.0, 50)


def oscillator_model() -> LinearModel:
    """m = 2 kg, c = 8 N s/m, k = 2e4 N/m: displacement and acceleration for two forces."""
    pole = -2.0 + 1j * np.sqrt(1e4 - 4.0)
    poles = np.array([pole, pole.conjugate()])
    residue = 0.5 / (poles - poles[::-1])
    one = Realisation(
        poles=poles, residues=np.stack([residue, residue * poles**2]), direct=np.array([0.0, 0.5])
    )
    none = Realisation(
        poles=poles[:0], residues=np.zeros((2, 0), dtype=complex), direct=np.zeros(2)
    )
    return LinearModel(
        name="oscillator",
        inputs=(Variable(name="push", unit="N"), Variable(name="idle", unit="N")),
        outputs=(Variable(name="z", unit="m"), Variable(name="az", unit="m/s2")),
        realisations=(one, none),
        remainder=np.zeros((1, 2, 2)),
        mixing=np.eye(2),
        step=1e-3,
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
    np.testing.assert_array_equal(receptance(oscillator_model(), OMEGA), response.values)


def test_pulse_response_against_the_static_limit() -> None:
    """Held for ever, an input leads to the receptance at zero frequency."""
    (one, _) = oscillator_model().realisations
    steps = one.pulse_response(1e-3, 12_000)
    # e^-24 is left after 12 s.
    np.testing.assert_allclose(steps.sum(axis=0), [1.0 / 2e4, 0.0], rtol=1e-9, atol=1e-9)


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
