"""Plain values as bytes: None, booleans, numbers, text, bytes, arrays, and tuples of them.

Reading them runs nothing, so they may come from strangers. (A pickle may run anything.)
"""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

import numpy as np

_TREE = "tree"
_ARRAY, _BYTES = "array", "bytes"


class PlainError(ValueError):
    """Bytes that `dumps` did not write, or not these."""


def dumps(value: Any) -> bytes:
    """Write a value; lists become tuples.

    Parameters
    ----------
    value : None, bool, int, float, str, bytes, array of numbers, or a tuple of such values
        Every bit of it is kept.

    Returns
    -------
    bytes
        A numpy ``.npz``: a tree as JSON, and the arrays it refers to.

    Raises
    ------
    TypeError
        For anything else.
    """
    arrays: list[Any] = []

    def refer(kind: str, array: Any) -> dict[str, int]:
        arrays.append(array)
        return {kind: len(arrays) - 1}

    def plain(value: Any) -> Any:
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, bytes):
            return refer(_BYTES, np.frombuffer(value, dtype=np.uint8))
        if isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
            return refer(_ARRAY, value)
        if isinstance(value, tuple | list):
            return [plain(v) for v in value]
        raise TypeError(f"a {type(value).__name__} is no plain value")

    tree = json.dumps(plain(value))
    members = {str(i): array for i, array in enumerate(arrays)}
    members[_TREE] = np.frombuffer(tree.encode(), dtype=np.uint8)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, array in members.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
    return file.getvalue()


def loads(data: bytes) -> Any:
    """Read what `dumps` wrote.

    Raises
    ------
    PlainError
        If it is damaged, or something else.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            # Stored as it is, so nothing unpacks to more than its own size.
            if any(e.compress_type != zipfile.ZIP_STORED for e in archive.infolist()):
                raise PlainError("a part of it is compressed")
            members = {name: archive.read(name) for name in archive.namelist()}  # checks their sums

        def array(name: str) -> Any:
            member = members[f"{name}.npy"]
            # Before memory is taken for it: a few bytes can ask for any amount.
            shape, dtype = _header(member)
            if dtype.kind not in "biufc" or np.prod(shape, dtype=float) * dtype.itemsize > len(
                member
            ):
                raise PlainError("an array in it is larger than the file")
            return np.load(io.BytesIO(member), allow_pickle=False)

        def value(node: Any) -> Any:
            if isinstance(node, list):
                return tuple(value(n) for n in node)
            if isinstance(node, dict):
                ((kind, index),) = node.items()
                found = array(str(int(index)))
                return found.tobytes() if kind == _BYTES else found
            return node

        return value(json.loads(array(_TREE).tobytes()))
    except PlainError:
        raise
    except Exception as error:  # many kinds, all of them meaning this
        raise PlainError(str(error) or type(error).__name__) from error


def _header(member: bytes) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and kind of an array, before it is read."""
    file = io.BytesIO(member)
    version = np.lib.format.read_magic(file)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }[version]
    shape, _, dtype = read(file)
    return shape, dtype
