"""Named frequencies of tracks against masses on springs and a rail's closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from railcosim.analysis.response.track_modes import track_modes
from railcosim.mechanics.ports import Z
from railcosim.track.cell import EVEN, ODD
from railcosim.track.files import read_track
from railcosim.track.named_modes import named_modes
from railcosim.track.parameters import Fastening, Mesh, Slab, Track


def two_masses(upper, lower, pad, ground):
    """Natural frequencies of a mass on a mass on the ground, Hz; each of stiffness k."""
    K = np.array([[pad, -pad], [-pad, pad + ground]])
    return np.sqrt(eigh(K, np.diag([upper, lower]), eigvals_only=True)) / (2 * np.pi)


def frequencies(track, parity=EVEN):
    return {mode.name: mode for mode in named_modes(track, (Z,), parity)}


def test_rail_and_slab_are_two_masses_on_springs():
    """A cell: rails of 5 m on 8 fastenings each, on a slab that is stiff. Bending takes 1 %."""
    track = Track(slab=Slab(young_modulus=1e11))
    rail, slab, k = 5 * track.rail.mass_per_length, track.slab, track.foundation.series_stiffness
    area = slab.length * slab.width
    low, high = two_masses(
        rail, slab.mass_per_area * area / 2, 8 * track.fastening.stiffness, k * area / 2
    )
    found = frequencies(track)
    assert found["slab on its foundation, vertical"].frequency == pytest.approx(low, rel=0.01)
    assert found["rail on fastenings, vertical"].frequency == pytest.approx(high, rel=0.01)


def test_rail_and_blocks_are_two_masses_on_springs():
    track = read_track("booted")
    (block,) = track.layers
    rail = track.rail.mass_per_length * track.fastening.spacing
    low, high = two_masses(rail, block.mass, track.fastening.stiffness, block.stiffness)
    found = frequencies(track)
    assert found[f"{block.called} on what is below"].frequency == pytest.approx(low, rel=0.01)
    # The rail bends between railseats: 2 % softer, and no mass on a spring.
    assert found["rail on fastenings, vertical"].frequency == pytest.approx(high, rel=0.03)


def test_damping_ratio_is_of_a_mass_on_a_damper():
    """c / 2 sqrt(k m) and eta / 2: railseats so near that the rail does not bend between."""
    pads = Fastening(spacing=0.05, stiffness=2e6, damping=2e3, loss_factor=0.1)
    track = Track(slab=Slab(present=False, length=0.1, joint=0), fastening=pads,
                  mesh=Mesh(elements_per_bay=2))  # fmt: skip
    mode = frequencies(track)["rail on fastenings, vertical"]
    m = track.rail.mass_per_length * pads.spacing
    assert mode.frequency == pytest.approx(np.sqrt(pads.stiffness / m) / (2 * np.pi), rel=1e-4)
    ratio = pads.damping / (2 * np.sqrt(pads.stiffness * m)) + pads.loss_factor / 2
    assert mode.damping_ratio == pytest.approx(ratio, rel=1e-4)
    assert mode.share == pytest.approx(1.0, abs=1e-4)


def test_torsion_between_railseats():
    """sqrt(GJ / rho I_p) / 2 d; 32 elements a half wave are right to 1e-3."""
    found = track_modes(Track(slab=Slab(present=False), mesh=Mesh(elements_per_bay=32)))
    rail, d = Track().rail, 0.625
    exact = np.sqrt(rail.torsional_rigidity / rail.polar_inertia) / (2 * d)
    assert float(found["undamped_frequency"].sel(name="torsion between railseats")) == (
        pytest.approx(exact, rel=1e-3)
    )
    # Nothing joins the rails: what they do alike and opposite is one.
    assert not any("(rails" in name for name in found["name"].values)


@pytest.mark.slow  # rings aside, of four times the elements: 7 s
def test_a_slab_joins_the_rails():
    """It rolls otherwise than it goes down; a damper at a railseat does not feel nodes there."""
    track = Track(mesh=Mesh(highest_slab_frequency=500))
    rolls = frequencies(track, ODD)["slab on its foundation, rolling"]
    down = frequencies(track)["slab on its foundation, vertical"]
    assert rolls.frequency != pytest.approx(down.frequency, rel=1e-3)
    assert frequencies(track)["pinned-pinned, vertical"].damping_ratio < 1e-6
    names = set(track_modes(replace(track))["name"].values)
    assert "slab on its foundation, lateral (rails alike)" in names
    assert "slab on its foundation, rolling (rails opposite)" in names


def test_what_is_continuous_has_no_railseats_to_swing_between():
    found = named_modes(read_track("embedded"), (Z,), EVEN)
    assert found
    assert not any("pinned" in mode.name or "between" in mode.name for mode in found)


def test_on_mounts_alone_down_only():
    names = track_modes(read_track("floating"))["name"].values
    assert any("vertical" in name for name in names)
    assert not any("lateral" in name or "torsion" in name for name in names)
