"""Parts of a track in numbers: Table A2 of Xu & Lu (2021), read as their frequencies demand."""

from __future__ import annotations

from dataclasses import dataclass

from railcosim.parameters import ParameterSet, Usual, quantity, switch

A2 = "Xu & Lu 2021, Table A2"
CHN60 = "CHN60 rail section"

STEEL = Usual(1e11, 3e11, "iron to steel")
POISSON = Usual(0.1, 0.45, "concrete to rubber")
SECOND_MOMENT = Usual(5e-7, 1e-4, "light railways, lateral, to crane rails")
PAD = Usual(1e6, 3e9, "the softest fastenings to stiff pads")
PAD_DAMPING = Usual(300.0, 1e6, "soft fastenings to stiff pads")
ROLL = (
    "an ASSUMPTION: {} b^2/12 of {} all over a foot b = 0.15 m wide; it decides how stiff the rail "
    "is to lateral forces on its head"
)
BAND = Usual(200.0, 20000.0, "ride to corrugation")
MOST_CELLS = 400


@dataclass(frozen=True, kw_only=True)
class Rail(ParameterSet):
    """A Timoshenko rail that bends both ways and twists."""

    young_modulus: float = quantity(
        2.059e11, "N/m2", "elastic modulus", above=0, usual=STEEL, source=A2
    )
    poisson_ratio: float = quantity(
        0.3, "1", "Poisson ratio, for the shear modulus", minimum=0, maximum=0.499, usual=POISSON,
        source=CHN60,
    )  # fmt: skip
    mass_per_length: float = quantity(
        60.64, "kg/m", "mass per length", above=0,
        usual=Usual(15.0, 100.0, "light railways to crane rails"), source=A2,
    )  # fmt: skip
    area: float = quantity(
        7.745e-3, "m2", "cross-section area", above=0,
        usual=Usual(1.5e-3, 1.5e-2, "light railways to crane rails"), source=CHN60,
    )  # fmt: skip
    shear_coefficient: float = quantity(
        0.5329, "1", "Timoshenko shear coefficient kappa", above=0, maximum=1,
        usual=Usual(0.2, 0.9, "thin webs to a solid bar"), source=CHN60,
    )  # fmt: skip
    second_moment: float = quantity(
        3.215e-5, "m4", "second moment of area for vertical bending, I_ry", above=0,
        usual=SECOND_MOMENT, source=A2,
    )  # fmt: skip
    second_moment_lateral: float = quantity(
        5.24e-6, "m4", "for lateral bending, I_rz; not used by the vertical model", above=0,
        usual=SECOND_MOMENT, source=A2,
    )  # fmt: skip
    shear_coefficient_lateral: float = quantity(
        0.45, "1", "kappa of lateral bending; not used by the vertical model", above=0, maximum=1,
        usual=Usual(0.2, 0.9, "thin webs to a solid bar"), source="as other rails'; none known",
    )  # fmt: skip
    torsional_rigidity: float = quantity(
        1.9587e5, "N.m2", "GJ, printed in N m/rad; not used by the vertical model", above=0,
        usual=Usual(1e4, 1e6, "light railways to heavy haul"), source=A2,
    )  # fmt: skip
    polar_inertia: float = quantity(
        0.29367, "kg.m", "about the centroid; not used by the vertical model", above=0,
        usual=Usual(0.02, 1.0, "light railways to crane rails"),
        source=f"7850 kg/m3 times 3.741e-5 m4, {CHN60}",
    )  # fmt: skip
    warping_constant: float = quantity(
        0.0, "m6", "about the shear centre; 0: none; not used by the vertical model", minimum=0,
        usual=Usual(1e-9, 2e-7, "light railways to heavy haul"), source="none in the paper",
    )  # fmt: skip
    shear_centre_depth: float = quantity(
        0.0, "m", "shear centre below the centroid; not used by the vertical model", minimum=0,
        maximum=0.2, usual=Usual(0.005, 0.06, "rails: towards the foot"),
        source="none in the paper; 33 mm for UIC60",
    )  # fmt: skip
    centroid_height: float = quantity(
        0.081, "m", "centroid above the foot; vertically, of stress alone", above=0, maximum=1,
        usual=Usual(0.03, 0.12, "light railways to crane rails"), source=CHN60,
    )  # fmt: skip
    head_height: float = quantity(
        0.095, "m", "top of the head above the centroid; not used by the vertical model", above=0,
        maximum=1, usual=Usual(0.03, 0.12, "light railways to crane rails"), source=CHN60,
    )  # fmt: skip
    loss_factor: float = quantity(
        0.0, "1", "hysteretic loss factor of bending and shear", minimum=0, maximum=1,
        usual=Usual(1e-4, 0.1, "steel to damped rails"), source="none in the paper",
    )  # fmt: skip
    lateral_distance: float = quantity(
        1.5, "m", "distance between the two rails' contact points", above=0,
        usual=Usual(0.6, 1.9, "narrow to broad gauge"), source="usual",
    )  # fmt: skip

    @property
    def bending_stiffness(self) -> float:
        """EI of vertical bending, N m2."""
        return self.young_modulus * self.second_moment

    @property
    def section_modulus_foot(self) -> float:
        """Of vertical bending, at the underside of the foot, m3; 397 cm3 of CHN60, 375 of UIC60."""
        return self.second_moment / self.centroid_height

    @property
    def shear_modulus(self) -> float:
        """G, N/m2."""
        return self.young_modulus / (2 * (1 + self.poisson_ratio))

    @property
    def shear_stiffness(self) -> float:
        """Kappa G A of vertical bending, N."""
        return self.shear_coefficient * self.shear_modulus * self.area

    @property
    def rotary_inertia(self) -> float:
        """Rho I of vertical bending, kg m."""
        return self.mass_per_length / self.area * self.second_moment


