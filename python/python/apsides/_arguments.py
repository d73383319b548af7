"""Arguments of problems: checked, with the line of the user's program in the message."""

from __future__ import annotations

import linecache
import math
import os
import sys
from typing import Any

import numpy as np

from . import _native
from ._functions import is_number
from ._native import Condition, Symbol

_HERE = os.path.dirname(os.path.abspath(__file__))


class Places:
    """Lines of the user's program, for messages."""

    def __init__(self) -> None:
        self.places: list[tuple[str, int, str]] = []

    def here(self) -> int:
        frame = sys._getframe(1)
        while frame.f_back is not None and os.path.abspath(frame.f_code.co_filename).startswith(_HERE):
            frame = frame.f_back
        name, line = frame.f_code.co_filename, frame.f_lineno
        text = linecache.getline(name, line).strip()
        place = (os.path.basename(name), line, text)
        if self.places and self.places[-1] == place:
            return len(self.places) - 1
        self.places.append(place)
        return len(self.places) - 1

    def error(self, at: int, reason: str) -> _native.ProblemError:
        name, line, text = self.places[at]
        shown = f"\n  {line} | {text}" if text else ""
        return _native.ProblemError(f"{name}, line {line}: {reason}{shown}")


def scalar(value: Any, what: str, places: Places) -> Any:
    """A number or a symbol; None stays."""
    if value is None or isinstance(value, Symbol):
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
        if isinstance(value, Symbol):
            return value
    if isinstance(value, Condition):
        raise places.error(places.here(), f"{what} is the comparison `{value!r}`, allowed is a number or a formula")
    if isinstance(value, (bool, np.bool_)) or not is_number(value):
        found = f"\"{value}\"" if isinstance(value, str) else f"of type {type(value).__name__}"
        raise places.error(places.here(), f"{what} is {found}, allowed is a number or a formula")
    return float(value)


def word(value: Any, what: str, places: Places) -> Any:
    """A text; None stays."""
    if value is None or isinstance(value, str):
        return value
    raise places.error(places.here(), f"{what} is of type {type(value).__name__}, allowed is a text")


def required_word(value: Any, what: str, places: Places) -> str:
    """A text."""
    if value is None:
        raise places.error(places.here(), f"{what} is None, allowed is a text")
    return word(value, what, places)


def numbers(values: Any, what: str, places: Places) -> list[float]:
    try:
        return [float(v) for v in np.asarray(values, dtype=float).ravel()]
    except (TypeError, ValueError):
        raise places.error(places.here(), f"{what}: allowed is a list of numbers") from None


def symbol_name(value: Any, what: str, places: Places) -> str:
    name = value.name if isinstance(value, Symbol) else None
    if name is None:
        raise places.error(places.here(), f"{what} is of type {type(value).__name__}, allowed is the symbol of a state or a control")
    return name


def end(value: Any, what: str, places: Places) -> Any:
    """A value at an end: a number, (least, most), "free"; None stays."""
    if isinstance(value, str):
        if value != "free":
            raise places.error(places.here(), f"{what} is \"{value}\", allowed is a number, (least, most) or \"free\"")
        return value
    if isinstance(value, (tuple, list, np.ndarray)) and not (isinstance(value, np.ndarray) and value.ndim == 0):
        if len(value) != 2:
            raise places.error(places.here(), f"{what} has {len(value)} numbers, allowed is a number, (least, most) or \"free\"")
        return _range(value, what, places)
    return scalar(value, what, places)


def _range(value: Any, what: str, places: Places) -> tuple[Any, Any]:
    """Least and most; None is no bound."""
    least, most = (scalar(v, what, places) for v in value)
    return -math.inf if least is None else least, math.inf if most is None else most


def pair(value: Any, what: str, places: Places) -> Any:
    """Two numbers; None stays."""
    if value is None:
        return None
    if not isinstance(value, (tuple, list, np.ndarray)) or len(value) != 2:
        raise places.error(places.here(), f"{what} is to be (least, most)")
    return _range(value, what, places)


def guards(guard: bool | str, places: Places) -> tuple[bool, bool]:
    known = {False: (False, False), True: (True, True), "lower": (True, False), "upper": (False, True)}
    try:
        return known[guard]
    except (KeyError, TypeError):
        raise places.error(places.here(), "`guard` is True, False, \"lower\" or \"upper\"") from None
