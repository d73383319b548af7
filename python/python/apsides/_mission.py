"""Missions by name, from files, and of problems."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from . import _native
from ._functions import count
from ._solution import Certificate, Solution


class Mission:
    """A mission with the values of its keys. Made by `mission`, `load` and `Problem.mission`; it never changes."""

    def __init__(self, native: _native.Mission) -> None:
        self._native = native

    def __repr__(self) -> str:
        return f"<mission `{self.name}`: {self.title}>"

    @property
    def name(self) -> str:
        """Name of the mission."""
        return self._native.name

    @property
    def title(self) -> str:
        """Its purpose, in one line."""
        return self._native.title

    @property
    def keys(self) -> dict[str, Any]:
        """Every key and its value: the vehicle, the flight, and the settings of methods."""
        return {key["key"]: key["value"] for key in self._native.keys()}

    def describe(self, key: str | None = None) -> str:
        """Keys with values, units and meanings, as text; those whose name contains ``key``."""
        found = [k for k in self._native.keys() if key is None or key in k["key"]]
        return "\n".join(f"{k['key']} = {k['value']} {k['unit']}: {k['meaning']} ({k['allowed']})" for k in found)

    def to_file(self) -> str:
        """The text of the mission file with every value written out."""
        return self._native.to_file()

    def having(self, **values: Any) -> Mission:
        """The same mission with other values: ``having(thrust_n=500, radau__points=5)``; two underscores stand for the dot of a key."""
        return Mission(self._native.having(values)) if values else self

    def solve(
        self,
        method: str | None = None,
        *,
        start: Solution | None = None,
        progress: Callable[[dict[str, float]], Any] | None = None,
        threads: int = 1,
        seed: int = 0,
        settings: Mapping[str, Any] | None = None,
        **values: Any,
    ) -> Solution:
        """Solves the mission and verifies the answer by a re-simulation that shares no code with the solver.

        Parameters
        ----------
        method : ``"radau"`` (collocation, the default), ``"multiple-shooting"``, ``"indirect"``, ``"piecewise"``, ``"flatness"``, ..
        start : a solution of a neighbouring case, from which the solve begins
        progress : called with a dictionary at every iteration; when it returns False the solve ends with its best iterate
        threads, seed : of a solve; no result depends on the number of threads
        settings : keys with dots, ``{"radau.points": 5}``
        **values : values of keys, of constants, or settings of the method by their last word (``tolerance=1e-8``)

        A flight that cannot be flown is no error: `Solution.status` and `Solution.message` say why.
        """
        if start is not None and not isinstance(start, Solution):
            raise _native.SettingError(f"`start` is of type {type(start).__name__}, allowed is a solution")
        if method is not None and not isinstance(method, str):
            raise _native.SettingError(f"`method` is of type {type(method).__name__}, allowed is a word such as \"radau\"")
        if settings is not None and not isinstance(settings, Mapping):
            raise _native.SettingError(f"`settings` is of type {type(settings).__name__}, allowed is a dictionary {{\"radau.points\": 5}}")
        changed = {**({} if method is None else {"method": method}), **(settings or {}), **values}
        native = self._native.having(changed) if changed else self._native
        found = native.solve(None if start is None else start._native, progress, count(threads, "threads", 1), count(seed, "seed", 0))
        return Solution(found, Mission(native))

    def verify(self, solution: Solution) -> Certificate:
        """The certificate of a solution under the values of this mission."""
        return Certificate(json.loads(self._native.verify(solution._native)))

    def certify(self, directory: str | os.PathLike[str]) -> Certificate:
        """The certificate of the trajectory in a result directory (``trajectory.csv``)."""
        return Certificate(json.loads(self._native.certify(os.fspath(directory))))

    def sweep(
        self, *, method: str | None = None, progress: Callable[[Solution], Any] | None = None, **axes: Iterable[Any]
    ) -> list[Solution]:
        """Solves the mission for every combination of values, ``sweep(thrust_n=[400, 500])``, each from its neighbour.

        The last axis runs fastest. ``progress`` is called with each solution; when it returns False the sweep ends.
        """
        lists = {key: list(values) if isinstance(values, Iterable) and not isinstance(values, str) else [values] for key, values in axes.items()}
        # Every case is refused before the first is solved.
        cases = [dict(zip(lists, case)) for case in itertools.product(*lists.values())]
        missions = [self.having(**({} if method is None else {"method": method}), **case) for case in cases]
        found: list[Solution] = []
        start = None
        for case, mission in zip(cases, missions):
            solution = mission.solve(start=start)
            solution.case = case
            found.append(solution)
            if solution.success:
                start = solution
            if progress is not None and progress(solution) is False:
                break
        return found


def mission(name: str, **values: Any) -> Mission:
    """A mission that comes with the package, by its name, with other values of its keys.

    >>> import apsides
    >>> apsides.mission("lunar-perilune", perilune_altitude_km=20.0).keys["perilune_altitude_km"]
    20.0
    """
    if not isinstance(name, str):
        raise _native.SettingError(f"the name of a mission is of type {type(name).__name__}, allowed is a text")
    return Mission(_native.load(name)).having(**values)


def missions() -> dict[str, str]:
    """Name and title of each mission that comes with the package."""
    return dict(_native.missions())


def load(path: str | os.PathLike[str], **values: Any) -> Mission:
    """A mission from its file, with other values of its keys. Files with ``kind = "problem"`` have equations of their own."""
    if not isinstance(path, (str, os.PathLike)):
        raise _native.SettingError(f"the path of a mission file is of type {type(path).__name__}, allowed is a text or a path")
    return Mission(_native.load(str(os.fspath(path)))).having(**values)
