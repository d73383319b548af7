"""Mistakes are exceptions of the package, with a sentence and the line where they stand."""

import math

import numpy as np
import pytest

import apsides


def begun():
    p = apsides.Problem("test")
    ph = p.phase("run", end=1)
    return p, ph, ph.state("x", start=0), ph.state("v", start=0), ph.control("u", lower=-1, upper=1)


def complete():
    p, ph, x, v, u = begun()
    ph.dynamics(x=v, v=u)
    p.maximize(x.end)
    return p, ph, x, v, u


def message(state):
    with pytest.raises(apsides.Error) as caught:
        state()
    return str(caught.value)


def test_a_choice_in_python():
    _, _, x, v, _ = begun()
    for choice in (lambda: 1 if x > 0 else 2, lambda: bool(x), lambda: min(x, v), lambda: 0 < x < 1, lambda: x > 0 and v > 0):
        with pytest.raises(TypeError, match="apsides.where"):
            choice()
    with pytest.raises(TypeError, match="numpy"):
        math.sin(x)
    with pytest.raises(TypeError):
        float(x)
    with pytest.raises(TypeError, match="!="):
        x != v
    with pytest.raises(TypeError, match="=="):
        apsides.where(x == 1, 1, 2)


def test_what_is_missing_is_one_message():
    p = apsides.Problem("nothing")
    with pytest.raises(apsides.IncompleteError) as caught:
        p.solve()
    assert "a phase" in str(caught.value) and "the objective" in str(caught.value)
    ph = p.phase("run")
    ph.state("x")
    with pytest.raises(apsides.IncompleteError) as caught:
        p.solve()
    text = str(caught.value)
    for part in ("end time of phase `run`", "start of `x`", "rate of `x`", "the objective", "phase.dynamics(x=..)"):
        assert part in text


def test_mistakes_have_their_line():
    p, ph, x, v, u = complete()
    ph.path(x**2, upper=-1, lower=1)
    text = message(p.mission)
    assert "test_mistakes.py, line" in text and "ph.path(x**2, upper=-1, lower=1)" in text


@pytest.mark.parametrize(
    ("mistake", "part"),
    [
        (lambda p, ph, x, v, u: ph.state("x", start=0), "already"),
        (lambda p, ph, x, v, u: ph.state("2x", start=0), "letters"),
        (lambda p, ph, x, v, u: ph.state("sin", start=0), "meaning in formulas"),
        (lambda p, ph, x, v, u: ph.state("y", start=math.nan), "nan"),
        (lambda p, ph, x, v, u: ph.state("y", start=0, lower=1, upper=-1), "bounds"),
        (lambda p, ph, x, v, u: ph.state("y", start=5, upper=1), "outside its bounds"),
        (lambda p, ph, x, v, u: ph.state("y", start=(0, 1, 2)), "3 numbers"),
        (lambda p, ph, x, v, u: ph.state("y", start="here"), "\"here\""),
        (lambda p, ph, x, v, u: ph.state("y", start=0, unit="furlong"), "furlong"),
        (lambda p, ph, x, v, u: ph.state("y", start=0, scale=-1), "above zero"),
        (lambda p, ph, x, v, u: ph.control("w", lower="0"), "allowed is a number"),
        (lambda p, ph, x, v, u: ph.control("w", upper=x), "no constant"),
        (lambda p, ph, x, v, u: ph.control("w", guard="both"), "guard"),
        (lambda p, ph, x, v, u: ph.control("w", end=0), "limit its rate"),
        (lambda p, ph, x, v, u: ph.control("w", rate=1), "(least, most)"),
        (lambda p, ph, x, v, u: ph.control("w", rate=(2, 1)), "bounds"),
        (lambda p, ph, x, v, u: ph.dynamics([v]), "these are 1 rates"),
        (lambda p, ph, x, v, u: ph.dynamics(lambda t, x, u: None), "returns None"),
        (lambda p, ph, x, v, u: ph.dynamics(w=v), "no state `w`"),
        (lambda p, ph, x, v, u: ph.dynamics(x=v > 0), "comparison"),
        (lambda p, ph, x, v, u: ph.dynamics(x=math.nan * v), "not a number"),
        (lambda p, ph, x, v, u: ph.dynamics(x="v"), "formula"),
        (lambda p, ph, x, v, u: ph.dynamics(x=x.end), "quantity of an end"),
        (lambda p, ph, x, v, u: p.minimize(x), "many values"),
        (lambda p, ph, x, v, u: p.minimize(u), "control"),
        (lambda p, ph, x, v, u: p.minimize(None), "None"),
        (lambda p, ph, x, v, u: p.minimize((x * v).end), "only a state"),
        (lambda p, ph, x, v, u: ph.path(ph.integral(u**2) <= 1), "quantity of an end"),
        (lambda p, ph, x, v, u: p.constrain(u.end == 0), "control"),
        (lambda p, ph, x, v, u: p.constrain(x.end), "no bound"),
        (lambda p, ph, x, v, u: p.constrain(x.end == 1, upper=3), "has its bound"),
        (lambda p, ph, x, v, u: p.constrain(True), "numbers alone"),
        (lambda p, ph, x, v, u: ph.path(u), "no bound"),
        (lambda p, ph, x, v, u: ph.path(0 * u + 1 <= 2) or ph.path(1, upper=2), "nothing is left"),
        (lambda p, ph, x, v, u: ph.guess([1, 0]), "increase"),
        (lambda p, ph, x, v, u: ph.guess([0, math.inf]), "increase"),
        (lambda p, ph, x, v, u: ph.guess(y=1), "no state and no control `y`"),
        (lambda p, ph, x, v, u: ph.guess(x=[0, math.nan]), "finite"),
        (lambda p, ph, x, v, u: ph.guess(x=v), "v"),
        (lambda p, ph, x, v, u: ph.guess(x=[[], 1.0]), "list of numbers"),
        (lambda p, ph, x, v, u: ph.kink(x, math.inf), "finite"),
        (lambda p, ph, x, v, u: p.link(ph, ph, jump={"x": None}), "None"),
        (lambda p, ph, x, v, u: p.link(ph, ph, jump={3: 1.0}), "allowed is the symbol of a state"),
        (lambda p, ph, x, v, u: p.constrain(x.end >= math.inf), "not finite"),
        (lambda p, ph, x, v, u: p.phase("run"), "already"),
        (lambda p, ph, x, v, u: p.phase("a b"), "letters"),
        (lambda p, ph, x, v, u: p.link(ph, "coast"), "no phase is named `coast`"),
        (lambda p, ph, x, v, u: p.link(ph, ph), "itself"),
        (lambda p, ph, x, v, u: p.constant("c", math.inf), "finite"),
        (lambda p, ph, x, v, u: p.constant("c", "1"), "number"),
        (lambda p, ph, x, v, u: p.constant("x", 1.0), "already"),
        (lambda p, ph, x, v, u: p.parameter("q", lower=2, upper=1), "bounds"),
        (lambda p, ph, x, v, u: ph.kink(u, 1.0), "no state `u`"),
        (lambda p, ph, x, v, u: ph.direction(x), "no control `x`"),
    ],
)
def test_refused(mistake, part):
    def state():
        parts = complete()
        mistake(*parts)
        if "y" in parts[1]._states:
            parts[1].dynamics(y=parts[4])
        parts[0].mission()

    assert part in message(state)


