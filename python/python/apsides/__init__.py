"""Spaceflight trajectory optimisation with verified results.

Problems with equations of one's own (`Problem`), missions by name and from files (`mission`, `load`), nonlinear programs (`minimize`),
integration (`integrate`), search (`search`), hazard maps (`hazard`).
"""

from ._functions import (
    abs, arctan2, clip, cross, dot, hypot, max, min, norm, sign, smooth_abs, smooth_max, smooth_min, smooth_step, table, unit, where,
)
from ._hazard import HazardMap, hazard
from ._mission import Mission, load, mission, missions
from ._native import (
    Condition, Error, IncompleteError, ProblemError, SettingError, SolveError, Symbol, __version__,
)
from ._numerics import Event, Flight, Found, Minimum, integrate, jacobian, minimize, search
from ._problem import Phase, Problem
from ._solution import Certificate, PhaseSolution, Solution

__all__ = [
    "Certificate", "Condition", "Error", "Event", "Flight", "Found", "HazardMap", "Minimum", "IncompleteError", "Mission", "Phase", "PhaseSolution", "Problem", "ProblemError", "SettingError",
    "Solution", "SolveError", "Symbol", "abs", "arctan2", "clip", "cross", "dot", "hazard", "hypot", "integrate", "jacobian", "load", "max", "min", "minimize", "mission", "missions", "norm",
    "search",    "sign", "smooth_abs", "smooth_max", "smooth_min", "smooth_step", "table", "unit", "where",
]
