"""Functions of numbers, arrays and symbols."""

from __future__ import annotations

import numbers
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._native import Condition, Symbol, Table

__all__ = [
    "abs", "arctan2", "clip", "cross", "dot", "hypot", "max", "min", "norm", "sign", "smooth_abs", "smooth_max", "smooth_min",
    "smooth_step", "table", "unit", "where",
]


def _is_symbolic(*values: Any) -> bool:
    for value in values:
        if isinstance(value, (Symbol, Condition)):
            return True
        if isinstance(value, (list, tuple)) and _is_symbolic(*value):
            return True
        if isinstance(value, np.ndarray) and value.dtype == object:
            return True
    return False


def _each(function: Any, *values: Any) -> Any:
    """Applies a function of scalars to each element of arrays, which are broadcast."""
    if not any(isinstance(v, (list, tuple, np.ndarray)) for v in values):
        return function(*values)
    arrays = np.broadcast_arrays(*(_array(v) for v in values))
    found = np.empty(arrays[0].shape, dtype=object)
    for index in np.ndindex(found.shape):
        found[index] = function(*(a[index] for a in arrays))
    return found


def _array(value: Any) -> np.ndarray:
    if isinstance(value, (Symbol, Condition)):
        array = np.empty((), dtype=object)
        array[()] = value
        return array
    return np.asarray(value, dtype=object) if _is_symbolic(value) else np.asarray(value)


def _operand(value: Any, function: str) -> Any:
    if isinstance(value, Symbol) or is_number(value) or isinstance(value, (bool, np.bool_)):
        return value
    raise TypeError(f"apsides.{function} takes numbers and formulas, not a value of type {type(value).__name__}")


def _floats(values: Any, what: str) -> np.ndarray:
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise _native.Error(f"a table: {what} is a list of numbers") from None


def where(condition: Any, then: Any, otherwise: Any) -> Any:
    """``then`` where the condition holds, else ``otherwise``: the choice that Python's ``if`` cannot make of symbols.

    Numbers, arrays and symbols of any shapes that NumPy broadcasts. Where one state passes a value, the mesh gets a node there.

    >>> import apsides
    >>> apsides.where(3.0 > 2.0, 1.0, 0.0)
    1.0
    """
    if not _is_symbolic(condition, then, otherwise):
        found = np.where(condition, then, otherwise)
        return found.item() if found.ndim == 0 else found

    def choose(c: Any, a: Any, b: Any) -> Any:
        if not isinstance(c, (Condition, bool, np.bool_)):
            raise TypeError(f"apsides.where chooses by a comparison such as `x > 1`, not by a value of type {type(c).__name__}")
        if isinstance(c, Condition):
            return _native.choose(c, _operand(a, "where"), _operand(b, "where"))
        return a if c else b

    return _each(choose, condition, then, otherwise)


def _extreme(name: str, function: Any, first: Any, others: tuple[Any, ...]) -> Any:
    values = (first, *others)
    if len(values) == 1:
        values = tuple(first)
        if not values:
            raise TypeError(f"apsides.{name} of nothing: give it two values or more")
    if not _is_symbolic(*values):
        found = values[0]
        for value in values[1:]:
            found = function(found, value)
        return found

    def pair(a: Any, b: Any) -> Any:
        if isinstance(a, Symbol) or isinstance(b, Symbol):
            return _native.binary(name, _operand(a, name), _operand(b, name))
        return function(a, b)

    found = values[0]
    for value in values[1:]:
        found = _each(pair, found, value)
    return found


def min(first: Any, *others: Any) -> Any:  # noqa: A001
    """The least of several values, or of the elements of one sequence; element by element of arrays."""
    return _extreme("min", np.minimum, first, others)


def max(first: Any, *others: Any) -> Any:  # noqa: A001
    """The largest of several values, or of the elements of one sequence; element by element of arrays."""
    return _extreme("max", np.maximum, first, others)


def clip(x: Any, lower: Any, upper: Any) -> Any:
    """``x`` between two values: ``min(max(x, lower), upper)``."""
    return min(max(x, lower), upper)


def abs(x: Any) -> Any:  # noqa: A001
    """The absolute value. It has a kink at zero: see `smooth_abs`."""
    return np.abs(x) if isinstance(x, (list, tuple, np.ndarray)) else x.__abs__()


def sign(x: Any) -> Any:
    """The sign: -1, 0 or 1."""
    if not _is_symbolic(x):
        return np.sign(x)
    return _each(lambda v: _native.unary("sign", v) if isinstance(v, Symbol) else float(np.sign(v)), x)


def arctan2(y: Any, x: Any) -> Any:
    """The angle of the point (``x``, ``y``) in rad, in (-pi, pi]."""
    if not _is_symbolic(x, y):
        return np.arctan2(y, x)
    return _each(lambda a, b: _native.binary("arctan2", a, b), y, x)


