"""Solutions and their certificates."""

from __future__ import annotations

import html
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._functions import count, is_number

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._mission import Mission


class Certificate:
    """The checks of a trajectory, and the verdict that they allow.

    `verdict` is ``"global-optimum"``, ``"strict-local-optimum"``, ``"extremal"``, ``"feasible"`` or ``"rejected"``.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        self.verdict: str = data["verdict"]
        self.checks: list[dict[str, Any]] = data["checks"]
        self.remarks: list[str] = data.get("remarks", [])

    @property
    def is_verified(self) -> bool:
        """True unless it is rejected."""
        return self.verdict != "rejected"

    @property
    def failed(self) -> list[dict[str, Any]]:
        """The checks that are not passed."""
        return [check for check in self.checks if not check["passed"]]

    def __repr__(self) -> str:
        lines = [f"verdict: {self.verdict}"]
        for c in self.checks:
            mark = "ok  " if c["passed"] else "FAIL"
            value = float("nan") if c["value"] is None else c["value"]
            limit = float("nan") if c["limit"] is None else c["limit"]
            unit = "" if c["unit"] == "-" else f" {c['unit']}"
            lines.append(f"  {mark} {c['name']}: {value:.3g} of {limit:.3g}{unit}")
        lines.extend(f"  {remark}" for remark in self.remarks)
        return "\n".join(lines)


class PhaseSolution:
    """One phase of a solution: ``phase["h"]`` is an array of shape (n,) over the times `time`, in the unit of the quantity."""

    def __init__(self, native: _native.Solution, index: int, name: str) -> None:
        self._native, self._index, self.name = native, index, name
        self._columns = native.columns(index, None, None)

    def __repr__(self) -> str:
        return f"<phase `{self.name}`: {', '.join(self.names)}>"

    @property
    def time(self) -> np.ndarray:
        """Times of the nodes, shape (n,)."""
        return self._columns[0][3]

    @property
    def names(self) -> list[str]:
        """Names of states, controls and path constraints."""
        return [name for name, _, sort, _ in self._columns if sort in ("state", "control", "path")]

    @property
    def units(self) -> dict[str, str]:
        """The unit of each quantity."""
        return {name: unit for name, unit, sort, _ in self._columns if sort != "costate"}

    def __getitem__(self, name: str) -> np.ndarray:
        return _column(self._columns, _name(name), self.name)

    def __contains__(self, name: object) -> bool:
        return name in self.names or name == "time"

    def costate(self, name: str) -> np.ndarray:
        """The costate of a state at the nodes, in the objective's unit per SI unit of the state; shape (n,)."""
        found = [values for n, _, sort, values in self._columns if sort == "costate" and n == _name(name)]
        if not found:
            raise KeyError(f"the solution has no costate of `{_name(name)}`")
        return found[0]

    def sample(self, points: int | ArrayLike = 200) -> dict[str, np.ndarray]:
        """Time, states, controls and path constraints at so many points from start to end, or at given times."""
        if isinstance(points, (int, np.integer)):
            if not 1 <= points <= 10_000_000:
                raise _native.Error(f"a sample of {points} points: allowed is a whole number from 1 to 10000000")
            columns = self._native.columns(self._index, int(points), None)
        else:
            times = np.asarray(points, dtype=float).ravel()
            first, last = self.time[0], self.time[-1]
            rounding = 1e-9 * (abs(first) + abs(last))
            outside = times[~((first - rounding <= times) & (times <= last + rounding))]
            if outside.size:
                raise _native.Error(f"phase `{self.name}` lasts from {first} to {last}, time {outside[0]} is outside")
            columns = self._native.columns(self._index, None, times.tolist())
        return {name: values for name, _, sort, values in columns if sort != "costate"}


def _name(name: Any) -> str:
    own = getattr(name, "name", None)
    return own if isinstance(own, str) else name


def _text(value: Any, what: str) -> str:
    if not isinstance(value, str):
        raise _native.SettingError(f"{what} is of type {type(value).__name__}, allowed is a text")
    return value


def _rows(step: float | str | None, points: int | None) -> tuple[str | None, int | None]:
    """The spacing of rows as the native part takes it."""
    if step is not None and not isinstance(step, str):
        if not is_number(step):
            raise _native.SettingError(f"`step` is of type {type(step).__name__}, allowed is a number of s, or a text such as \"10s\"")
        step = repr(float(step))
    return step, None if points is None else count(points, "points", 2)


def _column(columns: Any, name: str, phase: str) -> np.ndarray:
    for own, _, sort, values in columns:
        if own == name and sort != "costate":
            return values
    known = ", ".join(f"`{n}`" for n, _, sort, _ in columns if sort != "costate")
    raise KeyError(f"phase `{phase}` has no `{name}`; it has {known}")


