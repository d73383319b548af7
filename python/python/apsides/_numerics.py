"""Nonlinear programs and integration of ordinary functions, which are traced once for exact derivatives."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._functions import count, is_number
from ._native import Condition, Symbol
from ._numpy import symbol_array

_owners = itertools.count(1 << 40)


def _vector(values: Any, what: str) -> np.ndarray:
    try:
        found = np.atleast_1d(np.asarray(values, dtype=float))
    except (TypeError, ValueError):
        raise _native.Error(f"{what} is a list of numbers") from None
    if found.ndim != 1:
        raise _native.Error(f"{what} has the shape {found.shape}, allowed is a list of numbers")
    return found


def _arguments(owner: int, names: list[str]) -> np.ndarray:
    return symbol_array(_native.arguments(owner, names))


def _symbols(values: Any, what: str) -> list[Any]:
    """A formula, or a list or array of them, as symbols."""
    flat = [values] if isinstance(values, (Symbol, Condition)) or is_number(values) else list(np.asarray(values, dtype=object).ravel())
    for value in flat:
        if not isinstance(value, (Symbol, Condition)) and not is_number(value):
            raise _native.Error(f"{what} returns a value of type {type(value).__name__}, allowed are numbers and formulas of its arguments")
    return flat


def _symbol(value: Any, zero: Symbol) -> Symbol:
    """A number is a formula, too."""
    return value if isinstance(value, Symbol) else 0.0 * zero + float(value)


@dataclass
class Minimum:
    """What `minimize` returns, with the names of SciPy's."""

    #: The point, shape (n,).
    x: np.ndarray
    #: The objective there.
    fun: float
    #: True of an optimum.
    success: bool
    #: ``"optimal"``, ``"acceptable"``, ``"infeasible"``, ..
    status: str
    #: The status in words.
    message: str
    #: Values of the constraints, shape (m,).
    constraint_values: np.ndarray
    #: Multipliers of the constraints: positive at an upper, negative at a lower bound; shape (m,).
    multipliers: np.ndarray
    #: Multipliers of the lower bounds of the variables, not negative; shape (n,).
    lower_multipliers: np.ndarray
    #: Multipliers of the upper bounds of the variables, not negative; shape (n,).
    upper_multipliers: np.ndarray
    #: Iterations.
    nit: int


def _bounds(bounds: Any, n: int) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    if bounds is None:
        return lower, upper
    if hasattr(bounds, "lb") and hasattr(bounds, "ub"):
        pairs: Any = list(zip(np.broadcast_to(bounds.lb, n), np.broadcast_to(bounds.ub, n)))
    else:
        pairs = list(bounds)
        if len(pairs) == 2 and n != 2 and all(v is None or is_number(v) for v in pairs):
            pairs = [tuple(pairs)] * n
    if len(pairs) != n:
        raise _native.Error(f"`bounds` has {len(pairs)} pairs for {n} variables")
    for k, pair in enumerate(pairs):
        try:
            low, high = pair
        except TypeError:
            raise _native.Error(f"`bounds` has a pair (least, most) for each variable; that of variable {k} is {pair!r}") from None
        lower[k] = -np.inf if low is None else float(low)
        upper[k] = np.inf if high is None else float(high)
        if not lower[k] <= upper[k]:
            raise _native.Error(f"the bounds of variable {k} are [{lower[k]}, {upper[k]}]: the smaller one stands first")
    return lower, upper


def _constraints(constraints: Any, x: np.ndarray) -> list[tuple[Symbol, float, float]]:
    if constraints is None:
        return []
    if isinstance(constraints, (Mapping, tuple)) or callable(constraints) or hasattr(constraints, "fun"):
        constraints = [constraints]
    found: list[tuple[Symbol, float, float]] = []
    for k, constraint in enumerate(constraints):
        what = f"constraint {k}"
        if isinstance(constraint, Mapping):
            kind = constraint.get("type")
            if kind not in ("eq", "ineq") or not callable(constraint.get("fun")):
                raise _native.Error(f"{what}: a dictionary has `type`, \"eq\" or \"ineq\", and `fun`, a function")
            function, low, high = constraint["fun"], 0.0, 0.0 if kind == "eq" else np.inf
        elif hasattr(constraint, "fun"):
            function, low, high = constraint.fun, constraint.lb, constraint.ub
        elif isinstance(constraint, tuple) and len(constraint) == 3:
            function, low, high = constraint
        elif callable(constraint):
            function, low, high = constraint, None, None
        else:
            raise _native.Error(f"{what}: allowed is (function, lower, upper), a function that returns comparisons, or a dictionary as of SciPy")
        values = _symbols(function(x), what)
        if not values:
            continue
        lows, highs = (np.broadcast_to(np.asarray(-np.inf if v is None and not isinstance(values[0], Condition) else v, dtype=object), len(values))
                       for v in (low, np.inf if high is None else high))
        for value, least, most in zip(values, lows, highs):
            if isinstance(value, Condition):
                found.append(_native.bounded(value))
            elif low is None and high is None:
                raise _native.Error(f"{what} has no bounds: return comparisons (`x[0] + x[1] <= 1`), or give (function, lower, upper)")
            else:
                least, most = float(least), np.inf if most is None else float(most)
                if not least <= most:
                    raise _native.Error(f"the bounds of {what} are [{least}, {most}]: the smaller one stands first")
                found.append((_symbol(value, x[0]), least, most))
    return found


