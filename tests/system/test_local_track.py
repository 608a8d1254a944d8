"""A vehicle on a track that is different at single places: against the whole changed by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from railcosim.analysis.comparison.springs import frequency_errors
from railcosim.analysis.response.local_track import Local
from railcosim.mechanics.ports import Z
from railcosim.parameters import ParameterError
from railcosim.reference.lying import Lying
from railcosim.reference.monolithic import assemble
from railcosim.reference.slabs import slabs_of
from railcosim.track.local import LocalChange

SEAT, BESIDE = 0.3125, 1.5625  # m: under the last wheelset, and two bays on
CHANGES = [
    LocalChange(what="fastening", x=SEAT, value=0.0, sides=(-1,)),
    LocalChange(what="fastening", x=BESIDE, value=0.3),
]
FREQUENCY = np.array([5.0, 31.0, 70.0, 160.0, 400.0, 900.0])


def changed_by_hand(mono):
    """Springs and dampers of the same places taken out of the matrices of all."""
    ring, before = mono.ring, len(mono.body.coordinates)
    (rails,) = ring.chains
    lying = Lying(
        track=ring.track, nodes=rails.nodes, section=rails.section,
        slabs=slabs_of(ring.track, (Z,)), between=[],
    )  # fmt: skip
    (pads, *_) = lying.joints((Z,))
    (spring,) = pads.springs
    K, C = mono.K, mono.C
    for x, left, sides in ((SEAT, 0.0, [0]), (BESIDE, 0.3, [0, 1])):
        k = int(np.argmin(np.abs(pads.x - x)))
        assert pads.x[k] == pytest.approx(x)
        for side in sides:
            row = pads.stretch(Z, side)[[k]]
            row = sparse.hstack([sparse.csr_array((1, before)), row], format="csr")
            square = (row.T @ row) * (left - 1)
            K, C = K + spring.stiffness * square, C + spring.damping * square
    return replace(mono, K=K.tocsc(), C=C.tocsc())


# The monolithic system, solved at six frequencies: 3 s.
@pytest.mark.slow
def test_coupled_it_is_the_system_changed_by_hand(exported, models):
    mono = assemble(exported.vehicle, exported.track, models.positions)
    local = Local(exported.track, CHANGES).under(models)
    assert local.attributes["local"] == "fastening.left@0.3125=0 fastening@1.5625=0.3"

    def worst(system, reference):
        found = frequency_errors(system, reference, 1e9, FREQUENCY, lambda a, b: None)
        return max(
            np.nanmax(error, where=strong, initial=0.0)
            for by_output in found.values() for error, strong in by_output.values()
        )  # fmt: skip

    changed = changed_by_hand(mono)
    # As near as without a change: modes fade out above 3 kHz, and the ring has six cells in both.
    before = worst(models, mono)
    assert before < 5e-3
    assert worst(local, changed) < max(2 * before, 5e-3)
    assert worst(models, changed) > 0.1  # it does something


def test_what_is_not_there_is_refused(exported):
    there = LocalChange(what="block", x=SEAT, value=0.0)
    with pytest.raises(ParameterError, match="must be one of mass, fastening"):
        Local(exported.track, [there])
