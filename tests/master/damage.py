"""Damage to XML files: to their elements, or to their bytes."""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

VALUES = (
    "", " ", "0", "-1", "1", "2", "1.5", "1e400", "-1e400", "nan", "inf", "99999999999999999999",
    "4294967295", "true", "false", "True", "1 2 3", "1 x", "\u00e9\u00df", "\u2603",
    "a.b", "..", "../../outside",
    "/etc/passwd", "file:///etc/passwd", "http://localhost/x", "%2e%2e/x", "a" * 5000, "\n", "[1]",
    "resources/P.fmu", "resources/none.fmu", "#x", "input", "output", "parameter", "local",
    "independent", "discrete", "constant", "exact", "Real", "u", "x", "k", "a", "b", "inner",
)  # fmt: skip
"""What attributes become."""


def damaged(text: bytes, chance: random.Random) -> bytes:
    """An XML file with a few changes of its elements, or of its bytes."""
    if chance.random() < 0.25:
        return bytes_changed(text, chance)
    root = ElementTree.fromstring(text)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 8))):
        chance.choice(CHANGES)(root, chance)
    with _deep():
        return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)


@contextmanager
def _deep() -> Iterator[None]:
    """Writing goes down with the elements, of which some are a thousand deep; reading does not."""
    most = sys.getrecursionlimit()
    sys.setrecursionlimit(100 * most)
    try:
        yield
    finally:
        sys.setrecursionlimit(most)


def _pairs(root: Element) -> list[tuple[Element, Element]]:
    return [(parent, child) for parent in root.iter() for child in parent]


def _drop(root: Element, chance: random.Random) -> None:
    if pairs := _pairs(root):
        parent, child = chance.choice(pairs)
        parent.remove(child)


def _repeat(root: Element, chance: random.Random) -> None:
    if pairs := _pairs(root):
        parent, child = chance.choice(pairs)
        parent.insert(chance.randrange(len(parent) + 1), child)


def _move(root: Element, chance: random.Random) -> None:
    if pairs := _pairs(root):
        parent, child = chance.choice(pairs)
        inside = set(child.iter())
        others = [e for e in root.iter() if e not in inside]
        parent.remove(child)
        chance.choice(others).append(child)


def _nest(root: Element, chance: random.Random) -> None:
    """An element in itself, again and again."""
    if pairs := _pairs(root):
        _, child = chance.choice(pairs)
        for _ in range(chance.choice((2, 60, 500))):
            child.append(Element(child.tag, dict(child.attrib)))
            child = child[-1]


def _rename(root: Element, chance: random.Random) -> None:
    elements = list(root.iter())
    chance.choice(elements).tag = chance.choice([*(e.tag for e in elements), "x", "Real"])


def _attribute(root: Element, chance: random.Random) -> None:
    elements = [e for e in root.iter() if e.attrib]
    if elements:
        element = chance.choice(elements)
        name = chance.choice(list(element.attrib))
        others = [v for e in elements for v in e.attrib.values()]
        element.set(name, chance.choice([chance.choice(VALUES), chance.choice(others)]))


def _attribute_gone(root: Element, chance: random.Random) -> None:
    if elements := [e for e in root.iter() if e.attrib]:
        element = chance.choice(elements)
        del element.attrib[chance.choice(list(element.attrib))]


def _attribute_more(root: Element, chance: random.Random) -> None:
    elements = list(root.iter())
    names = sorted({n for e in elements for n in e.attrib}) or ["name"]
    chance.choice(elements).set(chance.choice(names), chance.choice(VALUES))


CHANGES = (
    _drop, _repeat, _move, _nest, _rename, _attribute, _attribute, _attribute, _attribute,
    _attribute_gone, _attribute_more,
)  # fmt: skip


def bytes_changed(text: bytes, chance: random.Random) -> bytes:
    data = bytearray(text)
    i, j = sorted(chance.randrange(len(data)) for _ in range(2))
    match chance.randrange(7):
        case 0:
            data[i] = chance.randrange(256)
        case 1:
            del data[i:j]
        case 2:
            data[i:i] = data[i:j]
        case 3:
            del data[i:]
        case 4:
            data[i:i] = bytes(chance.randrange(256) for _ in range(8))
        case 5:
            kind = b'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>'
            data = bytearray(text.replace(b"?>", b"?>" + kind, 1))
        case _:
            data = bytearray(
                text.decode("utf-8", "replace").encode(chance.choice(("utf-16", "utf-7")))
            )
    return bytes(data)
