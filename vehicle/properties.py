"""Properties of a vehicle's parts.

The defaults are Table A1 of Xu & Lu (2021), counts read as their frequencies demand.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from railcosim.parameters import ParameterSet, Usual, quantity, switch, word

A1 = "Xu & Lu 2021, Table A1"
LATERAL = "not used by the vertical model"
STANDARD_GRAVITY = 9.81
SCHOOL = f"not in the paper, a published model of the same school; {LATERAL}"

NONE = "none in the paper"

BODY = Usual(3e3, 1.5e5, "empty wagons to loaded ones")
FRAME = Usual(500.0, 3e4, "light trams to locomotives")
AXLE = Usual(500.0, 6e3, "trams to driven axles")
BODY_INERTIA = Usual(2e3, 1e7, "about x of a light wagon to about y of a long coach")
FRAME_INERTIA = Usual(200.0, 1e5, "light trams to locomotives")
AXLE_INERTIA = Usual(20.0, 5e3, "about y of a tram's to about x of a driven axle")
WHEEL = Usual(0.15, 0.75, "low-floor wagons to locomotives")
SPRING = Usual(2e4, 2e8, "air springs to axle guides")
DAMPER = Usual(500.0, 2e6, "weak springs' own to yaw dampers")
SPAN = Usual(0.4, 1.6, "inside frames to broad gauge")
HEIGHT = Usual(-2.0, 3.0, "within a vehicle")
STEEL = Usual(1e11, 3e11, "iron to steel")
POISSON = Usual(0.1, 0.45, "concrete to rubber")


@dataclass(frozen=True, kw_only=True)
class CarBody(ParameterSet):
    """The car body."""

    mass: float = quantity(49080.0, "kg", "mass", above=0, usual=BODY, source=A1)
    inertia_roll: float = quantity(
        65700.0, "kg.m2", f"about x; {LATERAL}", above=0, usual=BODY_INERTIA, source=A1
    )
    inertia_pitch: float = quantity(
        1698400.0, "kg.m2", "about y", above=0, usual=BODY_INERTIA, source=A1
    )
    inertia_yaw: float = quantity(
        1447100.0, "kg.m2", f"about z; {LATERAL}", above=0, usual=BODY_INERTIA, source=A1
    )


@dataclass(frozen=True, kw_only=True)
class Bogie(ParameterSet):
    """A bogie frame."""

    mass: float = quantity(4420.0, "kg", "mass", above=0, usual=FRAME, source=A1)
    inertia_roll: float = quantity(
        1576.0, "kg.m2", f"about x; {LATERAL}", above=0, usual=FRAME_INERTIA, source=A1
    )
    inertia_pitch: float = quantity(
        4902.0, "kg.m2", "about y", above=0, usual=FRAME_INERTIA, source=A1
    )
    inertia_yaw: float = quantity(
        3551.0, "kg.m2", f"about z; {LATERAL}", above=0, usual=FRAME_INERTIA, source=A1
    )


@dataclass(frozen=True, kw_only=True)
class Wheelset(ParameterSet):
    """A wheelset."""

    mass: float = quantity(1680.0, "kg", "mass", above=0, usual=AXLE, source=A1)
    inertia_roll: float = quantity(
        773.3, "kg.m2", f"about x; {LATERAL}", above=0, usual=AXLE_INERTIA, source=A1
    )
    inertia_spin: float = quantity(
        130.0, "kg.m2", f"about y; {LATERAL}", above=0, usual=AXLE_INERTIA, source=A1
    )
    inertia_yaw: float = quantity(
        770.0, "kg.m2", f"about z; {LATERAL}", above=0, usual=AXLE_INERTIA, source=A1
    )
    radius: float = quantity(0.43, "m", "wheel radius R_0", above=0, usual=WHEEL, source=A1)


@dataclass(frozen=True, kw_only=True)
class PrimarySuspension(ParameterSet):
    """Primary suspension of ONE wheel; two an axle."""

    stiffness: float = quantity(
        1.27e6, "N/m", "vertical, k_pz", above=0, usual=SPRING, source=f"{A1}, a wheel"
    )
    damping: float = quantity(
        65e3, "N.s/m", "vertical, c_pz", minimum=0, usual=DAMPER, source=f"{A1}, a wheel"
    )
    stiffness_x: float = quantity(
        1.24e6, "N/m", f"longitudinal, k_px; {LATERAL}", above=0, usual=SPRING, source=A1
    )
    stiffness_y: float = quantity(
        1.24e6, "N/m", f"lateral, k_py; {LATERAL}", above=0, usual=SPRING, source=A1
    )
    damping_x: float = quantity(
        0.0, "N.s/m", f"longitudinal, c_px; {LATERAL}", minimum=0, usual=DAMPER, source=NONE
    )
    damping_y: float = quantity(
        0.0, "N.s/m", f"lateral, c_py; {LATERAL}", minimum=0, usual=DAMPER, source=NONE
    )
    half_span: float = quantity(0.978, "m", "lateral half-span", above=0, usual=SPAN, source=SCHOOL)


@dataclass(frozen=True, kw_only=True)
class SecondarySuspension(ParameterSet):
    """Secondary suspension of ONE side of a bogie; two a bogie."""

    stiffness: float = quantity(
        0.27e6, "N/m", "vertical, k_sz", above=0, usual=SPRING, source=f"{A1}, a side"
    )
    damping: float = quantity(
        16.5e3, "N.s/m", "vertical, c_sz", minimum=0, usual=DAMPER, source=f"{A1}, a side"
    )
    stiffness_x: float = quantity(
        0.11e6, "N/m", f"longitudinal, k_sx; {LATERAL}", above=0, usual=SPRING, source=A1
    )
    stiffness_y: float = quantity(
        0.11e6, "N/m", f"lateral, k_sy; {LATERAL}", above=0, usual=SPRING, source=A1
    )
    damping_x: float = quantity(
        0.0, "N.s/m", f"longitudinal, c_sx; {LATERAL}", minimum=0, usual=DAMPER, source=NONE
    )
    damping_y: float = quantity(
        5.4e3, "N.s/m", f"lateral, c_sy; {LATERAL}", minimum=0, usual=DAMPER, source=A1
    )
    roll_stiffness: float = quantity(
        0.0, "N.m/rad", f"of a bogie's roll bar; {LATERAL}", minimum=0,
        usual=Usual(1e5, 5e6, "weak to stiff roll bars"), source=NONE,
    )  # fmt: skip
    half_span: float = quantity(0.978, "m", "lateral half-span", above=0, usual=SPAN, source=SCHOOL)
    yaw_damper: float = quantity(
        0.0, "N.s/m", f"of a longitudinal damper beside the suspension; {LATERAL}", minimum=0,
        usual=DAMPER, source=NONE,
    )  # fmt: skip
    yaw_damper_half_span: float = quantity(
        0.978, "m", f"lateral half-span of the yaw dampers; {LATERAL}", above=0, usual=SPAN,
        source=f"{NONE}; beside the suspension",
    )  # fmt: skip
    stop_stiffness: float = quantity(
        0.0, "N/m", f"of a bogie's lateral stops, their gap closed; {LATERAL}", minimum=0,
        usual=SPRING, source=NONE,
    )  # fmt: skip
    stop_gap: float = quantity(
        0.0, "m", f"to either side, before they act; linear models know stops without a gap only; "
        f"{LATERAL}", minimum=0, usual=Usual(5e-3, 0.1, "stiff to soft bogies"), source=NONE,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Geometry(ParameterSet):
    """Where the bodies are; the first two where [[carbodies]] do not say it."""

    bogie_half_distance: float = quantity(
        7.85, "m", "half the distance of the bogie centres, L_c", above=0,
        usual=Usual(2.0, 15.0, "short wagons to long coaches"), source=A1,
    )  # fmt: skip
    axle_half_distance: float = quantity(
        1.25, "m", "half the wheelbase of a bogie, L_t", above=0,
        usual=Usual(0.6, 2.5, "trams to three-axle bogies"), source=A1,
    )  # fmt: skip
    carbody_height: float = quantity(
        1.415, "m", "car body centre of mass above the secondary suspension", usual=HEIGHT,
        source=SCHOOL,
    )  # fmt: skip
    bogie_height: float = quantity(
        -0.081, "m", "bogie centre of mass, height to the secondary suspension", usual=HEIGHT,
        source=SCHOOL,
    )  # fmt: skip
    wheelset_height: float = quantity(
        0.14, "m", "wheelset below the bogie centre of mass", usual=HEIGHT, source=SCHOOL
    )
    primary_height: float = quantity(
        0.0, "m", f"primary suspension below the bogie centre of mass; {LATERAL}", usual=HEIGHT,
        source=f"{SCHOOL}; others have it at the axle",
    )  # fmt: skip
    length: float = quantity(
        22.8, "m", "between coupler faces, whose middle is x = 0; places vehicles in a train",
        above=0, usual=Usual(5.0, 100.0, "short wagons to articulated sets"),
        source="not in the paper; metro cars of type A, whose bogies are 15.7 m apart too",
    )  # fmt: skip
    toppling: bool = switch(
        False, "true: weights topple what tilts on its suspension, weight times height",
        source="left out in the paper's school, present in multibody tools",
    )  # fmt: skip
    gravity: float = quantity(
        STANDARD_GRAVITY, "m/s2", "acceleration of gravity", above=0,
        usual=Usual(9.7, 9.9, "on the Earth"), source="usual",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Contact(ParameterSet):
    """Hertz contact of a wheel, whose radius is the wheelset's, on a rail: eq. 18."""

    young_modulus: float = quantity(
        2.059e11, "N/m2", "elastic modulus of wheel and rail", above=0, usual=STEEL,
        source="as the rail's",
    )  # fmt: skip
    poisson_ratio: float = quantity(
        0.3, "1", "Poisson ratio of wheel and rail", minimum=0, maximum=0.499, usual=POISSON,
        source="steel",
    )  # fmt: skip
    rail_radius: float = quantity(
        0.3, "m", "radius of the rail head across", above=0,
        usual=Usual(0.05, 1.0, "a worn edge to a flattened head"), source="CHN60 rail section",
    )  # fmt: skip
    half_distance: float = quantity(
        0.7465, "m", f"half the distance of the points of contact across; {LATERAL}", above=0,
        usual=Usual(0.4, 0.9, "narrow to broad gauge"), source="middles of the heads of CHN60",
    )  # fmt: skip