@dataclass(frozen=True, kw_only=True)
class Fastening(ParameterSet):
    """Fastening system and railpad at one railseat of one rail."""

    stiffness: float = quantity(3e7, "N/m", "vertical stiffness", above=0, usual=PAD, source=A2)
    damping: float = quantity(
        2.5e4, "N.s/m", "vertical damping", minimum=0, usual=PAD_DAMPING, source=A2
    )
    stiffness_lateral: float = quantity(
        3.5e7, "N/m", "lateral stiffness; not used by the vertical model", above=0, usual=PAD,
        source=A2,
    )  # fmt: skip
    damping_lateral: float = quantity(
        2.5e4, "N.s/m", "lateral damping; not used by the vertical model", minimum=0,
        usual=PAD_DAMPING, source=A2,
    )  # fmt: skip
    roll_stiffness: float = quantity(
        56250.0, "N.m/rad", "against roll of the foot; not used by the vertical model", above=0,
        usual=Usual(5e3, 5e6, "the softest to the stiffest under a foot 0.15 m wide"),
        source=ROLL.format("stiffness", "3e7 N/m"),
    )  # fmt: skip
    roll_damping: float = quantity(
        46.875, "N.m.s/rad", "of roll of the foot; not used by the vertical model", minimum=0,
        usual=Usual(0.5, 2e3, "soft to stiff fastenings under a foot 0.15 m wide"),
        source=ROLL.format("damping", "2.5e4 N s/m"),
    )  # fmt: skip
    loss_factor: float = quantity(
        0.0, "1", "hysteretic loss factor of the railpad", minimum=0, maximum=2,
        usual=Usual(0.01, 0.6, "rubber compounds"), source="none in the paper",
    )  # fmt: skip
    spacing: float = quantity(
        0.625, "m", "distance of railseats; divides the cell (slab and joint)", above=0,
        usual=Usual(0.3, 1.5, "turnouts to bridges"), source="pinned-pinned frequency of 1062 Hz",
    )  # fmt: skip
    continuous: bool = switch(
        False, "true: spread along the rail, so much on every spacing; vertical only",
        source="railseats in the paper",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Slab(ParameterSet):
    """A prefabricated slab: a thin plate with free edges; joints separate the slabs."""

    present: bool = switch(True, "false: there is rigid ground in its place", source=A2)
    young_modulus: float = quantity(
        3.6e10, "N/m2", "elastic modulus", above=0,
        usual=Usual(5e9, 1e11, "asphalt to the best concrete"), source=A2,
    )  # fmt: skip
    poisson_ratio: float = quantity(
        0.25, "1", "Poisson ratio", minimum=0, maximum=0.499, usual=POISSON, source=A2
    )
    density: float = quantity(
        2500.0, "kg/m3", "density", above=0, usual=Usual(1500.0, 4000.0, "light to heavy concrete"),
        source=A2,
    )  # fmt: skip
    thickness: float = quantity(
        0.19, "m", "thickness", above=0, usual=Usual(0.08, 1.5, "thin plates to floating slabs"),
        source=A2,
    )  # fmt: skip
    length: float = quantity(
        4.95, "m", "length of one slab", above=0,
        usual=Usual(2.0, 50.0, "short plates to floating slabs"), source=A2,
    )  # fmt: skip
    width: float = quantity(
        2.40, "m", "width", above=0, usual=Usual(1.5, 6.0, "narrow gauge to wide bearing layers"),
        source=A2,
    )  # fmt: skip
    joint: float = quantity(
        0.05, "m", "gap between two slabs", minimum=0,
        usual=Usual(0.005, 0.3, "sealed to open joints"), source="a cell of 5.00 m, 8 railseats",
    )  # fmt: skip
    tilts_rails: bool = switch(
        False, "rails roll and shift with the bent slab's surface; not used by the vertical model",
        source="the school's models have upright rails; then vertical loads move none sideways",
    )  # fmt: skip

    @property
    def bending_stiffness(self) -> float:
        """D = E h^3 / (12 (1 - nu^2)), N m."""
        return self.young_modulus * self.thickness**3 / (12 * (1 - self.poisson_ratio**2))

    @property
    def mass_per_area(self) -> float:
        """Rho h, kg/m2."""
        return self.density * self.thickness


@dataclass(frozen=True, kw_only=True)
class Foundation(ParameterSet):
    """Viscoelastic Winkler foundation over the slab's area."""

    stiffness: float = quantity(
        6e7, "N/m3", "stiffness per area, printed as k_ty; 0: mounts only", minimum=0,
        usual=Usual(1e6, 1e10, "floating slabs to rock"),
        source=f"{A2}; per area, as the first rail resonance of 52 Hz demands",
    )  # fmt: skip
    damping: float = quantity(
        1e4, "N.s/m3", "damping per area", minimum=0,
        usual=Usual(1e3, 1e6, "floating slabs to soft soil"), source=A2,
    )  # fmt: skip
    stiffness_lateral: float = quantity(
        6e7, "N/m3", "lateral stiffness per area; not used by the vertical model", above=0,
        usual=Usual(1e6, 1e10, "floating slabs to rock"),
        source=f"{A2}: k_ty, which by its subscript is lateral, read as per area",
    )  # fmt: skip
    damping_lateral: float = quantity(
        1e4, "N.s/m3", "lateral damping per area; not used by the vertical model", minimum=0,
        usual=Usual(1e3, 1e6, "floating slabs to soft soil"), source=f"{A2}: c_ty, per area",
    )  # fmt: skip
    ca_layer_stiffness: float = quantity(
        0.0, "N/m3", "cement-asphalt layer in series; 0: none (the paper prints 1.3e9)", minimum=0,
        usual=Usual(1e8, 1e12, "soft mortar to concrete"),
        source="off: with 1.3e9 the first rail resonance is 51.9 Hz",
    )  # fmt: skip

    mounts: int = quantity(
        0, "1", "single springs in either of two rows along a slab, evenly; 0: none", minimum=0,
        maximum=100, usual=Usual(2, 40, "floating slabs"), source="none in the paper",
    )  # fmt: skip
    mount_stiffness: float = quantity(
        1e7, "N/m", "vertical stiffness of a mount", above=0,
        usual=Usual(1e6, 1e8, "coil springs to rubber blocks"), source="none in the paper",
    )  # fmt: skip
    mount_damping: float = quantity(
        1e4, "N.s/m", "vertical damping of a mount", minimum=0,
        usual=Usual(100.0, 1e6, "coil springs to viscous dampers"), source="none in the paper",
    )  # fmt: skip
    mount_distance: float = quantity(
        1.5, "m", "between the two rows", above=0,
        usual=Usual(0.5, 4.0, "under rails to under edges"), source="none in the paper",
    )  # fmt: skip

    @property
    def series_stiffness(self) -> float:
        """Foundation and cement-asphalt layer in series, N/m3."""
        if self.ca_layer_stiffness == 0 or self.stiffness == 0:
            return self.stiffness
        return 1 / (1 / self.stiffness + 1 / self.ca_layer_stiffness)


@dataclass(frozen=True, kw_only=True)
class Mesh(ParameterSet):
    """How finely the track is described and what the reduced model keeps."""

    cells: int = quantity(
        20, "1", "cells in the ring (an even number)", minimum=4, maximum=MOST_CELLS,
        usual=Usual(6, 200, "a ring that holds a vehicle, to one of a kilometre"),
        source="100 m: within 1e-3 of an endless track to 900 Hz",
    )  # fmt: skip
    elements_per_bay: int = quantity(
        8, "1", "rail elements between two railseats (an even number)", minimum=2, maximum=64,
        usual=Usual(4, 32, "bending alone to ten kilohertz"),
        source="pinned-pinned frequency to 1e-5, receptance to 0.5 % below 1 kHz, 1.5 % below 2",
    )  # fmt: skip
    highest_slab_frequency: float = quantity(
        3000.0, "Hz", "free-plate modes kept", above=0, maximum=20000, usual=BAND,
        source="about 50 of each parity",
    )  # fmt: skip
    highest_frequency: float = quantity(
        5000.0, "Hz", "modes of the ring kept; from 0.6 of it on they fade out", above=0,
        maximum=20000, usual=BAND,
        source="receptance within 2e-3 of the finite elements to 1500 Hz",
    )  # fmt: skip
    loss_factor_frequency: float = quantity(
        1000.0, "Hz", "where loss factors become an equal viscous damping in time", above=0,
        maximum=20000, usual=Usual(10.0, 5000.0, "resonances of rails on pads"),
        source="near the pinned-pinned resonance",
    )  # fmt: skip