def minimize(
    fun: Callable[..., Any],
    x0: ArrayLike,
    *,
    bounds: Any = None,
    constraints: Any = None,
    args: tuple[Any, ...] = (),
    tolerance: float | None = None,
    max_iterations: int | None = None,
    progress: Callable[[dict[str, float]], Any] | None = None,
) -> Minimum:
    """Minimises a function of several variables with constraints by an interior-point method with exact first and second derivatives.

    ``fun(x, *args)`` and the constraints are called once, with an array of symbols of shape (n,), and traced.

    Parameters
    ----------
    x0 : where the solve begins, shape (n,)
    bounds : a pair (least, most) for each variable, one pair for all, or ``scipy.optimize.Bounds``
    constraints : a list of ``(function, lower, upper)``, of functions that return comparisons, or of dictionaries as of SciPy

    >>> import apsides
    >>> found = apsides.minimize(
    ...     lambda x: x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
    ...     [1, 5, 5, 1],
    ...     bounds=[(1, 5)] * 4,
    ...     constraints=lambda x: [x[0] * x[1] * x[2] * x[3] >= 25, (x * x).sum() == 40],
    ... )
    >>> round(found.fun, 6)
    17.014017
    """
    start = _vector(x0, "`x0`")
    if start.size == 0:
        raise _native.Error("`x0` has no elements: there is nothing to choose")
    owner = next(_owners)
    x = _arguments(owner, [f"x[{k}]" for k in range(start.size)])
    objective = _symbols(fun(x, *args), "the objective")
    if len(objective) != 1 or isinstance(objective[0], Condition):
        raise _native.Error(f"the objective returns {len(objective)} values, allowed is one formula")
    if max_iterations is not None:
        max_iterations = count(max_iterations, "max_iterations", 1)
    lower, upper = _bounds(bounds, start.size)
    rows = _constraints(constraints, x)
    found = _native.minimize(
        owner, _symbol(objective[0], x[0]), rows, start.tolist(), lower.tolist(), upper.tolist(), (tolerance, max_iterations), progress
    )
    return Minimum(**found)


