"""Two components, each known by its frequency response, joined by springs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import FrequencyResponse


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A spring between two components, or between one and the ground.

    Its force ``stiffness * (first_output - second_output - gap)`` is the same number at the inputs
    of both components; their own signs make it a push on one and a counter-push on the other.

    Attributes
    ----------
    name : str
        The coupled response calls the force ``name.force`` and the irregularity ``name.gap``.
    first_input, first_output : str
        Force and displacement of the first component.
    second_input, second_output : str
        Of the second component; unused if there is none.
    stiffness : float
        In N/m, positive; infinite for a rigid joint.
    """

    name: str
    first_input: str
    first_output: str
    second_input: str = ""
    second_output: str = ""
    stiffness: float

    def __post_init__(self) -> None:
        if not self.stiffness > 0.0:
            raise ValueError(f"joint {self.name}: stiffness is {self.stiffness}, must be positive")


def couple(
    first: FrequencyResponse, second: FrequencyResponse | None, joints: Sequence[Joint]
) -> FrequencyResponse:
    """Join two free components by springs, frequency by frequency.

    Parameters
    ----------
    first : FrequencyResponse
        A free component, for instance a vehicle without contact.
    second : FrequencyResponse or None
        The other one, at the same frequencies; None for the ground (a rigid track).
    joints : sequence of Joint
        At most one at an input.

    Returns
    -------
    FrequencyResponse
        Outputs and inputs are those of both components, as ``component.variable``, the outputs
        ``joint.force`` (N) and the inputs ``joint.gap`` (m).

    Raises
    ------
    ValueError
        If a name is unknown or comes twice, or the frequencies differ.

    Notes
    -----
    With the receptances `H1` and `H2` between the joints, as the components have their signs
    (a vehicle lifted by a positive contact force has a negative one), the forces follow from

        (1/k - H1 + H2) f = z1 - z2 - gap

    with the motions of the free components. Flexibilities are added, not stiffnesses, so stiff
    joints do no harm. A force at a joint's own input is not superposed on the joint's force, from
    which it may differ in the fifth digit where the component is free to move: their sum is
    solved for instead. See [1]_ for the method.

    References
    ----------
    .. [1] D. de Klerk, D. J. Rixen, S. N. Voormeeren, General framework for dynamic substructuring,
       AIAA Journal 46 (2008) 1169-1181. https://doi.org/10.2514/1.33274
    """
    if second is None:
        return _grounded(first, joints)
    H1, H2 = first.values, second.values
    in1 = first.columns(joint.first_input for joint in joints)
    in2 = second.columns(joint.second_input for joint in joints)
    motion1 = H1[:, first.rows(joint.first_output for joint in joints)]
    motion2 = H2[:, second.rows(joint.second_output for joint in joints)]
    names = [joint.name for joint in joints]
    outputs = (*_labels(first.name, first.outputs), *_labels(second.name, second.outputs))
    inputs = (*_labels(first.name, first.inputs), *_labels(second.name, second.inputs))
    for labels in (in1, in2, names, outputs, inputs):
        if len(set(labels)) < len(labels):
            raise ValueError(f"{first.name}+{second.name}: not all different: {labels}")
    if not np.array_equal(first.omega, second.omega):
        raise ValueError(f"{first.name} and {second.name} are given at different frequencies")

    flexibility = np.diag([1.0 / joint.stiffness for joint in joints])
    against1 = flexibility + motion2[:, :, in2]  # what the first component leans on
    against2 = flexibility - motion1[:, :, in1]
    gap = np.broadcast_to(np.eye(len(joints)), against1.shape)
    loads = np.concatenate([motion1, -motion2, -gap, against1, against2], axis=2)
    solved = np.linalg.solve(against1 - motion1[:, :, in1], loads)
    ends = np.cumsum([len(inputs) + len(joints), len(joints)])
    force, sum1, sum2 = np.split(solved, ends, axis=2)
    return FrequencyResponse(
        name=f"{first.name}+{second.name}",
        omega=first.omega,
        outputs=(*outputs, *_labels("force", names, after=True)),
        inputs=(*inputs, *_labels("gap", names, after=True)),
        values=np.concatenate(
            [
                _loaded(H1, in1, force, sum1, begin=0),
                _loaded(H2, in2, force, sum2, begin=len(first.inputs)),
                force,
            ],
            axis=1,
        ),
    )


def _loaded(
    H: ComplexArray, joined: list[int], force: ComplexArray, total: ComplexArray, begin: int
) -> ComplexArray:
    """Responses of a component, whose inputs begin at column `begin`, with its joints' forces.

    `force` has the joint forces for each column, `total` those and the unit force beside them for
    each joined input.
    """
    loads = force.copy()
    loads[:, :, [begin + column for column in joined]] = total
    response: ComplexArray = H[:, :, joined] @ loads
    free = np.setdiff1d(np.arange(H.shape[2]), joined)
    response[:, :, begin + free] += H[:, :, free]
    return response


def _grounded(first: FrequencyResponse, joints: Sequence[Joint]) -> FrequencyResponse:
    """Join a component to the ground: to one that does not move, which is then left out."""
    ground = FrequencyResponse(
        name="ground",
        omega=first.omega,
        outputs=("rest",),
        inputs=tuple(joint.name for joint in joints),
        values=np.zeros((len(first.omega), 1, len(joints)), dtype=complex),
    )
    tied = [replace(joint, second_input=joint.name, second_output="rest") for joint in joints]
    coupled = couple(first, ground, tied)
    rows = [i for i, name in enumerate(coupled.outputs) if name != "ground.rest"]
    unmoved = set(_labels("ground", ground.inputs))
    columns = [i for i, name in enumerate(coupled.inputs) if name not in unmoved]
    return FrequencyResponse(
        name=coupled.name,
        omega=coupled.omega,
        outputs=tuple(coupled.outputs[row] for row in rows),
        inputs=tuple(coupled.inputs[column] for column in columns),
        values=coupled.values[:, rows][:, :, columns],
    )


def _labels(word: str, names: Iterable[str], after: bool = False) -> list[str]:
    """``word.name`` for each name, or ``name.word``."""
    return [f"{name}.{word}" if after else f"{word}.{name}" for name in names]