class Solution(Mapping[str, np.ndarray]):
    """What a solve returns: ``solution["x"]`` is an array over `time`, in the unit of the quantity.

    With several phases the arrays of all phases that have the quantity stand one after the other; ``solution.phase("ascent")`` has those of
    one.
    """

    def __init__(self, native: _native.Solution, mission: Mission) -> None:
        self._native = native
        self.mission = mission
        self.case: dict[str, Any] = {}
        self._summary = json.loads(native.summary())
        self._phases = [PhaseSolution(native, k, name) for k, name in enumerate(native.phases())]

    @property
    def summary(self) -> dict[str, Any]:
        """Everything in numbers and words, as in ``summary.json``."""
        return self._summary

    @property
    def status(self) -> str:
        """``"optimal"``, ``"acceptable"``, ``"infeasible"``, .."""
        return self._summary["status"]

    @property
    def success(self) -> bool:
        """True of an optimal or an acceptable solution."""
        return self.status in ("optimal", "acceptable")

    @property
    def message(self) -> str | None:
        """One sentence where the status is not ``"optimal"``: what conflicts, and what would help."""
        return self._summary.get("message")

    @property
    def objective(self) -> float:
        """The objective in its unit."""
        return self._native.objective()

    @property
    def results(self) -> dict[str, float]:
        """Scalars of the solution; the unit ends the key."""
        return self._summary["results"]

    @property
    def parameters(self) -> dict[str, float]:
        """Static parameters in their units."""
        return self._native.parameters()

    @property
    def counters(self) -> dict[str, int]:
        """Iterations, factorisations and sizes."""
        return self._native.counters()

    @property
    def certificate(self) -> Certificate:
        """The certificate of the solution."""
        return Certificate(json.loads(self._native.certificate()))

    @property
    def verdict(self) -> str:
        """The verdict of the certificate."""
        return self._summary["certificate"]["verdict"]

    @property
    def phases(self) -> list[PhaseSolution]:
        """The phases in order."""
        return list(self._phases)

    def phase(self, name: Any) -> PhaseSolution:
        """One phase, by its name or its index."""
        if isinstance(name, (int, np.integer)) and -len(self._phases) <= name < len(self._phases):
            return self._phases[name]
        for phase in self._phases:
            if phase.name == _name(name):
                return phase
        raise KeyError(f"there is no phase `{_name(name)}`; there are {', '.join(p.name for p in self._phases)}")

    @property
    def time(self) -> np.ndarray:
        """Times of the nodes of all phases, shape (n,)."""
        return np.concatenate([p.time for p in self._phases])

    @property
    def units(self) -> dict[str, str]:
        """The unit of each quantity."""
        return {name: unit for p in reversed(self._phases) for name, unit in p.units.items()}

    def __getitem__(self, name: Any) -> np.ndarray:
        if isinstance(name, tuple):
            phase, quantity = name
            return self.phase(phase)[quantity]
        name = _name(name)
        if name == "time":
            return self.time
        found = [p[name] for p in self._phases if name in p]
        if found:
            return np.concatenate(found)
        if name in self.parameters:
            return np.array(self.parameters[name])
        known = ", ".join(f"`{n}`" for n in self)
        raise KeyError(f"the solution has no `{name}`; it has {known}")

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(name for p in self._phases for name in ("time", *p.names)))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def costate(self, name: str) -> np.ndarray:
        """The costate of a state at the nodes; shape (n,)."""
        return np.concatenate([p.costate(name) for p in self._phases])

    def sample(self, points: int | ArrayLike = 200) -> dict[str, np.ndarray]:
        """Time, states, controls and path constraints at so many points of the only phase, or at given times."""
        if len(self._phases) != 1:
            raise _native.Error("there are several phases: use solution.phase(name).sample(..)")
        return self._phases[0].sample(points)

    def sensitivity(self, *keys: str) -> dict[str, dict[str, Any]]:
        """What one more unit of a key is worth: ``{"thrust_n": {"objective": .., "results": {..}}}``; of all keys where none are named.

        ``"objective"`` is None where the key moves some of the active requirements that depend on each other: more and less of it have prices of
        their own, or no feasible trajectory."""
        found = json.loads(self.mission._native.sensitivities(self._native, list(keys) or None))
        return {price["key"].removeprefix("constants."): price for price in found}

    def verify(self) -> Certificate:
        """Verifies the solution again."""
        return self.mission.verify(self)

    def report(self, directory: str | os.PathLike[str]) -> list[str]:
        """Writes ``report.html``, ``trajectory.csv``, ``summary.json`` and others into a directory, and returns their paths."""
        return self._native.report(os.fspath(directory))

    def ephemeris(self, *, step: float | str | None = None, points: int | None = None) -> dict[str, np.ndarray]:
        """The flight in rows at equal steps (``step="10s"``, a number in s), or so many from start to end, from its own polynomials.

        An array for each column: ``phase``, the instant (``epoch_tdb``), ``time_s``; position and velocity in inertial and body-fixed axes, altitude,
        speeds, path angles, mass, thrust and more where the flight is about a body; then what the mission has of its own. Headers end with the unit.
        """
        texts, columns = self._native.ephemeris(*_rows(step, points))
        return {**{name: np.array(values) for name, values in texts}, **dict(columns)}

    def write(
        self,
        directory: str | os.PathLike[str],
        formats: str | Iterable[str] = "csv",
        *,
        step: float | str | None = None,
        points: int | None = None,
    ) -> list[str]:
        """Writes `ephemeris` into a directory and returns the paths: ``solution.write("results", "oem,opm,czml", step="10s")``.

        ``formats`` are of csv, json, npz, oem, opm, aem, czml, a list or one text with commas. The last four need a place about a body, which missions
        have, and problems that state it by `Problem.motion`.
        """
        if isinstance(formats, str):
            formats = formats.split(",")
        words = [_text(word, "a format") for word in formats]
        return self._native.write(os.fspath(directory), words, *_rows(step, points))

    def to_dict(self) -> dict[str, Any]:
        """Summary and arrays as plain lists and numbers, which ``json`` takes."""
        phases = {p.name: {name: p[name].tolist() for name in ("time", *p.names)} for p in self._phases}
        return {**self._summary, "phases": phases, "parameters": self.parameters, "units": self.units}

    def to_pandas(self) -> pandas.DataFrame:
        """A table with a row for each node: phase, time and all quantities, missing where a phase does not have them."""
        import pandas

        frames = [pandas.DataFrame({"phase": p.name, **{name: p[name] for name in ("time", *p.names)}}) for p in self._phases]
        frame = pandas.concat(frames, ignore_index=True)
        frame.attrs["units"] = self.units
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """A data set over the time, with units as attributes; of several phases, nodes are numbered and `phase` names theirs."""
        import xarray

        units = self.units

        def variable(name: str, values: np.ndarray, dimension: str) -> Any:
            return (dimension, values, {"units": units.get(name, "")})

        if len(self._phases) == 1:
            phase = self._phases[0]
            data = {name: variable(name, phase[name], "time") for name in phase.names}
            return xarray.Dataset(data, coords={"time": variable("time", phase.time, "time")}, attrs=self._attributes())
        names = [name for name in self if name != "time"]
        data = {}
        for name in names:
            parts = [p[name] if name in p else np.full(p.time.size, np.nan) for p in self._phases]
            data[name] = variable(name, np.concatenate(parts), "node")
        labels = np.concatenate([np.full(p.time.size, p.name) for p in self._phases])
        coords = {"time": variable("time", self.time, "node"), "phase": ("node", labels)}
        return xarray.Dataset(data, coords=coords, attrs=self._attributes())

    def _attributes(self) -> dict[str, Any]:
        return {"mission": self._summary["mission"], "objective": self.objective, "verdict": self.verdict}

    def __repr__(self) -> str:
        objective = self._summary["objective"]
        unit = "" if objective["unit"] == "-" else f" {objective['unit']}"
        text = f"<solution of `{self._summary['mission']}`: {self.status}, {self.verdict}, {objective['name']} = {self.objective:.9g}{unit}"
        reasons = [self.message] if self.message else []
        if self.success and self.verdict == "rejected":
            checks = [f"{c['name']}: {c['value']:.3g}, allowed is {c['limit']:.3g}" for c in self.certificate.failed]
            reasons.append(f"not verified: {'; '.join(checks)}")
        return "; ".join([text, *reasons]) + ">"

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)

    def _repr_html_(self) -> str:
        """The results and the figures of the report, for notebooks."""
        page = self._native.html()
        # Pictures, not the keys of their legends.
        pictures = re.findall(r'<svg[^>]*role="img".*?</svg>', page, flags=re.DOTALL)
        figures = [f'<div style="display:inline-block;width:360px;max-width:100%">{picture}</div>' for picture in pictures]
        rows = "".join(f"<tr><td>{html.escape(k)}</td><td>{v:.9g}</td></tr>" for k, v in self.results.items() if v is not None)
        return f"<div><p><b>{html.escape(repr(self)[1:-1])}</b></p><table>{rows}</table>{''.join(figures)}</div>"