def jacobian(fun: Callable[[np.ndarray], Any], x: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Values and exact Jacobian of a function at a point: arrays of shapes (m,) and (m, n).

    >>> import apsides, numpy as np
    >>> apsides.jacobian(lambda x: [x[0] * x[1], np.sin(x[0])], [0.0, 2.0])[1]
    array([[2., 0.],
           [1., 0.]])
    """
    at = _vector(x, "`x`")
    owner = next(_owners)
    arguments = _arguments(owner, [f"x[{k}]" for k in range(at.size)])
    outputs = [_symbol(v, arguments[0]) for v in _symbols(fun(arguments), "the function")]
    values, rows = _native.evaluate(owner, outputs, at.tolist())
    return values, rows.reshape(len(outputs), at.size)


@dataclass
class Event:
    """A function ``fun(t, x)`` whose zeros are located along an integration."""

    #: Function of the time and of the state.
    fun: Callable[[Any, np.ndarray], Any]
    #: 1 for zeros where it rises, -1 where it falls, 0 for both.
    direction: int = 0
    #: The integration ends there.
    terminal: bool = False


@dataclass
class Flight:
    """What `integrate` returns."""

    #: Times, shape (m,).
    t: np.ndarray
    #: States, shape (n, m); not a number at times that were not reached.
    y: np.ndarray
    #: ``"Completed"``, ``"Event(0)"``, ``"Stiff"``, ..
    status: str
    #: True if the end or a terminal event was reached.
    success: bool
    #: Time and state at the end.
    end_time: float
    end_state: np.ndarray
    #: For each event, its times and states, as of SciPy.
    t_events: list[np.ndarray] = field(default_factory=list)
    y_events: list[np.ndarray] = field(default_factory=list)
    #: Accepted steps, and evaluations of the rates.
    steps: int = 0
    evaluations: int = 0


def integrate(
    fun: Callable[[Any, np.ndarray], Any],
    t_span: Sequence[float],
    y0: ArrayLike,
    *,
    t_eval: ArrayLike | None = None,
    events: Iterable[Event | Callable[[Any, np.ndarray], Any]] | Event | Callable[[Any, np.ndarray], Any] = (),
    method: str = "dop853",
    rtol: float = 1e-10,
    atol: float = 1e-10,
    max_step: float = np.inf,
    max_steps: int = 1_000_000,
) -> Flight:
    """Integrates ``y' = fun(t, y)`` from ``t_span[0]`` to ``t_span[1]`` by a Runge-Kutta method of order 8 (``"dopri5"``: 5).

    ``fun`` is called once, with symbols, and traced; so are events, which may have the attributes ``direction`` and ``terminal`` as of SciPy.

    >>> import apsides
    >>> ground = apsides.Event(lambda t, y: y[0], direction=-1, terminal=True)
    >>> fall = apsides.integrate(lambda t, y: [y[1], -9.81], (0, 60), [0, 10], events=ground)
    >>> abs(fall.end_time - 20 / 9.81) < 1e-9, fall.status
    (True, 'Event(0)')
    """
    start = _vector(y0, "`y0`")
    span = _vector(t_span, "`t_span`")
    if span.size != 2:
        raise _native.Error(f"`t_span` has {span.size} numbers, allowed are two: start and end")
    owner = next(_owners)
    inputs = _arguments(owner, [f"y[{k}]" for k in range(start.size)] + ["t"])
    y, t = inputs[:-1], inputs[-1]
    rates = [_symbol(v, t) for v in _symbols(fun(t, y), "the function")]
    if len(rates) != start.size:
        raise _native.Error(f"the function returns {len(rates)} rates, `y0` has {start.size} states")
    listed = [events] if callable(events) or isinstance(events, Event) else list(events)
    stated = []
    for event in listed:
        function = event.fun if isinstance(event, Event) else event
        values = _symbols(function(t, y), "an event")
        if len(values) != 1 or isinstance(values[0], Condition):
            raise _native.Error("an event returns one formula, whose zeros are located")
        direction = int(np.sign(getattr(event, "direction", 0)))
        stated.append((_symbol(values[0], t), direction, bool(getattr(event, "terminal", False))))
    times = None if t_eval is None else _vector(t_eval, "`t_eval`").tolist()
    found = _native.integrate(
        owner, rates, stated, (span[0], span[1]), start.tolist(), times, method, (rtol, atol), max_step, count(max_steps, "max_steps", 1)
    )
    records = found.pop("events")
    by_event = [[r for r in records if r[0] == k] for k in range(len(stated))]
    status = found["status"]
    return Flight(
        t=found["t"],
        y=found["states"].reshape(-1, start.size).T,
        status=status,
        success=status == "Completed" or status.startswith("Event"),
        end_time=found["end_time"],
        end_state=found["end_state"],
        t_events=[np.array([r[1] for r in rows]) for rows in by_event],
        y_events=[np.array([r[2] for r in rows]).reshape(-1, start.size) for rows in by_event],
        steps=found["steps"],
        evaluations=found["evaluations"],
    )


@dataclass
class Found:
    """What `search` returns."""

    #: The best point, shape (n,); None where every evaluation failed.
    x: np.ndarray | None
    #: The value there.
    fun: float
    #: The largest violation there.
    violation: float
    #: True if no constraint is violated there.
    feasible: bool
    evaluations: int
    generations: int
    #: The reason why it ended.
    stop: str


def search(
    fun: Callable[[np.ndarray], Any],
    bounds: Any,
    *,
    method: str = "differential-evolution",
    budget: int = 10_000,
    seed: int = 0,
    target: float | None = None,
    start: Sequence[ArrayLike] = (),
) -> Found:
    """Searches a box for the least value of any function, which is called with arrays of floats of shape (n,).

    The function returns a number, or a number and a list of violations that are to be at most zero; not a number is a failure. ``method`` is
    ``"differential-evolution"``, ``"cma-es"``, ``"particle-swarm"``, ``"genetic"``, ``"ant-colony"``, ``"annealing"``, ``"cooperation"`` or
    ``"islands"``. The same seed gives the same result.

    >>> import apsides
    >>> found = apsides.search(lambda x: abs(x[0] - 1) + abs(x[1]), [(-5, 5)] * 2, method="cma-es", budget=3000)
    >>> found.fun < 1e-6
    True
    """
    pairs = list(bounds) if not hasattr(bounds, "lb") else bounds
    lower, upper = _bounds(pairs, len(pairs) if isinstance(pairs, list) else np.size(bounds.lb))
    points = [_vector(point, "a point of `start`").tolist() for point in start]
    return Found(**_native.search(fun, lower.tolist(), upper.tolist(), method, count(budget, "budget", 1), count(seed, "seed", 0), target, points))
