"""NumPy's functions of symbols, and arrays of symbols."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from . import _functions as f
from ._native import Condition, Symbol

_COMPARISONS: dict[Any, Any] = {
    np.less: operator.lt, np.less_equal: operator.le, np.greater: operator.gt, np.greater_equal: operator.ge, np.equal: operator.eq,
    np.not_equal: operator.ne,
}
_UFUNCS: dict[Any, Any] = {
    np.maximum: f.max, np.minimum: f.min, np.fmax: f.max, np.fmin: f.min, np.sign: f.sign, np.arctan2: f.arctan2,
    np.log1p: lambda x: np.log(1.0 + x), np.expm1: lambda x: np.exp(x) - 1.0, np.float_power: operator.pow, np.reciprocal: lambda x: 1.0 / x,
    np.heaviside: lambda x, middle: f.where(x > 0, 1.0, f.where(x < 0, 0.0, middle)),
}


class SymbolArray(np.ndarray):
    """An array of symbols, which also compares element by element and takes `numpy.where`, `numpy.linalg.norm`, `numpy.maximum`."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        return array_ufunc(ufunc, method, inputs, kwargs)

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        return array_function(function, args, kwargs)


def symbol_array(symbols: Any) -> SymbolArray:
    """An array of shape (n,)."""
    symbols = list(symbols)
    found = np.empty(len(symbols), dtype=object)
    for k, symbol in enumerate(symbols):
        found[k] = symbol
    return found.view(SymbolArray)


def _plain(value: Any) -> Any:
    if isinstance(value, SymbolArray):
        return value.view(np.ndarray)
    if isinstance(value, (Symbol, Condition)):
        return f._array(value)
    return value


def _ours(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.dtype == object:
        return value.item() if value.ndim == 0 else value.view(SymbolArray)
    if isinstance(value, (list, tuple)):
        return type(value)(_ours(v) for v in value)
    return value


def _scalar(value: Any) -> Any:
    """An array of no dimensions is its element."""
    return value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value


def array_ufunc(ufunc: Any, method: str, inputs: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """An element-wise function of NumPy where a symbol or an array of symbols is among its arguments."""
    if method == "__call__" and not kwargs:
        if ufunc in _COMPARISONS:
            return _ours(f._each(_COMPARISONS[ufunc], *map(_scalar, inputs)))
        if ufunc in _UFUNCS:
            return _ours(_UFUNCS[ufunc](*map(_scalar, inputs)))
    if "out" in kwargs:
        kwargs = {**kwargs, "out": tuple(_plain(v) for v in kwargs["out"])}
    try:
        return _ours(getattr(ufunc, method)(*map(_plain, inputs), **kwargs))
    except TypeError as e:
        raise _refused(ufunc, e) from None


def _refused(function: Any, error: TypeError) -> TypeError:
    """Our own sentences stay."""
    text = str(error)
    name = getattr(function, "__name__", str(function))
    return error if "traced" in text else TypeError(f"numpy.{name} does not take symbols, whose values are not known while equations are traced ({text})")


def _norm(x: Any, ord: Any = None, axis: Any = None, keepdims: bool = False) -> Any:  # noqa: A002
    if ord not in (None, 2) or keepdims:
        raise TypeError("numpy.linalg.norm of symbols is the Euclidean one, without `ord` and `keepdims`")
    array = _plain(f._array(x))
    return np.sqrt((array * array).sum(axis=axis))


def _interp(*_args: Any, **_named: Any) -> Any:
    raise TypeError(
        "numpy.interp does not take symbols: write apsides.table(xp, fp)(x), a smooth function through the same data; shape=\"monotone\" keeps "
        "their shape and is constant outside, as numpy.interp is"
    )


def _select(condlist: Any, choicelist: Any, default: Any = 0.0) -> Any:
    if len(condlist) != len(choicelist):
        raise TypeError(f"numpy.select has {len(condlist)} conditions for {len(choicelist)} choices")
    found = default
    for condition, choice in zip(reversed(condlist), reversed(choicelist)):
        found = f.where(condition, choice, found)
    return found


_FUNCTIONS: dict[Any, Any] = {
    np.where: f.where, np.select: _select, np.clip: f.clip, np.cross: f.cross, np.linalg.norm: _norm, np.interp: _interp,
}


def array_function(function: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """Any other function of NumPy where a symbol or an array of symbols is among its arguments."""
    if function in _FUNCTIONS:
        return _ours(_FUNCTIONS[function](*args, **kwargs))

    def plain(value: Any) -> Any:
        return [plain(v) for v in value] if isinstance(value, (list, tuple)) and f._is_symbolic(value) else _plain(value)

    try:
        return _ours(function(*map(plain, args), **{key: plain(value) for key, value in kwargs.items()}))
    except TypeError as e:
        raise _refused(function, e) from None