def test_symbols_of_other_phases_and_problems():
    p, ph, x, v, u = complete()
    other = p.phase("coast", end=2)
    y = other.state("y", start=0)
    other.dynamics(y=x)
    assert "of phase `run`" in message(p.mission)
    other.dynamics(y=complete()[2])
    assert "another problem" in message(p.mission)
    other.dynamics(y=y)
    assert p.mission().name == "test"


def test_tables():
    for make in (
        lambda: apsides.table([0, 1, 2, 3], [0, 1, 2]),
        lambda: apsides.table([0, 1, 1, 3], [0, 1, 2, 3]),
        lambda: apsides.table([0, 1, 2, 3], [0, 1, math.nan, 3]),
        lambda: apsides.table([0, 1], [0, 1]),
        lambda: apsides.table([0, 1, 2, 3], [0, 1, 2, 3], shape="cubic"),
        lambda: apsides.table([0, 1, 2, 3], [0, 1, 2, 3], name=3),
        lambda: apsides.table([0, 1, 2, 3], np.zeros((4, 4)), [0, 1, 2, 3], shape="monotone"),
    ):
        assert len(message(make)) > 20
    # Whoever interpolates by NumPy or SciPy is led to a table.
    _, _, x, _, _ = begun()
    with pytest.raises(TypeError, match="apsides.table"):
        np.interp(x, [0, 1, 2, 3], [0, 1, 2, 3])
    with pytest.raises(TypeError, match="apsides.table"):
        float(x)
    with pytest.raises(TypeError, match="1 variable"):
        apsides.table([0, 1, 2, 3], [0, 1, 2, 3])(1, 2)


def test_settings():
    p = complete()[0]
    assert "method" in message(lambda: p.solve("raddau"))
    assert "radau.points" in message(lambda: p.solve(settings={"radau.pionts": 5}))
    assert "points" in message(lambda: p.solve(points=-3))
    assert "points" in message(lambda: p.solve(points=[1, 2]))
    assert "threads" in message(lambda: p.solve(threads=0))
    assert "threads" in message(lambda: p.solve(threads=1.5))
    assert "seed" in message(lambda: p.solve(seed=-1))
    assert "lunar-perilune" in message(lambda: apsides.mission("lunar-perilun"))
    assert "no such file" in message(lambda: apsides.load("nothing.toml"))
    with pytest.raises(apsides.SettingError, match="perilune_altitude_km"):
        apsides.mission("lunar-perilune", perilune_altitude=20)


def test_what_cannot_be_flown_is_explained():
    p, ph, x, v, u = complete()
    p.constrain(x.end >= 3, name="far")
    s = p.solve()
    assert not s.success and s.status == "infeasible"
    assert "far" in s.message


def test_unknown_quantities():
    s = complete()[0].solve()
    with pytest.raises(KeyError, match="`x`"):
        s["y"]
    for unknown in ("walk", 1):
        with pytest.raises(KeyError, match="run"):
            s.phase(unknown)
    with pytest.raises(KeyError):
        s.costate("u")
    assert message(lambda: s.sample(0))
    assert "outside" in message(lambda: s.sample([0.5, 2.0]))
    assert "outside" in message(lambda: s.sample([math.nan]))


def test_units():
    assert apsides.unit("km") == 1000.0
    assert "furlong" in message(lambda: apsides.unit("furlong"))
