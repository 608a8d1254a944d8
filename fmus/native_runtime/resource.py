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

from railcosim.mechanics.contact.profiled import NUMBERS, Profiled
from railcosim.mechanics.contact.profiles import COLUMNS
from railcosim.mechanics.gaps import Gaps
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.observation import Observation
from railcosim.mechanics.shapes import AlongRing
from railcosim.parameters import ParameterError

from ..description.structure import states_of
from ..interface import Scalar, owns_contact

MAGIC = b"RAILCOS1"
HEAD, ENTRY = struct.Struct("<8sQQII"), struct.Struct("<24sII3QQ")
ALIGNMENT = 64
TYPES = {np.dtype("<f8"): 1, np.dtype("<i4"): 2, np.dtype("u1"): 3, np.dtype("<f4"): 4}
VALUE_TYPES = {"Real": 0, "Integer": 1, "Boolean": 2}
MOST_MODES, LARGEST_TABLE = 1_000_000, 1_900_000_000  # a little less than model.c takes
MOST_GAPS = 256  # as model_track.c takes
OUTSIDE = 0  # whose motion presses the contact: nobody's

Sections = dict[str, NDArray[Any]]


def resource(
    body: ModalBody, table: Sequence[Scalar], guid: str, profiles: Profiled | None = None
) -> bytes:
    """The content of model.bin.

    Parameters
    ----------
    body : ModalBody
        The model; both runtimes are fed by it.
    table : sequence of Scalar
        The interface.
    guid : str
        Identity that an importer must ask for.
    profiles : Profiled, optional
        Of wheels and rails; they matter to a body that owns contacts which roll.
    """
    layout, nominals = body.layout, [block.nominal for block in states_of(body).blocks]
    known, shapes = body.coordinates, body.shapes
    local = body.ports if shapes.local else 0
    along = shapes if isinstance(shapes, AlongRing) else None
    sizes = [
        body.even, body.shared - body.even, local, body.rigid_out.shape[1],
        0 if known is None else len(known.names),
        0 if along is None else len(along.table), 0 if along is None else along.cells,
        body.even_rigid, 0 if known is None else known.even,
        body.sign if owns_contact(table) else OUTSIDE,
    ]  # fmt: skip
    return _pack({
        "layout": np.array(
            [layout.wheelsets, len(layout.sides), len(layout.directions), body.apart], np.int32
        ),
        "mirror": np.array([d.mirror for d in layout.directions], np.int32),
        "preloads": body.preload,
        "sizes": np.array(sizes, np.int32),
        **_complex("pole", body.poles),
        **(_along(along, body) if along else _everywhere(body)),
        **(_seen(body.observation) if body.observation else {}),
        **(_gaps(body.gaps) if body.gaps else {}),
        "guid": _text([guid]),
        "nominals": np.array(nominals),
        **(_profiles(profiles) if profiles and owns_contact(table) else {}),
        **_interface(table),
    })  # fmt: skip


def _profiles(profiles: Profiled) -> Sections:
    told = profiles.told()
    return {
        "profile": np.array([told["columns"][name] for name in COLUMNS]).T,
        "profile.about": np.array([told[name] for name in NUMBERS]),
    }


def _along(shapes: AlongRing, body: ModalBody) -> Sections:
    nodes, _, ring = shapes.table.shape
    if shapes.table.nbytes > LARGEST_TABLE or ring > MOST_MODES:
        raise ParameterError(
            f"[mesh] {ring} modes at {nodes} nodes: the native runtime takes {MOST_MODES} modes "
            f"and tables of {LARGEST_TABLE / 1e9:.1f} GB; reduce cells, elements_per_bay or "
            "highest_frequency"
        )
    return {
        **_segments(shapes.partner, shapes.mu, body.even, _moved(shapes)),
        **_complex("table", shapes.table),
        **_complex("local", shapes.local_table.reshape(-1, *shapes.local_table.shape[2:])),
        "elements": shapes.elements.astype(np.int32),
        "parts": np.array([shapes.parts], dtype=np.int32),
        "stretches": shapes.stretches,
        "geometry": np.array([shapes.cell_length]),
    }


def _seen(observation: Observation) -> Sections:
    own, places = observation.into.shape[:2]
    return {
        **_complex("seen", observation.shown),
        **_complex("seen_into", observation.into.reshape(own, places, -1)),
        "seen_size": observation.size,
        "seen_begin": observation.begin,
        "seen_spacing": np.array([observation.spacing]),
        "seen_row": observation.row.astype(np.int32),
        "seen_weight": observation.weights,
    }


def _gaps(gaps: Gaps) -> Sections:
    if gaps.gap.size > MOST_GAPS:
        raise ParameterError(
            f"{gaps.gap.size} springs with a gap: the native runtime takes {MOST_GAPS}; a sleeper "
            "has as many as it is held at points"
        )
    return {
        **_complex("gap_shown", gaps.shown),
        "gap_stiffness": gaps.stiffness,
        "gap_damping": gaps.damping,
        "gap": gaps.gap,
    }


def _everywhere(body: ModalBody) -> Sections:
    out, into, _ = body.shapes.at(np.empty(0), 0)
    known = body.coordinates
    if known is None:
        raise TypeError("a body with the same shapes everywhere needs coordinates")
    n = body.poles.size
    along = np.stack([out, into]).reshape(-1, len(body.layout.directions), n) != 0
    moved = np.zeros(n, dtype=int)
    for half in (slice(0, body.even), slice(body.even, n)):  # all of one parity alike: they are few
        moved[half] = _bits(along[..., half].any(axis=(0, 2)))
    return {
        **_segments(np.arange(n), np.zeros(n), body.even, moved),
        **_complex("out", out),
        **_complex("in", into),
        **_complex("coordinate", known.modes),
        **_complex("start_s", known.start_s.T),
        "rigid": known.rigid,
        "rigid_out": body.rigid_out,
        "rigid_in": body.rigid_into,
        "through": known.through,
        "start_r": known.start_r.T,
        "wheelset_x": known.wheelset_x,
    }


def _moved(shapes: AlongRing) -> NDArray[np.intp]:
    """Directions in which each mode moves anywhere, or its partner does, as bits."""
    nodes, values, n = shapes.table.shape
    along = shapes.table.reshape(nodes, values // 2, 2, n) != 0
    moves = _bits(np.asarray(along.any(axis=(0, 2))))
    return moves | moves[shapes.partner]


def _bits(along: NDArray[np.bool_]) -> NDArray[np.intp]:
    """One bit a direction, the first axis; where there is none, of the first."""
    bits = np.left_shift(1, np.arange(len(along)))
    return np.maximum(np.tensordot(bits, along.astype(int), axes=1), 1)


def _segments(
    partner: NDArray[np.intp], mu: NDArray[np.float64], even: int, moved: NDArray[np.intp]
) -> Sections:
    """Runs of modes of one wavenumber whose partners run alike, and that move alike.

    As (to, from, size, directions), and mu.
    """
    broken = (np.diff(partner) != 1) | (np.diff(mu) != 0) | (np.diff(moved) != 0)
    starts = np.unique(np.concatenate([[0], np.flatnonzero(broken) + 1, [even]]))
    starts = starts[starts < partner.size]
    sizes = np.diff(np.append(starts, partner.size))
    rows = np.stack([starts, partner[starts], sizes, moved[starts]], axis=1)
    return {"segments": rows.astype(np.int32), "mu": mu[starts]}


def _interface(table: Sequence[Scalar]) -> Sections:
    rows = [
        [VALUE_TYPES[v.type], int(v.variability == "tunable"), int(v.role), v.index] for v in table
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
