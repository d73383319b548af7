"""Every argument with values of every wrong sort: an exception with a sentence, or a problem that is refused or solved; never a panic."""

import math

import numpy as np
import pytest

import apsides


def fresh(name="right"):
    p = apsides.Problem(name)
    ph = p.phase("run", end=1)
    x, u = ph.state("x", start=0), ph.control("u", lower=-1, upper=1)
    ph.dynamics(x=u)
    p.maximize(x.end)
    return p, ph, x, u


FOREIGN = fresh("other")[2]

VALUES = {
    "none": None, "text": "a", "empty text": "", "nan": math.nan, "inf": math.inf, "minus inf": -math.inf, "huge": 1e308, "tiny": 5e-324,
    "zero": 0, "negative": -1.0, "list": [], "pair": (1.0, 0.0), "triple": [1, 2, 3], "dictionary": {}, "object": object(), "flag": True,
    "complex": 1j, "array": np.zeros(3), "matrix": np.zeros((2, 2)), "integer array": np.arange(2), "foreign": FOREIGN, "comparison": FOREIGN > 1,
    "function": lambda *a: None, "class": dict, "bytes": b"a", "number of numpy": np.float32(2),
}

USES = {
    "phase name": lambda p, ph, x, u, v: p.phase(v),
    "phase start": lambda p, ph, x, u, v: p.phase("b", start=v),
    "phase end": lambda p, ph, x, u, v: setattr(ph, "_time", p.phase("b", end=v)._time),
    "phase duration": lambda p, ph, x, u, v: setattr(ph, "_time", p.phase("b", duration=v)._time),
    "phase unit": lambda p, ph, x, u, v: p.phase("b", unit=v),
    "state name": lambda p, ph, x, u, v: ph.state(v, start=0),
    "state start": lambda p, ph, x, u, v: ph.state("y", start=v),
    "state end": lambda p, ph, x, u, v: ph.state("y", start=0, end=v),
    "state lower": lambda p, ph, x, u, v: ph.state("y", start=0, lower=v),
    "state upper": lambda p, ph, x, u, v: ph.state("y", start=0, upper=v),
    "state unit": lambda p, ph, x, u, v: ph.state("y", start=0, unit=v),
    "state scale": lambda p, ph, x, u, v: ph.state("y", start=0, scale=v),
    "state tolerance": lambda p, ph, x, u, v: ph.state("y", start=0, tolerance=v),
    "state guard": lambda p, ph, x, u, v: ph.state("y", start=0, guard=v),
    "states": lambda p, ph, x, u, v: ph.states(v, start=0),
    "states start": lambda p, ph, x, u, v: ph.states("y z", start=v),
    "control lower": lambda p, ph, x, u, v: ph.control("w", lower=v),
    "dynamics": lambda p, ph, x, u, v: ph.dynamics(v),
    "rate": lambda p, ph, x, u, v: ph.dynamics(x=v),
    "factor": lambda p, ph, x, u, v: ph.dynamics(x=u * v),
    "power": lambda p, ph, x, u, v: ph.dynamics(x=u**v),
    "where": lambda p, ph, x, u, v: ph.dynamics(x=apsides.where(x > 0, v, u)),
    "condition": lambda p, ph, x, u, v: ph.dynamics(x=apsides.where(v, 1.0, u)),
    "max": lambda p, ph, x, u, v: ph.dynamics(x=apsides.max(u, v)),
    "path": lambda p, ph, x, u, v: ph.path(v),
    "path upper": lambda p, ph, x, u, v: ph.path(x, upper=v),
    "path name": lambda p, ph, x, u, v: ph.path(x <= 1, name=v),
    "path unit": lambda p, ph, x, u, v: ph.path(x <= 1, unit=v),
    "integral": lambda p, ph, x, u, v: ph.integral(v),
    "integral bound": lambda p, ph, x, u, v: ph.integral(u, upper=v),
    "kink": lambda p, ph, x, u, v: ph.kink(x, v),
    "kink of": lambda p, ph, x, u, v: ph.kink(v, 1.0),
    "direction": lambda p, ph, x, u, v: ph.direction(v),
    "guess time": lambda p, ph, x, u, v: ph.guess(v),
    "guess": lambda p, ph, x, u, v: ph.guess(x=v),
    "constant": lambda p, ph, x, u, v: p.constant("c", v),
    "constant name": lambda p, ph, x, u, v: p.constant(v, 1.0),
    "constant lower": lambda p, ph, x, u, v: p.constant("c", 1.0, lower=v),
    "parameter guess": lambda p, ph, x, u, v: p.parameter("q", guess=v),
    "parameter lower": lambda p, ph, x, u, v: p.parameter("q", lower=v),
    "constrain": lambda p, ph, x, u, v: p.constrain(v),
    "constrain equals": lambda p, ph, x, u, v: p.constrain(x.end, equals=v),
    "minimize": lambda p, ph, x, u, v: p.minimize(v),
    "objective unit": lambda p, ph, x, u, v: p.minimize(x.end, unit=v),
    "objective name": lambda p, ph, x, u, v: p.minimize(x.end, name=v),
    "link": lambda p, ph, x, u, v: p.link(ph, v),
    "jump": lambda p, ph, x, u, v: p.link(ph, ph, jump=v),
    "table": lambda p, ph, x, u, v: apsides.table(v, [1, 2, 3, 4]),
    "table values": lambda p, ph, x, u, v: apsides.table([1, 2, 3, 4], v),
    "table at": lambda p, ph, x, u, v: ph.dynamics(x=u * apsides.table([1, 2, 3, 4], [1, 2, 3, 4])(v)),
    "method": lambda p, ph, x, u, v: p.solve(v),
    "setting": lambda p, ph, x, u, v: p.solve(points=v),
    "tolerance": lambda p, ph, x, u, v: p.solve(tolerance=v) if v is not VALUES["tiny"] else None,
    "start": lambda p, ph, x, u, v: p.solve(start=v),
    "settings": lambda p, ph, x, u, v: p.solve(settings=v),
    "mission": lambda p, ph, x, u, v: apsides.mission(v),
    "load": lambda p, ph, x, u, v: apsides.load(v),
    "title": lambda p, ph, x, u, v: setattr(p, "title", v),
    "name": lambda p, ph, x, u, v: setattr(p, "name", v),
}

#: Operators with what they do not take are mistakes of Python's own.
ALLOWED = (apsides.Error, TypeError)


WORDS = ("operand", "multiply sequence", "traced", "apsides.", "`!=`", "expected at most 1")


@pytest.mark.parametrize("use", USES)
def test_values(use):
    refused = 0
    for sort, value in VALUES.items():
        parts = fresh()
        try:
            USES[use](*parts, value)
            for name in [n for n in parts[1]._states if n not in parts[1]._dynamics]:
                parts[1]._dynamics[name] = (0, parts[3])
            parts[0].mission()
        except ALLOWED as e:
            refused += 1
            assert len(str(e)) > 12, (sort, repr(e))
            assert isinstance(e, apsides.Error) or any(w in str(e) for w in WORDS), (sort, repr(e))
    assert refused >= 1 or use in ("title", "objective name")
