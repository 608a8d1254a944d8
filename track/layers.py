"""What a rail's fastenings stand on besides slabs: layers in numbers."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

from railcosim.parameters import ParameterError, ParameterSet, Usual, quantity, word

BLOCK, SLEEPER, CONTINUOUS = "block", "sleeper", "continuous"
KINDS = {
    BLOCK: "a mass under every railseat",
    SLEEPER: "a beam across under every pair of railseats",
    CONTINUOUS: "a beam along under each rail",
}
MASS = "mass"  # on a rail, among places that differ: see `local`
NONE = "no source: a file says where its numbers are from"
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, kw_only=True)
class Layer(ParameterSet):
    """A layer between the fastenings and the slab or rigid ground, and what it lies on.

    Masses and stiffnesses are those of one railseat of one rail: half of a sleeper, or a bay of
    what is continuous.
    """

    name: str = word("", "for --set and messages, such as sleeper", source=NONE)
    kind: str = word(
        BLOCK, "; ".join(f"{kind}: {what}" for kind, what in KINDS.items()), source=NONE
    )
    mass: float = quantity(
        150.0, "kg", "of one railseat: half of a sleeper, a bay of what is continuous", above=0,
        usual=Usual(10.0, 5e3, "steel sleepers to bearing layers"), source=NONE,
    )  # fmt: skip
    stiffness: float = quantity(
        7e7, "N/m", "of what it lies on, of one railseat", above=0,
        usual=Usual(1e6, 1e10, "soft mats to rock"), source=NONE,
    )  # fmt: skip
    damping: float = quantity(
        8e4, "N.s/m", "of what it lies on, of one railseat", minimum=0,
        usual=Usual(300.0, 1e7, "soft mats to ballast"), source=NONE,
    )  # fmt: skip
    loss_factor: float = quantity(
        0.0, "1", "hysteretic loss factor of what it lies on", minimum=0, maximum=2,
        usual=Usual(0.01, 2.0, "rubber to ballast"), source=NONE,
    )  # fmt: skip
    bending_stiffness: float = quantity(
        0.0, "N.m2", "EI of a sleeper, 0: it is rigid; of what is continuous, 0: it is limp",
        minimum=0, usual=Usual(1e5, 1e9, "timber sleepers to bearing layers"), source=NONE,
    )  # fmt: skip
    length: float = quantity(
        2.6, "m", "of a sleeper; of no other kind", above=0,
        usual=Usual(1.4, 4.0, "narrow gauge to turnouts"), source=NONE,
    )  # fmt: skip
    unsupported: float = quantity(
        0.0, "m", "of the middle of a sleeper, with nothing below; of no other kind", minimum=0,
        usual=Usual(0.1, 1.5, "a hollow below the middle"), source=NONE,
    )  # fmt: skip

    @property
    def called(self) -> str:
        """Its name, or its kind."""
        return self.name or self.kind


def check_layers(layers: Sequence[Layer], tables: Collection[str], distance: float) -> None:
    """Raise ParameterError if layers cannot lie on each other under rails so far apart, m."""
    names = [layer.name for layer in layers if layer.name]
    taken = (*tables, MASS)
    for layer in layers:
        said = f"[[layers]] {layer.called}"
        if layer.kind not in KINDS:
            raise ParameterError(
                f"{said}: kind = {layer.kind!r}: must be one of {', '.join(KINDS)}"
            )
        if layer.name and (not NAME.fullmatch(layer.name) or layer.name in taken):
            raise ParameterError(
                f"{said}: name = {layer.name!r}: must be letters, digits and _, and none of "
                f"{', '.join(taken)}"
            )
        if names.count(layer.name) > 1:
            raise ParameterError(f"{said}: name = {layer.name!r}: two have it")
        if layer.kind == SLEEPER and not layer.unsupported < layer.length:
            raise ParameterError(
                f"{said}: unsupported = {layer.unsupported:g} m: must be < length = "
                f"{layer.length:g} m"
            )
        if layer.kind == SLEEPER and layer.length <= distance:
            raise ParameterError(
                f"{said}: length = {layer.length:g} m: must be > [rail] lateral_distance = "
                f"{distance:g} m"
            )
    for upper, lower in pairwise(layers):
        if upper.kind == CONTINUOUS != lower.kind:
            raise ParameterError(
                f"[[layers]] {upper.called}: is continuous and lies on {lower.called}, which is "
                "not: list them from the top; below it may be what is continuous, slabs or ground"
            )
        if upper.kind == lower.kind == SLEEPER:
            raise ParameterError(
                f"[[layers]] {upper.called}: a sleeper on a sleeper, {lower.called}: give masses "
                'below sleepers as kind = "block"'
            )
