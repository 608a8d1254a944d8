"""What a linear model does in one step, between what it is fed and what is asked of it.

A scheme asks for outputs at some times of the step, and feeds polynomials over some parts of it.
Both are known by fractions of the step, so they are the same whatever its length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.modal import Modal
from railcosim.master.linear.state_space import ComplexArray, StateSpace

DEGREE = 2
"""Of the polynomials that are fed."""


DIGITS = 12
"""To which times are told apart, in steps."""


class InParts(ValueError):  # noqa: N818 (it says what is wrong)
    """A scheme makes shorter steps of a component that must be seen making whole ones."""


class Asked(NamedTuple):
    """Outputs that a scheme looks at: when, in steps, and whether it is their rates."""

    when: float
    is_rate: bool


class Fed(NamedTuple):
    """Inputs over a part of a step: where it begins, and its length, in steps."""

    begin: float
    length: float

    def until(self, when: float) -> float:
        """From its end until then, in steps; negative if it ends later."""
        return round(when - self.begin - self.length, DIGITS)


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """A model over a step: x' = E x + G S w, f = C x + D w, beside what goes straight through.

    Attributes
    ----------
    All shapes begin with that of the steps.

    E : array, shape (n,) or (n, n)
        What the step does to the states; of modes a factor each, one of each conjugate pair.
    G : array, shape (n, n_s)
        What is fed, as far as states tell one from another.
    S : array, shape (n_s, n_w)
        That by what is fed: for each part value, first and second derivative at its beginning. It
        is the same for all steps.
    C : array, shape (n_f, n)
        What is seen; of modes f is twice the real part, and a real factor counts half.
    D : array, shape (n_f, n_w)
        What is seen within the step of what was fed in it.
    """

    E: ComplexArray
    G: ComplexArray
    S: FloatArray
    C: ComplexArray
    D: FloatArray


def sampled(
    model: Modal | StateSpace, h: float | FloatArray, asked: Sequence[Asked], fed: Sequence[Fed]
) -> Sampled:
    """A model over a step of `h` (s), or over each of several."""
    make = _of_modes if isinstance(model, Modal) else _of_states
    return make(model, np.asarray(h), asked, fed)  # type: ignore[arg-type]


def _of_modes(model: Modal, h: FloatArray, asked: Sequence[Asked], fed: Sequence[Fed]) -> Sampled:
    """Each mode by itself."""
    poles = model.poles
    few, by = model.driven
    S = np.kron(np.eye(DEGREE + 1), by)
    one = {length: few.sampled(length * h)[1] for length in {part.length for part in fed}}

    def after(time: float) -> ComplexArray:
        factor: ComplexArray = np.exp(poles * (time * h)[..., None])
        return factor

    def seen(when: float, is_rate: bool) -> ComplexArray:
        shown: ComplexArray = (model.C * poles if is_rate else model.C) * after(when)[..., None, :]
        return shown

    def answer(a: Asked, part: Fed) -> FloatArray:
        made: FloatArray = 2.0 * (seen(part.until(a.when), a.is_rate) @ one[part.length]).real @ S
        return made

    left = [part.until(1.0) for part in fed]
    G = [
        after(time)[..., None] * one[part.length] if time else one[part.length]
        for part, time in zip(fed, left, strict=True)
    ]
    return Sampled(
        E=after(1.0),
        G=np.concatenate(G, axis=-1),
        S=np.kron(np.eye(len(fed)), S),
        C=np.concatenate([seen(*a) for a in asked], axis=-2),
        D=_answers(answer, asked, fed, (*h.shape, len(model.C), (DEGREE + 1) * model.B.shape[1])),
    )


def _of_states(
    model: StateSpace, h: FloatArray, asked: Sequence[Asked], fed: Sequence[Fed]
) -> Sampled:
    """A few states, all together: they need not have modes."""
    times = {1.0, *(a.when for a in asked), *(part.length for part in fed)}
    if not model.is_divisible and not times <= {0.0, 1.0}:
        raise InParts(
            f"{model.name} is stepped in parts, and each is another rule's than the whole"
        )
    times |= {part.until(when) for part in fed for when in (1.0, *(a.when for a in asked))}
    ordered = sorted(time for time in times if time >= 0.0)
    free, driven = model.over(np.multiply.outer(ordered, h), DEGREE)
    E, one = dict(zip(ordered, free, strict=True)), dict(zip(ordered, driven, strict=True))
    shown = {False: model.C, True: model.C @ model.A}

    def answer(a: Asked, part: Fed) -> FloatArray:
        made: FloatArray = shown[a.is_rate] @ E[part.until(a.when)] @ one[part.length]
        return made

    return Sampled(
        E=E[1.0],
        G=np.concatenate([E[part.until(1.0)] @ one[part.length] for part in fed], axis=-1),
        S=np.eye(len(fed) * (DEGREE + 1) * model.B.shape[1]),
        C=np.concatenate([shown[a.is_rate] @ E[a.when] for a in asked], axis=-2),
        D=_answers(answer, asked, fed, (*h.shape, len(model.C), (DEGREE + 1) * model.B.shape[1])),
    )


def _answers(
    answer: Callable[[Asked, Fed], FloatArray],
    asked: Sequence[Asked],
    fed: Sequence[Fed],
    shape: tuple[int, ...],
) -> FloatArray:
    """`Sampled.D`: nothing is seen of what comes later."""
    nothing = np.zeros(shape)
    return np.block(
        [[answer(a, part) if part.until(a.when) >= 0.0 else nothing for part in fed] for a in asked]
    )