def hypot(x: Any, y: Any) -> Any:
    """The length of the vector (``x``, ``y``)."""
    return np.hypot(x, y) if not _is_symbolic(x, y) else np.sqrt(x * x + y * y)


def norm(vector: Any, width: float = 0.0) -> Any:
    """The length of a vector of symbols or numbers.

    At zero a length has no derivative, and a certificate stops at ``feasible`` there; with a small ``width`` in the unit of the vector it has:
    ``sqrt(v @ v + width**2)``.
    """
    vector = _array(vector)
    square = (vector * vector).sum()
    return np.sqrt(square + width * width if width else square)


def dot(a: Any, b: Any) -> Any:
    """The scalar product of two vectors."""
    return (_array(a) * _array(b)).sum()


def cross(a: Any, b: Any) -> np.ndarray:
    """The vector product of two vectors of three elements."""
    (a0, a1, a2), (b0, b1, b2) = _array(a), _array(b)
    return _array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def smooth_abs(x: Any, width: float) -> Any:
    """``sqrt(x**2 + width**2)``: an absolute value without a kink, with ``width`` in the unit of ``x``."""
    return np.sqrt(x * x + width * width)


def smooth_max(a: Any, b: Any, width: float) -> Any:
    """A maximum without a kink: too large by half the width where both are equal."""
    return 0.5 * (a + b + smooth_abs(a - b, width))


def smooth_min(a: Any, b: Any, width: float) -> Any:
    """A minimum without a kink: too small by half the width where both are equal."""
    return 0.5 * (a + b - smooth_abs(a - b, width))


def smooth_step(x: Any, width: float) -> Any:
    """A step from zero to one without a jump, ``(1 + tanh(x / width)) / 2``."""
    return 0.5 * (1.0 + np.tanh(x / width))


class _Table:
    """A function through data; see `table`."""

    def __init__(self, native: Table) -> None:
        self._native = native

    def __call__(self, x: Any, y: Any = None) -> Any:
        wanted = self._native.variables
        given = 1 if y is None else 2
        if wanted != given:
            raise TypeError(f"table `{self._native.name}` takes {wanted} variable{'s' if wanted > 1 else ''}, not {given}")
        values = (x,) if y is None else (x, y)

        def look_up(*at: Any) -> Any:
            if _is_symbolic(*at):
                return self._native.symbol(*(_operand(v, "table") for v in at))
            return self._native.number(*(_floats(v, "its variable").item() for v in at))

        found = _each(look_up, *values)
        symbolic = _is_symbolic(*values)
        return found.astype(float) if isinstance(found, np.ndarray) and not symbolic else found

    def __repr__(self) -> str:
        return f"<table `{self._native.name}` of {self._native.variables} variable(s)>"


def table(x: ArrayLike, values: ArrayLike, y: ArrayLike | None = None, *, shape: str = "spline", name: str = "table") -> _Table:
    """A function through data: of one variable, or of two with ``y``.

    Parameters
    ----------
    x : array of length n, at least four, increasing
    values : array of shape (n,), or (n, m) with ``y``
    y : array of length m, for two variables
    shape : ``"spline"`` (cubic splines, two continuous derivatives) or ``"monotone"`` (keeps the shape of the data, constant outside)

    >>> import apsides
    >>> square = apsides.table([0, 1, 2, 3, 4], [0, 1, 4, 9, 16])
    >>> round(square(2.5), 9)
    6.25
    """
    for what, word in (("name", name), ("shape", shape)):
        if not isinstance(word, str):
            raise _native.Error(f"a table: `{what}` is of type {type(word).__name__}, allowed is a text")
    knots = _floats(x, "`x`")
    second = np.empty(0) if y is None else _floats(y, "`y`")
    data = _floats(values, "`values`")
    shape_wanted = (knots.size,) if y is None else (knots.size, second.size)
    if knots.ndim != 1 or second.ndim != 1:
        raise _native.Error("a table: `x` and `y` are lists of numbers")
    if data.shape != shape_wanted:
        raise _native.Error(f"a table: `values` has the shape {data.shape}, to go with x and y it is {shape_wanted}")
    return _Table(Table(name, knots.tolist(), second.tolist(), data.ravel().tolist(), shape))


def unit(name: str) -> float:
    """The size of a unit in SI: ``h + 10 * apsides.unit("km")``.

    >>> import apsides
    >>> apsides.unit("km/h")
    0.2777777777777778
    """
    return _native.unit_factor(name)


def count(value: Any, name: str, least: int) -> int:
    """A whole number that is large enough."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Integral) or value < least:
        raise _native.SettingError(f"`{name}` is {value!r}, allowed is a whole number from {least}")
    return int(value)


def is_number(value: Any) -> bool:
    """True of a number of Python or NumPy."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)
