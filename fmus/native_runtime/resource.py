"""model.bin: the model and its interface as the C runtime reads them (`c/resource.h`, `c/model.h`).

Little-endian. A head (magic, size, checksum, number of sections), then an entry a section (name,
type, shape, offset), then their data.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.ports import Layout
from railcosim.parameters import ParameterError
from railcosim.vehicle.multibody import COORDINATES, WHEELSETS

from ..content import Arrays
from ..description.kind import KINDS
from ..interface import Scalar, owns_contact
from ..python_runtime.bodies import TrackBody, VehicleBody

MAGIC = b"RAILCOS1"
HEAD, ENTRY = struct.Struct("<8sQQII"), struct.Struct("<24sII3QQ")
ALIGNMENT = 64
TYPES = {np.dtype("<f8"): 1, np.dtype("<i4"): 2, np.dtype("u1"): 3, np.dtype("<f4"): 4}
VALUE_TYPES = {"Real": 0, "Integer": 1, "Boolean": 2}
MOST_MODES, LARGEST_TABLE = 1_000_000, 1_900_000_000  # a little less than model.c takes
OUTSIDE, WHEEL, RAIL = 0, 1, -1  # whose motion presses the contact: nobody's, down, up

# Role (c/model.h) of a variable by its causality and the last part of its name.
POSITION, LOAD, LOAD_LESS, COORDINATE, RATE, ACCELERATION = 1, 2, 3, 8, 9, 10
ROLES = {
    ("independent", "time"): 0,
    ("input", "position"): POSITION,
    ("input", "force_z"): LOAD,
    ("input", "wheel_z"): LOAD,
    ("input", "rail_z"): LOAD,
    ("output", "position"): 4,
    ("output", "force_z"): 5,
    ("output", "rail_z"): 6,
    ("output", "rail_vz"): 7,
    ("output", "z"): COORDINATE,
    ("output", "pitch"): COORDINATE,
    ("output", "wheel_z"): COORDINATE,
    ("output", "vz"): RATE,
    ("output", "wheel_vz"): RATE,
    ("output", "az"): ACCELERATION,
    ("parameter", "input_hold"): 11,
    ("parameter", "internal_step"): 12,
    ("parameter", "nonlinear"): 13,
    ("parameter", "stiffness"): 14,
    ("parameter", "hertz_coefficient"): 15,
    ("parameter", "speed"): 16,
    ("parameter", "start_position"): 17,
    ("parameter", "start_z"): 18,
}

FOUR = Layout()
Sections = dict[str, NDArray[Any]]


def resource(
    model: str, arrays: Arrays, table: Sequence[Scalar], guid: str, layout: Layout = FOUR
) -> bytes:
    """The content of model.bin.

    Parameters
    ----------
    model : str
        track or vehicle: a key of `BODIES`.
    arrays : dict
        The model, as `content` makes it; both runtimes are fed by it.
    table : sequence of Scalar
        The interface.
    guid : str
        Identity that an importer must ask for.
    layout : Layout
        What meets the model.
    """
    sections = BODIES[model](arrays, owns_contact(table), layout)
    nominals = [block.nominal for block in KINDS[model].states(arrays).blocks]
    sections |= {"guid": _text([guid]), "nominals": np.array(nominals)}
    sizes = [layout.wheelsets, len(layout.sides), len(layout.directions)]
    sections["layout"] = np.array(sizes, np.int32)
    sections["mirror"] = np.array([d.mirror for d in layout.directions], np.int32)
    # Contact forces that load nothing, one a port, N.
    sections["preloads"] = np.full(len(layout.ports), float(arrays.get("wheel_load", 0.0)))
    return _pack(sections | _interface(model, table, layout))


def _sizes(
    *, even: int, odd: int = 0, local: int = 0, rigid: int = 0, coordinates: int = 0,
    nodes: int = 0, cells: int = 0, contact: int,
) -> NDArray[np.int32]:  # fmt: skip
    return np.array([even, odd, local, rigid, coordinates, nodes, cells, contact], np.int32)


def _track(arrays: Arrays, has_contact: bool, layout: Layout) -> Sections:
    nodes, _, ring = arrays["table"].shape
    if arrays["table"].nbytes > LARGEST_TABLE or ring > MOST_MODES:
        raise ParameterError(
            f"[mesh] {ring} modes at {nodes} nodes: the native runtime takes {MOST_MODES} modes "
            f"and tables of {LARGEST_TABLE / 1e9:.1f} GB; reduce cells, elements_per_bay or "
            "highest_frequency"
        )
    body, ports = TrackBody(arrays), len(layout.ports)
    poles = np.concatenate([arrays["poles"], np.full(ports, arrays["residual_pole"])])
    return {
        "sizes": _sizes(
            even=body.even, odd=ring - body.even, local=ports, nodes=nodes,
            cells=body.phase.shape[0], contact=RAIL if has_contact else OUTSIDE,
        ),
        **_complex("pole", poles),
        **_segments(body.partner, arrays["mu"], body.even),
        **_complex("table", arrays["table"]),
        **_complex("local", body.local_table[:-1, None]),
        "geometry": np.array([body.cell_length]),
    }  # fmt: skip


def _vehicle(arrays: Arrays, has_contact: bool, layout: Layout) -> Sections:
    body = VehicleBody(arrays)
    n, coordinates, wheelsets = body.poles.size, body.rigid.shape[0], layout.wheelsets
    through = np.zeros((coordinates, wheelsets))  # a force acts at once on its own wheelset only
    through[-wheelsets:] = -np.diag(arrays["inverse_mass"][-wheelsets:])
    rigid = body.rigid[-wheelsets:]
    return {
        "sizes": _sizes(
            even=n, rigid=body.rigid.shape[1], coordinates=coordinates,
            contact=WHEEL if has_contact else OUTSIDE,
        ),
        **_complex("pole", body.poles),
        "segments": np.array([[0, 0, n]], np.int32),
        "mu": np.zeros(1),
        **_complex("out", body.modes[-wheelsets:]),
        **_complex("in", -arrays["left"][:, -wheelsets:].T),
        **_complex("coordinate", body.modes),
        **_complex("start_s", body.start_s.T),
        "rigid": body.rigid,
        "rigid_out": rigid,
        "rigid_in": -rigid,
        "through": through,
        "start_r": body.start_r.T,
        "wheelset_x": body.wheelset_x,
    }  # fmt: skip


BODIES = {"track": _track, "vehicle": _vehicle}


def _segments(partner: NDArray[np.intp], mu: NDArray[np.float64], even: int) -> Sections:
    """Runs of modes of one wavenumber whose partners run alike: (to, from, size), and mu."""
    broken = np.flatnonzero((np.diff(partner) != 1) | (np.diff(mu) != 0)) + 1
    starts = np.unique(np.concatenate([[0], broken, [even]]))
    starts = starts[starts < partner.size]
    sizes = np.diff(np.append(starts, partner.size))
    rows = np.stack([starts, partner[starts], sizes], axis=1)
    return {"segments": rows.astype(np.int32), "mu": mu[starts]}


def _interface(model: str, table: Sequence[Scalar], layout: Layout) -> Sections:
    rows = [
        [VALUE_TYPES[v.type], int(v.variability == "tunable"), _role(model, v), _owner(v, layout)]
        for v in table
    ]
    ranges = [[float(v.start or 0), *_range(v)] for v in table]
    return {
        "variables": np.array(rows, np.int32),
        "ranges": np.array(ranges),
        "names": _text([v.name for v in table]),
    }


def _range(v: Scalar) -> tuple[float, float]:
    """Least and largest value."""
    if v.type == "Boolean":
        return 0.0, 1.0
    most = float(np.finfo(float).max)
    return (
        -most if v.minimum is None else v.minimum,
        most if v.maximum is None else v.maximum,
    )


def _role(model: str, v: Scalar) -> int:
    quantity = v.name.split(".")[-1]
    if (v.causality, quantity) == ("input", "irregularity_z"):
        # It lowers the rail under a wheel, and so does what a rail presses against less high.
        return LOAD_LESS if model == "track" else LOAD
    return ROLES[v.causality, quantity]


def _owner(v: Scalar, layout: Layout) -> int:
    """Wheelset, port or coordinate, counted from 0."""
    owner, _, quantity = v.name.rpartition(".")
    coordinates = [*COORDINATES[: WHEELSETS.start], *(f"{axle}.z" for axle in layout.axles)]
    if v.causality == "output" and ROLES[v.causality, quantity] in {COORDINATE, RATE, ACCELERATION}:
        body = owner.removesuffix(".left").removesuffix(".right")
        return coordinates.index(f"{body}.pitch" if quantity == "pitch" else f"{body}.z")
    if owner in layout.axles:
        return layout.axles.index(owner)
    return layout.wheels.index(owner) if owner in layout.wheels else 0


def _complex(name: str, values: NDArray[np.complexfloating]) -> Sections:
    return {f"{name}.re": values.real, f"{name}.im": values.imag}


def _text(words: Sequence[str]) -> NDArray[np.uint8]:
    return np.frombuffer(b"".join(word.encode() + b"\0" for word in words), np.uint8)


def _pack(sections: Sections) -> bytes:
    offset = _aligned(HEAD.size + ENTRY.size * len(sections))
    padding = b"\0" * (offset - HEAD.size - ENTRY.size * len(sections))
    entries, parts = [], [padding]
    for name, values in sections.items():
        array = np.ascontiguousarray(values)
        array = array.astype(array.dtype.newbyteorder("<"), copy=False)
        dims = (*array.shape, 0, 0, 0)[:3]
        entries.append(ENTRY.pack(name.encode(), TYPES[array.dtype], array.ndim, *dims, offset))
        size = _aligned(array.nbytes)
        parts += [array.tobytes(), b"\0" * (size - array.nbytes)]
        offset += size
    data = b"".join(entries + parts)
    return HEAD.pack(MAGIC, HEAD.size + len(data), crc32(data), len(sections), 0) + data


def _aligned(size: int) -> int:
    return -(-size // ALIGNMENT) * ALIGNMENT
