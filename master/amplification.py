"""What one step of a scheme does to a linear system: its growth, before anything is run.

On linear components a step of any scheme is a linear map of everything that decides the future:
states, past inputs, the scheme's memory. It is found by making the step, from rest with one of
those numbers at a time not zero. The coupling is stable if no eigenvalue is outside the unit
circle.

A component with hundreds of modes is left open: its free motion is given from outside, and what
it is fed is taken note of. The rest is a small map, closed again at any z on a circle by the
component's own sampled transfer function; the eigenvalues outside are counted by the argument
principle, so no resonance is too sharp and no matrix too large.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.modal import Modal, fractions
from railcosim.master.schemes import Scheme
from railcosim.master.state_space import ComplexArray, IndexArray
from railcosim.master.system import System

PROBE = 1e9
"""What the one number is, in its unit: large against every absolute tolerance of a scheme."""
_WARM_UP = 4
"""Steps at rest before the one observed: schemes reach back three at most."""
_TICK = 1e-15
"""Unit of time inside a step, s: times are told apart by whole numbers of it."""
_TURN = 1.0
"""Largest turn of the determinant between points of the circle, rad: half a turn would be lost."""
_NEAR = 1e-4
"""Of the distance between points, for a derivative by a difference."""
_ROUNDS = 60
"""Halvings between points: then their distance is rounding, and a root is on the circle."""


class NotLinear(ValueError):  # noqa: N818 (it says what is wrong)
    """A scheme whose step is no linear map; the message says why."""


class Open(Component):
    """A component whose free motion is given from outside.

    Attributes
    ----------
    free : dict of (int, bool) to array, shape (n_outputs,)
        The outputs, or their rates if True, if nothing were fed; by time after the beginning of
        the step, in ticks. These are what a scheme has asked for so far.
    fed : tuple of (int, float, array)
        Beginning in ticks and length (s) of each step made, and value and derivatives of the
        inputs then, shape (3, n_inputs).
    """

    can_rollback = True
    max_input_derivative = 2

    def __init__(
        self,
        name: str,
        inputs: Sequence[Variable],
        outputs: Sequence[Variable],
        model: Modal | None = None,
    ) -> None:
        super().__init__(name, inputs, outputs)
        self.model = model
        self.free: dict[tuple[int, bool], FloatArray] = {}
        self.fed: tuple[tuple[int, float, FloatArray], ...] = ()
        self._now = 0
        self._inputs = self.u.copy()
        self._derivatives: FloatArray = np.zeros((2, len(self.inputs)))
        self._answers: dict[tuple[int, float, bool], FloatArray] = {}

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Whether an output depends at once on an input, shape (n_outputs, n_inputs)."""
        if self.model is None:
            return np.ones((len(self.outputs), 0), dtype=bool)
        through: NDArray[np.bool_] = self.model.D != 0.0
        return through

    def begin(self) -> None:
        """Forget the steps made: the free motion is counted from now on."""
        self._now, self.fed = 0, ()

    def write_inputs(self) -> None:
        """Make `u` the inputs at the present time."""
        self._inputs = self.u.copy()

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Give derivatives of the inputs for the next step; see `Component`."""
        self._derivatives = np.zeros((2, len(self.inputs)))
        self._derivatives[: len(derivatives)] = derivatives

    def do_step(self, t: float, h: float) -> None:
        """Take note of the step."""
        taylor = np.concatenate([self._inputs[None], self._derivatives])
        self.fed = (*self.fed, (self._now, h, taylor))
        self._derivatives = np.zeros((2, len(self.inputs)))
        self._now += round(h / _TICK)

    def read_outputs(self) -> None:
        """Put the free motion and the answer to what was fed into `y`."""
        self.y[:] = self._observed(is_rate=False)
        if self.model is not None:
            self.y += self.model.D @ self._inputs

    def output_rates(self) -> FloatArray | None:
        """Rates of the outputs at the present time; see `Component`."""
        if self.model is None:
            return None
        rates = self._observed(is_rate=True)
        rates += 2.0 * (self.model.C @ self.model.B).real @ self._inputs
        rates += self.model.D @ self._derivatives[0]
        return rates

    def step_derivative(self) -> FloatArray | None:
        """Change of the outputs per change of an input held over the last step."""
        if self.model is None or not self.fed:
            return None
        return self._answer(0, self.fed[-1][1], is_rate=False)[:, : len(self.inputs)] + self.model.D

    def save_state(self) -> Any:
        """Snapshot; what was fed in this step is not memory, so it is wrapped up."""
        return _Wrapped((self._now, self.fed)), self._inputs, self._derivatives

    def restore_state(self, state: Any) -> None:
        """Go back to a snapshot."""
        wrapped, self._inputs, self._derivatives = state
        self._now, self.fed = wrapped.content

    def loop(self, h: float, z: ComplexArray, fed: Sequence[tuple[int, float]]) -> ComplexArray:
        """Free motion at the times asked for, by what was fed: (n_z, all outputs, all inputs)."""
        assert self.model is not None
        model, poles = self.model, self.model.poles
        C = np.concatenate([self._seen(*asked) for asked in self.free])
        G = np.concatenate(
            [
                np.exp(poles * (h - begin * _TICK - length))[:, None] * model.sampled(length)[1]
                for begin, length in fed
            ],
            axis=1,
        )
        return fractions(z, np.exp(poles * h), G, C)

    def _observed(self, *, is_rate: bool) -> FloatArray:
        """Outputs or their rates now, without what the present inputs add."""
        asked = self._now, is_rate
        total = self.free.setdefault(asked, np.zeros(len(self.outputs))).copy()
        if self.model is not None:
            for begin, h, taylor in self.fed:
                after = self._now - begin - round(h / _TICK)
                total += self._answer(after, h, is_rate=is_rate) @ taylor.ravel()
        return total

    def _answer(self, after: int, h: float, *, is_rate: bool) -> FloatArray:
        """Outputs some ticks after a step of length `h`, by value and derivatives of the inputs."""
        assert self.model is not None
        key = after, h, is_rate
        if key not in self._answers:
            self._answers[key] = 2.0 * (self._seen(after, is_rate) @ self.model.sampled(h)[1]).real
        return self._answers[key]

    def _seen(self, tick: int, is_rate: bool) -> ComplexArray:
        """What the modes at the beginning do to the outputs, or their rates, at a time."""
        assert self.model is not None
        model = self.model
        seen: ComplexArray = model.C * np.exp(model.poles * (tick * _TICK))
        return seen * model.poles if is_rate else seen


Column: TypeAlias = tuple[FloatArray, FloatArray]
"""Memory after a step, and what was fed in it, by one number before it."""


@dataclass(frozen=True)
class _Wrapped:
    """Something in a snapshot that is not memory."""

    content: Any


@dataclass(frozen=True)
class Amplification:
    """One step as a map of the memory m, the free motions f and what is fed w.

    m' = N m + R f, w = Q m + P f, and back from w to f by the open components; the signals g add
    W g to m' and V g to w.

    Attributes
    ----------
    h : float
        The step, s.
    N, R, Q, P, W, V : array
        The maps.
    poles : array of complex
        Eigenvalues of the open components over the step.
    loop : callable
        From z (n_z,) to what w brings back as f, shape (n_z, n_f, n_w).
    signals : array, shape (n_g,)
        Times of the signals in the step, s.
    outputs : array of int
        Where in m the system's outputs are.
    """

    h: float
    N: FloatArray
    R: FloatArray
    Q: FloatArray
    P: FloatArray
    W: FloatArray
    V: FloatArray
    poles: ComplexArray
    loop: Callable[[ComplexArray], ComplexArray]
    signals: FloatArray
    outputs: IndexArray

    def spectral_radius(self) -> float:
        """Largest eigenvalue of the map, if nothing is left open: growth a step."""
        if self.poles.size:
            raise ValueError("a component is left open: count the growing motions instead")
        return float(np.abs(np.linalg.eigvals(self.N)).max(initial=0.0))

    def growing(self, rate: float = 0.0) -> int:
        """Count the motions that grow faster than exp(rate t).

        Parameters
        ----------
        rate : float
            In 1/s.
        """
        radius = math.exp(rate * self.h)
        # Forces and motions differ by the stiffness: balanced, slow motions keep their digits.
        balanced, _, _, scale, _ = scipy.linalg.lapack.dgebal(self.N, scale=1, permute=0)
        T, U = scipy.linalg.schur(balanced, output="complex")
        own = np.diag(T)
        outside = int((np.abs(own) > radius).sum())
        if not self.Q.size or not self.poles.size:
            return outside
        inputs, outputs = U.conj().T @ (self.R / scale[:, None]), (self.Q * scale) @ U

        def turn(phi: FloatArray) -> ComplexArray:
            z = radius * np.exp(1j * phi)
            H = outputs @ _solve_triangular(T, inputs, z) + self.P
            matrix = np.eye(len(self.Q)) - H @ self.loop(z)
            sign, size = np.linalg.slogdet(matrix)
            return np.asarray(size + 1j * np.angle(sign))

        # det(z - everything) = det(z - N) det(z - open modes) turn(z), and turn is 1 at infinity:
        # so it has as many more zeros than poles outside as it turns backwards around the circle.
        return outside - _windings(turn, np.concatenate([own, self.poles]))

    def response(
        self, omega: FloatArray, signal: ComplexArray, outputs: Sequence[int]
    ) -> ComplexArray:
        """Outputs at communication points while the signals are exp(i omega t) times `signal`.

        Parameters
        ----------
        omega : array, shape (n_omega,)
            rad/s.
        signal : array of complex, shape (n_omega, n_signal)
            Amplitudes.
        outputs : sequence of int
            Which of the system's outputs.

        Returns
        -------
        array of complex, shape (n_omega, len(outputs))
        """
        z = np.exp(1j * omega * self.h)
        shifted = np.exp(1j * omega[:, None] * self.signals)
        g = (shifted[:, :, None] * signal[:, None, :]).reshape(len(z), -1)
        zN = z[:, None, None] * np.eye(len(self.N)) - self.N
        inner = np.linalg.solve(
            zN, np.concatenate([np.broadcast_to(self.R, (len(z), *self.R.shape)),
                                (g @ self.W.T)[:, :, None]], axis=2)
        )  # fmt: skip
        free, driven = inner[:, :, :-1], inner[:, :, -1]
        loop = self.loop(z)
        w = np.linalg.solve(
            np.eye(len(self.Q)) - (self.Q @ free + self.P) @ loop,
            (driven @ self.Q.T + g @ self.V.T)[:, :, None],
        )
        m = (free @ (loop @ w))[:, :, 0] + driven
        asked: ComplexArray = m[:, self.outputs[list(outputs)]]
        return asked


class Amplifier:
    """Finds what a step does; made once for a scheme and a system, asked for many steps.

    Parameters
    ----------
    system : System
        Of linear components at rest: `LinearComponent`, `Law` of a linear law, `Open`.
    scheme : Scheme
        Which to observe.

    Attributes
    ----------
    system
        As given.
    evaluations : int
        How often each component was stepped in a step, at the most, so far.
    """

    def __init__(self, system: System, scheme: Scheme) -> None:
        self.system = system
        self.evaluations = 0
        self._scheme = scheme
        self._rest = system.save_state()
        self._used: IndexArray | None = None

    def at(self, h: float) -> Amplification:
        """Observe a step of length `h` (s).

        Raises
        ------
        NotLinear
            If the scheme's memory changes its form.
        Exception
            Whatever the scheme raises if it cannot make the step.
        """
        self.system.restore_state(self._rest)
        step = _ObservedStep(self.system, self._scheme, h)
        places = step.memory if self._used is None else self._used
        columns = [step.by_memory(k) for k in places]
        N, Q = _stacked(columns, step)
        # What is never seen in an output is no memory: it need not be tried at other steps.
        self._used = places[_seen(N, Q, places, step.outputs)]
        kept = np.union1d(self._used, step.outputs)
        N, Q = (_spread(part, places, kept) for part in (N, Q))
        models = [c for c in step.opened if c.model is not None]
        signals = [c for c in step.opened if c.model is None]
        R, P = _stacked([column for c in models for column in step.by_free_motion(c)], step)
        W, V = _stacked([column for c in signals for column in step.by_free_motion(c)], step)
        heard = (Q != 0).any(1) | (P != 0).any(1) | (V != 0).any(1)
        self.evaluations = max(self.evaluations, step.evaluations)
        poles = [np.exp(c.model.poles * h) for c in models if c.model is not None]
        return Amplification(
            h=h, N=N[kept], R=R[kept], Q=Q[heard], P=P[heard], W=W[kept], V=V[heard],
            poles=np.concatenate([np.zeros(0, complex), *poles]),
            loop=_Loop(h, [(c, step.when[c.name]) for c in models], heard),
            signals=_TICK * np.array([tick for c in signals for tick, _ in c.free]),
            outputs=np.searchsorted(kept, step.outputs),
        )  # fmt: skip


class _ObservedStep:
    """One step of a scheme on a system at rest, made again and again from other memories.

    Attributes
    ----------
    memory : array of int
        Places of the numbers that may decide the future.
    outputs : array of int
        Places of the system's outputs.
    when : dict of str to list
        By component: beginning (ticks) and length (s) of the steps it makes.
    """

    def __init__(self, system: System, scheme: Scheme, h: float) -> None:
        self._system, self._scheme, self._h = system, scheme, h
        self.opened = [c for c in system.components if isinstance(c, Open)]
        self.evaluations = 0
        for component in self.opened:
            component.free.clear()
            component.begin()
        self._stepper = scheme.start(system)
        system.begin(0.0)
        for k in range(_WARM_UP):
            self._stepper.step(k * h, h)
            for component in self.opened:
                component.begin()
        self._rest = system.save_state(), self._stepper.memory
        self._arrays = list(_arrays(self._rest))
        self._sizes = [a.size for a in self._arrays]
        self._offset = np.concatenate([[0], np.cumsum(self._sizes)])
        # What is not zero at rest is no motion but a setting, such as a compliance.
        moves = np.repeat([not a.any() for a in self._arrays], self._sizes)
        self.memory = np.flatnonzero(moves)
        own = next(i for i, a in enumerate(self._arrays) if a is self._rest[0][2])
        self.outputs = np.arange(self._offset[own], self._offset[own + 1])
        self._make(self._arrays)  # so that all times asked for are known
        self.when = {c.name: [(begin, length) for begin, length, _ in c.fed] for c in self.opened}
        self.n_fed = sum(3 * len(c.inputs) * len(c.fed) for c in self.opened)
        self.size = int(self._offset[-1])

    def by_memory(self, k: int) -> Column:
        """What one number of the memory does to all of it, and to what is fed."""
        i = int(np.searchsorted(self._offset, k, side="right")) - 1
        changed = self._arrays[i].copy()
        changed.flat[k - self._offset[i]] = PROBE
        return self._make([*self._arrays[:i], changed, *self._arrays[i + 1 :]])

    def by_free_motion(self, component: Open) -> list[Column]:
        """What the free motion of one component does, an output and time after the other."""
        columns = []
        for values in component.free.values():
            for j in range(values.size):
                values[j] = PROBE
                columns.append(self._make(self._arrays))
                values[j] = 0.0
        return columns

    def _make(self, arrays: list[FloatArray]) -> Column:
        """Make the step."""
        state, memory = _rebuilt(self._rest, iter(arrays))
        self._system.restore_state(state)
        self._stepper.memory = memory
        report = self._stepper.step(_WARM_UP * self._h, self._h)
        self.evaluations = max(self.evaluations, report.evaluations)
        after = list(_arrays((self._system.save_state(), self._stepper.memory)))
        if [a.size for a in after] != self._sizes:
            raise NotLinear(f"{self._scheme.describe()}: its memory changes its form")
        fed = [taylor.ravel() for c in self.opened for _, _, taylor in c.fed]
        return (
            np.concatenate([a.ravel() for a in after]) / PROBE,
            np.concatenate([np.zeros(0), *fed]) / PROBE,
        )


@dataclass(frozen=True)
class _Loop:
    """From z to what the open components make of what is fed; see `Amplification.loop`."""

    h: float
    parts: list[tuple[Open, list[tuple[int, float]]]]
    heard: NDArray[np.bool_]

    def __call__(self, z: ComplexArray) -> ComplexArray:
        blocks = [component.loop(self.h, z, when) for component, when in self.parts]
        shape = sum(b.shape[1] for b in blocks), sum(b.shape[2] for b in blocks)
        whole: ComplexArray = np.zeros((len(z), *shape), dtype=complex)
        i = j = 0
        for block in blocks:
            whole[:, i : i + block.shape[1], j : j + block.shape[2]] = block
            i, j = i + block.shape[1], j + block.shape[2]
        return whole[:, :, self.heard]


def _stacked(columns: list[Column], step: _ObservedStep) -> tuple[FloatArray, FloatArray]:
    """Columns side by side: what they do to the memory, and to what is fed."""
    one, two = np.zeros((step.size, len(columns))), np.zeros((step.n_fed, len(columns)))
    for k, (memory, fed) in enumerate(columns):
        one[:, k], two[:, k] = memory, fed
    return one, two


def _seen(N: FloatArray, Q: FloatArray, places: IndexArray, outputs: IndexArray) -> Any:
    """Which columns, numbers of the memory at `places`, show in outputs or in what is fed, ever."""
    influence = N != 0
    seen = influence[outputs].any(axis=0) | (Q != 0).any(axis=0)
    while True:
        more = seen | influence[places[seen]].any(axis=0)
        if (more == seen).all():
            return seen
        seen = more


def _spread(part: FloatArray, places: IndexArray, kept: IndexArray) -> FloatArray:
    """Columns for `kept`, zero where they are not among `places`."""
    wide = np.zeros((len(part), len(kept)))
    _, here, there = np.intersect1d(kept, places, return_indices=True)
    wide[:, here] = part[:, there]
    return wide


def _arrays(state: Any) -> Iterator[FloatArray]:
    """Arrays of numbers in nested tuples and lists."""
    if isinstance(state, np.ndarray) and state.dtype == np.float64:
        yield state
    elif isinstance(state, tuple | list):
        for part in state:
            yield from _arrays(part)


def _rebuilt(state: Any, arrays: Iterator[FloatArray]) -> Any:
    """The same nest with other arrays."""
    if isinstance(state, np.ndarray) and state.dtype == np.float64:
        return next(arrays)
    if isinstance(state, tuple | list):
        parts = [_rebuilt(part, arrays) for part in state]
        return type(state)(*parts) if hasattr(state, "_fields") else type(state)(parts)
    return state


def _solve_triangular(T: ComplexArray, B: ComplexArray, z: ComplexArray) -> ComplexArray:
    """(z - T)^-1 B for every z, shape (n_z, n, n_columns)."""
    n, m = B.shape
    x = np.zeros((n, len(z), m), dtype=complex)
    for i in range(n)[::-1]:
        known = (T[i, i + 1 :] @ x[i + 1 :].reshape(n - 1 - i, len(z) * m)).reshape(len(z), m)
        x[i] = (known + B[i]) / (z - T[i, i])[:, None]
    return x.transpose(1, 0, 2)


def _windings(turn: Callable[[FloatArray], ComplexArray], poles: ComplexArray) -> int:
    """How often a function, real on the real axis, turns around zero along the circle.

    `turn` gives its logarithm, with any multiple of 2 pi i.
    """
    # It turns fast near its poles: one point opposite to each.
    opposite = np.abs(np.angle(poles))
    phi = np.unique(np.concatenate([[0.0, math.pi], opposite]))
    value, slope = _with_slope(turn, phi)
    for _ in range(_ROUNDS):
        # Roots and poles come in clusters, one for each wheel, and may turn it fully between two
        # points. But they are seen in the slope from as far as they are many times over.
        length = np.diff(phi)
        fast = length * np.maximum(np.abs(slope[1:]), np.abs(slope[:-1])) > _TURN
        wide = np.flatnonzero(fast | (np.abs(_difference(value).imag) > _TURN))
        if not wide.size:
            break
        middle = phi[wide] + 0.5 * length[wide]
        new = _with_slope(turn, middle, 0.5 * length[wide])
        phi, value, slope = (
            np.insert(old, wide + 1, more)
            for old, more in zip((phi, value, slope), (middle, *new), strict=True)
        )
    total = float(_difference(value).imag.sum())
    return round(total / math.pi)  # the lower half turns as much as the upper one


def _with_slope(
    turn: Callable[[FloatArray], ComplexArray], phi: FloatArray, room: FloatArray | None = None
) -> tuple[ComplexArray, ComplexArray]:
    """A logarithm and its derivative, from a difference that is short against the room there is."""
    if room is None:
        room = np.diff(phi, append=2.0 * phi[-1] - phi[-2])
    step = _NEAR * room
    both = turn(np.concatenate([phi, phi + step]))
    value, ahead = both[: len(phi)], both[len(phi) :]
    return value, _difference(np.stack([value, ahead]))[0] / step


def _difference(logarithm: ComplexArray) -> ComplexArray:
    """Of neighbours, the imaginary part within half a turn."""
    change = np.diff(logarithm, axis=0)
    turned: ComplexArray = change.real + 1j * np.angle(np.exp(1j * change.imag))
    return turned