class FileName(str):
    """A name that a parameter file has for another, and the folder where it is looked for.

    Attributes
    ----------
    folder : Path
        Of the parameter file.
    """

    folder: Path

    def __new__(cls, name: str, folder: Path) -> FileName:
        """A name in a folder."""
        made = super().__new__(cls, name)
        made.folder = folder
        return made

    def __getnewargs__(self) -> tuple[str, Path]:  # type: ignore[override]
        """For copies and other processes."""
        return str(self), self.folder


@dataclass(frozen=True, kw_only=True)
class Rolling(ParameterSet):
    """How wheels roll on rails in three dimensions; the vertical model has no use for it."""

    conicity: float = quantity(
        0.05, "1", "lambda, tangent of the angle of conical wheels", above=0, maximum=1.0,
        usual=Usual(0.01, 0.5, "new wheels of high speed to worn ones"),
        source=f"{NONE}: cones of 1:20",
    )  # fmt: skip
    friction: float = quantity(
        0.3, "1", "coefficient of friction", above=0, maximum=2.0,
        usual=Usual(0.03, 0.6, "leaves to dry rails"), source=f"{NONE}: dry rails",
    )  # fmt: skip
    creep: str = word(
        "saturated", "linear (Kalker), saturated (Shen, Hedrick & Elkins) or fastsim (Kalker)",
        source="usual",
    )  # fmt: skip
    gravity: str = word(
        "normals", "of cones: normals, contact springs along the normals; textbook, by eqs 4, 5",
        source="Xu & Lu 2021",
    )  # fmt: skip
    flange_stiffness: float = quantity(
        14.6e6, "N/m", "of a flange against its rail, across", minimum=0,
        usual=Usual(1e6, 1e9, "rails that bend to steel"), source="Cooperrider 1972",
    )  # fmt: skip
    flange_clearance: float = quantity(
        9.1e-3, "m", "how far a wheelset may go to one side", above=0,
        usual=Usual(2e-3, 2e-2, "narrow new to worn"), source="Cooperrider 1972",
    )  # fmt: skip
    flange_depth: float = quantity(
        0.014, "m", "of a flange's contact below the top of the rail", minimum=0,
        usual=Usual(0.005, 0.03, "high to low on the flange"), source="EN 13848, where gauge is",
    )  # fmt: skip
    wheel_profile: str = word("", "CSV of a profile in place of a cone", source="none: a cone")
    rail_profile: str = word("", "CSV of its rail, with wheel_profile", source="none: a circle")
    profile_range: float = quantity(
        8e-3, "m", "how far to either side profiles are tabulated", minimum=1e-3, maximum=0.05,
        usual=Usual(2e-3, 2e-2, "without flanges to worn ones"), source="short of most flanges",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Coupler(ParameterSet):
    """Between two car bodies; at rest a coupler between two vehicles carries nothing."""

    stiffness: float = quantity(
        0.0, "N/m", "vertical", minimum=0, usual=SPRING, source=f"{NONE}: slides up and down"
    )
    damping: float = quantity(0.0, "N.s/m", "vertical", minimum=0, usual=DAMPER, source=NONE)
