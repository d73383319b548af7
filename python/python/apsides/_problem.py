"""Problems with equations of one's own."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from . import _arguments as arguments
from . import _native
from ._functions import is_number
from ._native import Condition, Symbol
from ._mission import Mission
from ._numpy import symbol_array
from ._solution import Solution

_owners = itertools.count(1)

# Parts of the site of a motion.
_SITE = ("longitude", "latitude", "altitude")


class Phase:
    """A part of a flight with its own states, controls and equations. Made by `Problem.phase`."""

    def __init__(self, problem: Problem, name: str, time: dict[str, Any]) -> None:
        self._problem = problem
        self._places = problem._places
        self.name = name
        self._at = self._places.here()
        self._time = time
        self._states: dict[str, dict[str, Any]] = {}
        self._controls: dict[str, dict[str, Any]] = {}
        self._dynamics: dict[str, tuple[int, Any]] = {}
        self._path: list[dict[str, Any]] = []
        self._integrals: list[dict[str, Any]] = []
        self._kinks: list[tuple[str, int, list[Any]]] = []
        self._directions: list[tuple[list[str], int]] = []
        self._guess: dict[str, Any] | None = None

    def __repr__(self) -> str:
        return f"<phase `{self.name}`: states {list(self._states)}, controls {list(self._controls)}>"

    def _quantity(self, name: str, at_end: bool = False) -> Symbol:
        return Symbol.quantity(self._problem._owner, name, None if at_end else self.name, at_end)

    @property
    def time(self) -> Symbol:
        """The time along the phase, for equations and constraints that depend on it."""
        return self._quantity("time")

    @property
    def fraction(self) -> Symbol:
        """The part of the phase that has passed, from 0 to 1, for guesses."""
        return self._quantity("fraction")

    @property
    def initial_time(self) -> Symbol:
        """The time at which the phase begins, for objectives and constraints of ends."""
        return self._quantity(f"{self.name}.start.time", True)

    @property
    def final_time(self) -> Symbol:
        """The time at which the phase ends, for objectives and constraints of ends."""
        return self._quantity(f"{self.name}.end.time", True)

    @property
    def duration(self) -> Symbol:
        """The time that the phase takes, for objectives and constraints of ends."""
        return self._quantity(f"{self.name}.duration", True)

    def _add(self, kind: str, name: str, **stated: Any) -> Symbol:
        places = self._places
        at = places.here()
        what = f"{kind} `{name}`"
        self._problem._check_name(name, f"the name of a {kind}", at)
        if name in self._states or name in self._controls:
            raise places.error(at, f"phase `{self.name}` has a quantity `{name}` already: choose another name")
        variable = {
            "name": name,
            "at": at,
            "unit": arguments.word(stated["unit"], f"`unit` of {what}", places) or "",
            "guard": arguments.guards(stated["guard"], places),
            "guess": None,
            "rate": arguments.pair(stated.get("rate"), f"`rate` of {what}", places),
        }
        for key in ("lower", "upper", "scale", "tolerance"):
            variable[key] = arguments.scalar(stated.get(key), f"`{key}` of {what}", places)
        for key in ("start", "end"):
            variable[key] = arguments.end(stated.get(key), f"the {key} of {what}", places)
        (self._states if kind == "state" else self._controls)[name] = variable
        return self._quantity(name)

    def state(
        self,
        name: str,
        *,
        start: Any = None,
        end: Any = "free",
        lower: Any = None,
        upper: Any = None,
        unit: str | None = None,
        scale: Any = None,
        tolerance: Any = None,
        guard: bool | str = False,
    ) -> Symbol:
        """Adds a state and returns its symbol.

        ``start`` and ``end`` are a value, ``(least, most)`` or ``"free"``, where None is no bound; a start must be stated, unless the phase is linked to one before. All
        numbers are in ``unit``; in equations the state is in SI (``unit="km"`` is metres there, ``"deg"`` is rad). ``tolerance`` is the largest
        miss that a re-simulation may show. ``guard`` marks bounds that no solution is meant to reach.
        """
        return self._add("state", name, start=start, end=end, lower=lower, upper=upper, unit=unit, scale=scale, tolerance=tolerance, guard=guard)

    def control(
        self,
        name: str,
        *,
        lower: Any = None,
        upper: Any = None,
        rate: Any = None,
        start: Any = None,
        end: Any = None,
        unit: str | None = None,
        scale: Any = None,
        tolerance: Any = None,
        guard: bool | str = False,
    ) -> Symbol:
        """Adds a control and returns its symbol. Numbers are in ``unit``; in equations the control is in SI, an angle in rad.

        A control may jump at any time. With ``rate=(least, most)``, in its unit per second, it does not, and has values at the ends as a state has:
        ``start`` and ``end`` may be stated, ``u.start`` and ``u.end`` stand in constraints. In the solved problem it is a state, after those of
        `state`, and ``u_rate`` is the control.
        """
        stated = {"rate": rate, "start": start, "end": end, "tolerance": tolerance}
        return self._add("control", name, lower=lower, upper=upper, unit=unit, scale=scale, guard=guard, **stated)

    def states(self, names: Sequence[str] | str, **stated: Any) -> np.ndarray:
        """Adds several states and returns their symbols as an array of shape (n,).

        ``names`` is a list or one text with spaces. What is stated is common, or a list with an element for each (``start=[0, 0, 1]``);
        ranges of ends are then a list of pairs.
        """
        return self._several(self.state, names, stated)

    def controls(self, names: Sequence[str] | str, **stated: Any) -> np.ndarray:
        """Adds several controls and returns their symbols as an array of shape (n,); as of `states`."""
        return self._several(self.control, names, stated)

    def _several(self, add: Callable[..., Symbol], names: Sequence[str] | str, stated: dict[str, Any]) -> np.ndarray:
        if not isinstance(names, (str, list, tuple)):
            raise self._places.error(self._places.here(), f"names are of type {type(names).__name__}, allowed is a list, or a text with blanks")
        names = names.split() if isinstance(names, str) else list(names)
        for key, value in stated.items():
            if isinstance(value, (list, np.ndarray)) and len(value) != len(names):
                raise self._places.error(self._places.here(), f"`{key}` has {len(value)} elements for {len(names)} names")

        def each(k: int) -> dict[str, Any]:
            return {key: value[k] if isinstance(value, (list, np.ndarray)) else value for key, value in stated.items()}

        return symbol_array([add(name, **each(k)) for k, name in enumerate(names)])

    @property
    def x(self) -> np.ndarray:
        """The states so far, an array of symbols of shape (nx,)."""
        return self._vector(self._states)

    @property
    def u(self) -> np.ndarray:
        """The controls so far, an array of symbols of shape (nu,)."""
        return self._vector(self._controls)

    def _vector(self, names: Iterable[str]) -> np.ndarray:
        return symbol_array(self._quantity(name) for name in names)

    def _call(self, function: Callable[..., Any]) -> Any:
        """A function of (t, x, u, p), or of the first of these that it has."""
        code = getattr(function, "__code__", None)
        count = 4
        if code is not None and not code.co_flags & 0x04:
            count = code.co_argcount - (1 if getattr(function, "__self__", None) is not None else 0)
        return function(*(self.time, self.x, self.u, self._problem.p)[:count])

    def dynamics(self, rates: Any = None, /, **named: Any) -> None:
        """States the rates of the states, in SI per second.

        Either by name, ``dynamics(x=v*np.cos(th), v=..)``; or as a list or array with a rate for each state in order; or as a function
        ``f(t, x, u, p)`` of time, states (nx,), controls (nu,) and parameters (np,) that returns such a list or a dictionary.
        """
        places = self._places
        at = places.here()
        if callable(rates):
            rates = self._call(rates)
            if rates is None:
                raise places.error(at, f"the function of the rates of phase `{self.name}` returns None: it is to return a list of rates")
        if isinstance(rates, Mapping):
            named = {**rates, **named}
        elif rates is not None:
            values = list(np.asarray(rates, dtype=object).ravel()) if not isinstance(rates, Symbol) else [rates]
            if len(values) != len(self._states):
                raise places.error(
                    at, f"phase `{self.name}` has {len(self._states)} states ({', '.join(self._states)}), these are {len(values)} rates"
                )
            named = {**dict(zip(self._states, values)), **named}
        for name, rate in named.items():
            if rate is None:
                raise places.error(at, f"the rate of `{name}` is None, allowed is a number or a formula")
            self._dynamics[name] = (at, arguments.scalar(rate, f"the rate of `{name}`", places))

    def path(
        self,
        constraint: Any,
        lower: Any = None,
        upper: Any = None,
        *,
        equals: Any = None,
        name: str | None = None,
        unit: str | None = None,
        scale: Any = None,
        guard: bool | str = False,
    ) -> None:
        """Adds a constraint along the phase: ``path(x**2 + y**2 <= 1)``, or ``path(q, upper=50, unit="kPa")`` with bounds in ``unit``.

        A function ``f(t, x, u, p)`` is traced first; arrays are a constraint for each element.
        """
        at = self._places.here()
        if callable(constraint):
            constraint = self._call(constraint)
        self._path.extend(
            self._problem._rows(constraint, lower, upper, equals, arguments.word(name, "the name of a constraint", self._places) or f"path{len(self._path) + 1}", unit, scale, guard, at)
        )

    def integral(
        self,
        rate: Any,
        *,
        name: str | None = None,
        lower: Any = None,
        upper: Any = None,
        unit: str | None = None,
        scale: Any = None,
    ) -> Symbol:
        """Adds the integral of a rate over the phase, with bounds where they are stated, and returns its symbol for `minimize`, `maximize` and `constrain`."""
        places = self._places
        at = places.here()
        name = arguments.word(name, "the name of an integral", places) or f"integral{len(self._integrals) + 1}"
        self._problem._check_name(name, "the name of an integral", at)
        if callable(rate):
            rate = self._call(rate)
        rate = arguments.scalar(rate, f"the rate of integral `{name}`", places)
        if rate is None:
            raise places.error(at, f"the rate of integral `{name}` is None, allowed is a number or a formula")
        self._integrals.append({
            "name": name,
            "at": at,
            "formula": rate,
            "unit": arguments.word(unit, f"`unit` of integral `{name}`", places),
            "lower": arguments.scalar(lower, "`lower`", places),
            "upper": arguments.scalar(upper, "`upper`", places),
            "scale": arguments.scalar(scale, "`scale`", places),
            "guard": (False, False),
        })
        return self._quantity(f"{self.name}.{name}", True)

    def kink(self, state: Symbol, *values: Any) -> None:
        """Says that equations have a kink where a state passes values, so that the mesh gets a node there."""
        at = self._places.here()
        if not values or any(v is None for v in values):
            raise self._places.error(at, "a kink is at values of the state: phase.kink(h, 11e3)")
        self._kinks.append((arguments.symbol_name(state, "what has a kink", self._places), at, [arguments.scalar(v, "the kink", self._places) for v in values]))

    def direction(self, *angles: Symbol) -> None:
        """Says that one control is the angle of a direction in a plane, or two those of a direction in space."""
        self._directions.append(([arguments.symbol_name(a, "an angle", self._places) for a in angles], self._places.here()))

    def guess(self, time: Sequence[float] | None = None, /, **profiles: Any) -> None:
        """States where a solve begins; what is not stated is a straight line between the bounds.

        ``time`` is a list of at least two times. A profile is a number, a list of values along the phase in the quantity's unit, a formula of
        `time` or `fraction`, or a function of the time.
        """
        at = self._places.here()
        if "time" in profiles:
            time = profiles.pop("time")
        found = []
        for name, profile in profiles.items():
            if callable(profile):
                profile = profile(self.time)
            if profile is None:
                raise self._places.error(at, f"the guess of `{name}` is None, allowed is a number, a list or a formula of the time")
            if isinstance(profile, (list, tuple)) or (isinstance(profile, np.ndarray) and profile.ndim > 0):
                profile = arguments.numbers(profile, f"the guess of `{name}`", self._places)
            else:
                profile = arguments.scalar(profile, f"the guess of `{name}`", self._places)
            found.append((name, at, profile))
        times = None if time is None else arguments.numbers(time, "the time of a guess", self._places)
        self._guess = {"phase": self.name, "at": at, "time": times, "profiles": found}

    def _stated(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "at": self._at,
            "time": self._time,
            "states": list(self._states.values()),
            "controls": list(self._controls.values()),
            "dynamics": [(name, at, rate) for name, (at, rate) in self._dynamics.items()],
            "path": self._path,
            "integrals": self._integrals,
            "kinks": self._kinks,
            "directions": self._directions,
        }


class Problem:
    """An optimal control problem with equations of one's own.

    >>> import apsides, numpy as np
    >>> problem = apsides.Problem("brachistochrone")
    >>> slide = problem.phase("slide", duration=(0.1, 10))
    >>> x = slide.state("x", unit="m", start=0, end=10)
    >>> y = slide.state("y", unit="m", start=10, end=5)
    >>> v = slide.state("v", unit="m/s", start=0)
    >>> angle = slide.control("angle", unit="deg", lower=0, upper=180)
    >>> slide.dynamics(x=v * np.sin(angle), y=-v * np.cos(angle), v=9.80665 * np.cos(angle))
    >>> problem.minimize(slide.final_time)
    >>> solution = problem.solve()
    >>> solution.verdict, round(solution.objective, 4)
    ('strict-local-optimum', 1.8016)
    """

    def __init__(self, name: str = "problem", title: str | None = None) -> None:
        self._places = arguments.Places()
        self.name = arguments.word(name, "the name of a problem", self._places) or "problem"
        self.title = arguments.word(title, "the title of a problem", self._places)
        self._owner = next(_owners)
        self._constants: dict[str, dict[str, Any]] = {}
        self._parameters: dict[str, dict[str, Any]] = {}
        self._phases: dict[str, Phase] = {}
        self._links: list[dict[str, Any]] = []
        self._boundary: list[dict[str, Any]] = []
        self._objective: dict[str, Any] | None = None
        self._motion: dict[str, Any] | None = None

    def __repr__(self) -> str:
        return f"<problem `{self.name}`: phases {list(self._phases)}>"

    def _check_name(self, name: Any, what: str, at: int) -> None:
        if not isinstance(name, str) or not _native.is_name(name):
            raise self._places.error(at, f"{what} is {name!r}, allowed are letters, digits and underscores that begin with a letter")

    def phase(self, name: str = "phase", *, start: Any = None, end: Any = None, duration: Any = None, unit: str | None = None) -> Phase:
        """Adds a phase. Times are a number, ``(least, most)`` with None for no bound, or ``"free"``, in ``unit`` (seconds where other units are declared)."""
        places = self._places
        at = places.here()
        self._check_name(name, "the name of a phase", at)
        if name in self._phases:
            raise places.error(at, f"there is a phase `{name}` already: choose another name")
        time = {"at": at, "unit": arguments.word(unit, f"`unit` of phase `{name}`", places)}
        for key, value in (("start", start), ("end", end), ("duration", duration)):
            time[key] = arguments.end(value, f"the {key} of phase `{name}`", places)
        found = Phase(self, name, time)
        self._phases[name] = found
        return found

    def constant(
        self, name: str, value: float, unit: str | None = None, *, lower: float | None = None, upper: float | None = None, meaning: str = ""
    ) -> Symbol:
        """Adds a constant that sweeps, sensitivities and ``solve(name=..)`` can change, and returns its symbol, in SI."""
        at = self._places.here()
        self._check_name(name, "the name of a constant", at)
        if not is_number(value):
            raise self._places.error(at, f"constant `{name}` is of type {type(value).__name__}, allowed is a number")
        for bound in (lower, upper):
            if bound is not None and not is_number(bound):
                raise self._places.error(at, f"a bound of constant `{name}` is of type {type(bound).__name__}, allowed is a number")
        self._constants[name] = {
            "name": name, "at": at, "value": float(value), "unit": arguments.word(unit, f"`unit` of constant `{name}`", self._places) or "",
            "lower": lower, "upper": upper, "meaning": arguments.word(meaning, f"`meaning` of constant `{name}`", self._places) or "",
        }
        return Symbol.quantity(self._owner, name, None, False)

    def parameter(
        self, name: str, *, lower: Any = None, upper: Any = None, unit: str | None = None, scale: Any = None, guess: Any = None,
    ) -> Symbol:
        """Adds an unknown constant of the whole problem, which the solve chooses, and returns its symbol, in SI."""
        places = self._places
        at = places.here()
        self._check_name(name, "the name of a parameter", at)
        stated = {"lower": lower, "upper": upper, "scale": scale, "guess": guess}
        self._parameters[name] = {
            "name": name, "at": at, "unit": arguments.word(unit, f"`unit` of parameter `{name}`", places) or "", "guard": (False, False), "start": None, "end": None, "tolerance": None, "rate": None,
            **{key: arguments.scalar(value, f"`{key}` of parameter `{name}`", places) for key, value in stated.items()},
        }
        return Symbol.quantity(self._owner, name, None, False)

    @property
    def p(self) -> np.ndarray:
        """The parameters so far, an array of symbols of shape (np,)."""
        return symbol_array(Symbol.quantity(self._owner, name, None, False) for name in self._parameters)

    def link(self, first: Phase, second: Phase, *, jump: Mapping[str, Any] | None = None, free: Iterable[str] = ()) -> None:
        """Joins the end of a phase to the start of another, in time and in every state that both have.

        ``jump`` has the amounts by which states change between them (``{"m": -2000}``, in the unit of the state), ``free`` the names of states
        that are not joined.
        """
        places = self._places
        at = places.here()
        names = [p.name if isinstance(p, Phase) else arguments.word(p, "a linked phase", places) for p in (first, second)]
        if None in names or not isinstance(jump, (Mapping, type(None))) or isinstance(free, str) or not isinstance(free, Iterable):
            raise places.error(at, "a link is of two phases, with `jump`, a dictionary of amounts, and `free`, a list of names of states")
        amounts = []
        for name, value in (jump or {}).items():
            name = arguments.symbol_name(name, "what jumps", places) if not isinstance(name, str) else name
            if value is None:
                raise places.error(at, f"the jump of `{name}` is None, allowed is a number or a formula of constants")
            amounts.append((name, arguments.scalar(value, f"the jump of `{name}`", places)))
        free = [arguments.symbol_name(name, "what is free", places) if not isinstance(name, str) else name for name in free]
        self._links.append({"from": names[0], "to": names[1], "at": at, "jump": amounts, "free": free})

    def _rows(
        self, constraint: Any, lower: Any, upper: Any, equals: Any, name: str, unit: str | None, scale: Any, guard: Any, at: int
    ) -> list[dict[str, Any]]:
        places = self._places
        self._check_name(name, "the name of a constraint", at)
        if callable(constraint) and not isinstance(constraint, Symbol):
            raise places.error(at, "a function is no constraint of ends: give its value at symbols such as `x.end`")
        if isinstance(constraint, (list, tuple, np.ndarray)) and np.ndim(constraint) > 0:
            rows = []
            flat = list(np.asarray(constraint, dtype=object).ravel())
            for k, item in enumerate(flat):
                low, high, same = (
                    v[k] if isinstance(v, (list, tuple, np.ndarray)) and len(v) == len(flat) else v for v in (lower, upper, equals)
                )
                rows.extend(self._rows(item, low, high, same, f"{name}_{k + 1}", unit, scale, guard, at))
            return rows
        if isinstance(constraint, (bool, np.bool_)):
            raise places.error(at, "a constraint of numbers alone leaves nothing to choose: compare formulas of states and controls")
        if constraint is None:
            raise places.error(at, f"constraint `{name}` is None, allowed is a comparison, or a formula with bounds")
        if isinstance(constraint, Condition):
            if lower is not None or upper is not None or equals is not None:
                raise places.error(at, "a comparison has its bound: leave `lower`, `upper` and `equals` away, or give them with a formula")
        else:
            constraint = arguments.scalar(constraint, f"constraint `{name}`", places)
            if equals is not None:
                lower = upper = equals
            if lower is None and upper is None:
                raise places.error(at, f"constraint `{name}` has no bound: compare it (`.. <= 1`), or state `lower`, `upper` or `equals`")
        return [{
            "name": name,
            "at": at,
            "formula": constraint,
            "unit": arguments.word(unit, f"`unit` of constraint `{name}`", places),
            "lower": arguments.scalar(lower, f"`lower` of constraint `{name}`", places),
            "upper": arguments.scalar(upper, f"`upper` of constraint `{name}`", places),
            "scale": arguments.scalar(scale, f"`scale` of constraint `{name}`", places),
            "guard": arguments.guards(guard, places),
        }]

    def constrain(
        self,
        constraint: Any,
        lower: Any = None,
        upper: Any = None,
        *,
        equals: Any = None,
        name: str | None = None,
        unit: str | None = None,
        scale: Any = None,
    ) -> None:
        """Adds a constraint of quantities at ends, durations, integrals and parameters: ``constrain(v.end**2 * r.end == mu)``."""
        at = self._places.here()
        rows = self._rows(constraint, lower, upper, equals, arguments.word(name, "the name of a constraint", self._places) or f"end{len(self._boundary) + 1}", unit, scale, False, at)
        self._boundary.extend(rows)

    def minimize(self, objective: Any, *, name: str | None = None, unit: str | None = None, scale: Any = None) -> None:
        """States the objective: a formula of values at ends, durations, integrals and parameters, in SI unless it has a ``unit``."""
        self._optimise(objective, False, name, unit, scale)

    def maximize(self, objective: Any, *, name: str | None = None, unit: str | None = None, scale: Any = None) -> None:
        """States the objective, to be as large as possible; as of `minimize`."""
        self._optimise(objective, True, name, unit, scale)

    def _optimise(self, objective: Any, maximize: bool, name: str | None, unit: str | None, scale: Any) -> None:
        places = self._places
        at = places.here()
        formula = arguments.scalar(objective, "the objective", places)
        if formula is None:
            raise places.error(at, "the objective is None, allowed is a formula of values at ends, integrals and parameters")
        self._objective = {
            "maximize": maximize, "formula": formula, "name": arguments.word(name, "the name of the objective", places),
            "unit": arguments.word(unit, "the unit of the objective", places), "at": at, "scale": arguments.scalar(scale, "the scale of the objective", places),
        }

    def motion(
        self,
        body: str,
        position: Any,
        velocity: Any,
        *,
        thrust: Any = None,
        mass: Any = None,
        axes: str = "inertial",
        site: Mapping[str, Any] | None = None,
    ) -> None:
        """Says where the flight is about a body, so that solutions have an ephemeris, its files (`Solution.write`) and the figures of a flight.

        ``position``, ``velocity`` and ``thrust`` are three formulas each, ``mass`` is one, all in SI, of states, controls, parameters and the time. With
        several phases they are a dictionary with those of each, by the phase or its name, or a function ``f(t, x, u, p)`` that is traced in each phase
        so far. ``body`` is a name of `apsides bodies` (Earth, Moon or Mars) or the path of such a file. ``axes`` are ``"inertial"`` at the centre of
        the body, ``"fixed"`` to it with velocities relative to it, or ``"site"``: to the east, to the north and upwards from
        ``site={"longitude": -19.5, "latitude": 44.1, "altitude": 0}``, in deg and m. The keys ``epoch`` and ``frame`` say when, and how inertial axes lie:
        ``solve(epoch="2030-01-01T00:00:00 TDB", frame__inclination_deg=51.6)``.
        """
        places = self._places
        at = places.here()
        if not self._phases:
            raise places.error(at, "a motion is of the quantities of phases: state the phases before")
        body, axes = (arguments.required_word(v, f"`{name}` of the motion", places) for name, v in (("body", body), ("axes", axes)))
        if (axes == "site") != (site is not None):
            raise places.error(at, "axes=\"site\" goes with a site: site={\"longitude\": -19.5, \"latitude\": 44.1}")
        stated_site = {key for key, value in site.items() if value is not None} if isinstance(site, Mapping) else set()
        if site is not None and not {"longitude", "latitude"} <= stated_site <= set(_SITE):
            raise places.error(at, "`site` is a dictionary with longitude and latitude in deg, and altitude in m where it is not zero")
        stated = {"position": (position, 3), "velocity": (velocity, 3), "thrust": (thrust, 3), "mass": (mass, 1)}
        for name in ("position", "velocity"):
            if stated[name][0] is None:
                raise places.error(at, f"the {name} is None, allowed are three formulas")
        self._motion = {
            "at": at,
            "body": body,
            "axes": axes,
            "site": None if site is None else tuple(arguments.scalar(site.get(key), f"the {key} of the site", places) for key in _SITE),
            **{name: self._motion_parts(name, value, size, at) for name, (value, size) in stated.items()},
        }

    def _motion_parts(self, what: str, value: Any, size: int, at: int) -> list[tuple[str, int, list[Any]]]:
        """Formulas of each phase: its name, the place, the components."""
        places = self._places
        if value is None:
            return []
        if not isinstance(value, Mapping):
            value = {phase: phase._call(value) if callable(value) else value for phase in self._phases.values()}
        parts = []
        for phase, formulas in value.items():
            name = phase.name if isinstance(phase, Phase) else phase
            if name not in self._phases:
                raise places.error(at, f"the {what} is stated for `{name}`; there are the phases {', '.join(self._phases)}")
            flat = list(np.asarray(formulas, dtype=object).ravel()) if not isinstance(formulas, Symbol) else [formulas]
            if len(flat) != size or any(f is None for f in flat):
                allowed = "one formula" if size == 1 else f"{size} formulas"
                raise places.error(at, f"the {what} has {len(flat)} components in phase `{name}`, allowed is {allowed}")
            parts.append((name, at, [arguments.scalar(f, f"the {what}", places) for f in flat]))
        return parts

    def _stated_motion(self) -> dict[str, Any] | None:
        """The motion; the formulas of an only phase are those of all."""
        if self._motion is None or len(self._phases) > 1:
            return self._motion
        parts = {key: [(None, *part[1:]) for part in self._motion[key]] for key in ("position", "velocity", "thrust", "mass")}
        return {**self._motion, **parts}

    def mission(self) -> Mission:
        """The problem as a `Mission`: its constants are keys, and it has the same methods.

        Raises `ProblemError` with the line of a mistake, or `IncompleteError` with all that is missing.
        """
        return Mission(_native.state({
            "owner": self._owner,
            "name": arguments.word(self.name, "the name of a problem", self._places) or "problem",
            "title": arguments.word(self.title, "the title of a problem", self._places),
            "constants": list(self._constants.values()),
            "parameters": list(self._parameters.values()),
            "phases": [phase._stated() for phase in self._phases.values()],
            "links": self._links,
            "boundary": self._boundary,
            "objective": self._objective,
            "guess": [phase._guess for phase in self._phases.values() if phase._guess is not None],
            "motion": self._stated_motion(),
            "places": self._places.places,
        }))

    def solve(self, method: str | None = None, **options: Any) -> Solution:
        """Solves the problem and verifies the answer; see `Mission.solve`."""
        return self.mission().solve(method, **options)

    def sweep(self, **axes: Any) -> list[Solution]:
        """Solves the problem for values of its constants; see `Mission.sweep`."""
        return self.mission().sweep(**axes)
