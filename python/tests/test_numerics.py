"""Nonlinear programs, integration, search and hazard maps."""

import numpy as np
import pytest

import apsides


def message(state):
    with pytest.raises(apsides.Error) as caught:
        state()
    return str(caught.value)


def test_hock_and_schittkowski():
    # W. Hock, K. Schittkowski, Test Examples for Nonlinear Programming Codes, 1981: problems 71, 35 and 28.
    bounds = [(1, 5)] * 4
    objective = lambda x: x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]  # noqa: E731
    by_tuple = apsides.minimize(
        objective, [1, 5, 5, 1], bounds=bounds,
        constraints=[(np.prod, 25, None), (lambda x: (x * x).sum(), 40, 40)],
    )
    by_dictionary = apsides.minimize(
        objective, [1, 5, 5, 1], bounds=bounds,
        constraints=[{"type": "ineq", "fun": lambda x: np.prod(x) - 25}, {"type": "eq", "fun": lambda x: x @ x - 40}],
    )
    for found in (by_tuple, by_dictionary):
        assert found.success and found.fun == pytest.approx(17.0140173, abs=1e-7)
    # At 17.0140173 the product is at its bound: a positive price of the lower bound is a negative multiplier.
    assert by_tuple.multipliers[0] < 0
    found = apsides.minimize(
        lambda x: 9 - 8 * x[0] - 6 * x[1] - 4 * x[2] + 2 * x[0] ** 2 + 2 * x[1] ** 2 + x[2] ** 2 + 2 * x[0] * x[1] + 2 * x[0] * x[2],
        [0.5, 0.5, 0.5], bounds=(0, None), constraints=lambda x: x[0] + x[1] + 2 * x[2] <= 3,
    )
    assert found.fun == pytest.approx(1 / 9, abs=1e-7)
    found = apsides.minimize(lambda x: (x[0] + x[1]) ** 2 + (x[1] + x[2]) ** 2, [-4, 1, 1],
                             constraints=lambda x: x[0] + 2 * x[1] + 3 * x[2] == 1)
    assert found.fun == pytest.approx(0, abs=1e-10)


def test_rosenbrock_in_many_variables():
    rosen = lambda x: (100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2).sum()  # noqa: E731
    found = apsides.minimize(rosen, np.full(200, -1.0))
    assert found.success and np.allclose(found.x, 1, atol=1e-6)


def test_mistakes_of_programs():
    f = lambda x: x[0] ** 2  # noqa: E731
    assert "no elements" in message(lambda: apsides.minimize(f, []))
    assert "2 pairs" in message(lambda: apsides.minimize(f, [1.0], bounds=[(0, 1), (0, 1)]))
    assert "smaller one" in message(lambda: apsides.minimize(f, [1.0], bounds=[(1, 0)]))
    assert "one formula" in message(lambda: apsides.minimize(lambda x: [x[0], x[0]], [1.0]))
    assert "NoneType" in message(lambda: apsides.minimize(lambda x: None, [1.0]))
    assert "no bounds" in message(lambda: apsides.minimize(f, [1.0], constraints=lambda x: x[0]))
    assert "NaN" in message(lambda: apsides.minimize(f, [np.nan]))
    assert "tolerance" in message(lambda: apsides.minimize(f, [1.0], tolerance=-1))
    assert "not a number" in message(lambda: apsides.minimize(lambda x: x[0] * np.nan, [1.0]))
    assert "max_iterations" in message(lambda: apsides.minimize(f, [1.0], max_iterations=-3))
    assert apsides.minimize(f, [1.0], constraints=lambda x: []).success
    with pytest.raises(IndexError):
        apsides.minimize(lambda x: x[3], [1.0])
    keep = []
    apsides.minimize(lambda x: keep.append(x[0]) or x[0] ** 2, [1.0])
    assert "another one" in message(lambda: apsides.minimize(lambda x: keep[0] ** 2, [1.0]))
    infeasible = apsides.minimize(f, [1.0], constraints=[(f, None, -1)])
    assert not infeasible.success and infeasible.status == "infeasible" and "infeasibility" in infeasible.message


def test_jacobian():
    values, rows = apsides.jacobian(lambda x: [np.arctan2(x[0], x[1]), np.hypot(x[0], x[1]), 3], [3.0, 4.0])
    assert np.allclose(values, [np.arctan2(3, 4), 5, 3], rtol=1e-15)
    assert np.allclose(rows, [[4 / 25, -3 / 25], [3 / 5, 4 / 5], [0, 0]], rtol=1e-15)


def test_every_function_against_numpy():
    at = np.array([0.3, 0.7])
    functions = [
        np.sin, np.cos, np.tan, np.arcsin, np.arccos, np.arctan, np.sinh, np.cosh, np.tanh, np.arcsinh, np.arctanh, np.exp, np.exp2, np.log,
        np.log2, np.log10, np.sqrt, np.cbrt, np.square, np.deg2rad, np.rad2deg, np.radians, np.degrees, np.negative, np.absolute, apsides.abs,
        apsides.sign, lambda x: x**3, lambda x: 2.0**x, lambda x: x**0.5, lambda x: 1 / x, lambda x: x**-2,
    ]
    for f in functions:
        values, _ = apsides.jacobian(lambda x: f(x), at)
        assert np.allclose(values, f(at), rtol=1e-14), f
    values, _ = apsides.jacobian(lambda x: np.arccosh(1 + x), at)
    assert np.allclose(values, np.arccosh(1 + at), rtol=1e-14)


def test_functions_that_take_no_symbols():
    for f in (np.isnan, np.logaddexp.reduce, lambda x: np.interp(x[0], [0, 1], [0, 1]), lambda x: np.linalg.inv(np.outer(x, x))):
        with pytest.raises(TypeError, match="does not take symbols|not known while"):
            apsides.jacobian(f, [0.3, 0.7])
    for f in (np.log1p, np.expm1, np.reciprocal):
        assert np.allclose(apsides.jacobian(f, [0.3, 0.7])[0], f(np.array([0.3, 0.7])), rtol=1e-14)


def test_arrays_of_symbols():
    def f(x):
        matrix = np.array([[1.0, 2.0], [3.0, 4.0]])
        y = matrix @ x
        return [y.sum(), np.dot(x, x), apsides.norm(x), *apsides.cross([x[0], x[1], 0], [0, 0, 1]), np.float64(2) * x[0], x[0] * np.float32(2),
                apsides.max(x), apsides.min(x[0], 0.5, x[1]), apsides.clip(x[0], 0.4, 0.5), apsides.where(x > 0.5, x, 0.0).sum(),
                np.where(x > 0.5, x, 0.0).sum(), np.linalg.norm(x), np.maximum(x, 0.5)[0], np.minimum(x[0], 0.1), np.clip(x[1], 0, 0.5),
                np.sign(x[0]), (np.array([1.0, 2.0]) * x[0]).sum(), (x[1] * np.array([1.0, 2.0]))[1]]

    values, _ = apsides.jacobian(f, [0.3, 0.7])
    assert np.allclose(values, [1.7 + 3.7, 0.58, np.sqrt(0.58), 0.7, -0.3, 0, 0.6, 0.6, 0.7, 0.3, 0.4, 0.7, 0.7, np.sqrt(0.58), 0.5, 0.1, 0.5,
                                1, 0.9, 1.4], rtol=1e-14)


def test_integration():
    oscillator = apsides.integrate(lambda t, y: [y[1], -y[0]], (0, 2 * np.pi), [1, 0], t_eval=np.linspace(0, 2 * np.pi, 9))
    assert oscillator.success and np.allclose(oscillator.y[0], np.cos(oscillator.t), atol=1e-9)
    crossing = lambda t, y: y[0]  # noqa: E731
    crossing.direction = -1
    found = apsides.integrate(lambda t, y: [y[1], -y[0]], (0, 10), [1, 0], events=[crossing])
    assert np.allclose(found.t_events[0], [np.pi / 2, 5 * np.pi / 2], atol=1e-9)
    assert found.y_events[0].shape == (2, 2)
    driven = apsides.integrate(lambda t, y: np.cos(t), (0, 1), 0.0)
    assert driven.end_state[0] == pytest.approx(np.sin(1), abs=1e-10)
    pole = apsides.integrate(lambda t, y: y**2, (0, 2), 1.0)
    assert not pole.success and pole.end_time < 1.01
    assert "2 rates" in message(lambda: apsides.integrate(lambda t, y: [y[0], y[0]], (0, 1), [1.0]))
    assert "dop853" in message(lambda: apsides.integrate(lambda t, y: y, (0, 1), [1.0], method="RK45"))
    assert "finite" in message(lambda: apsides.integrate(lambda t, y: y, (0, np.inf), [1.0]))
    assert "tolerance" in message(lambda: apsides.integrate(lambda t, y: y, (0, 1), [1.0], rtol=-1))
    assert "max_steps" in message(lambda: apsides.integrate(lambda t, y: y, (0, 1), [1.0], max_steps=-1))


def test_search():
    def rastrigin(x):
        return float(20 + (x**2 - 10 * np.cos(2 * np.pi * x)).sum())

    first = apsides.search(rastrigin, [(-5, 5)] * 2, budget=6000, seed=3)
    again = apsides.search(rastrigin, [(-5, 5)] * 2, budget=6000, seed=3)
    assert first.fun < 1e-8 and np.array_equal(first.x, again.x)
    ball = apsides.search(lambda x: (float(((x - 2) ** 2).sum()), [float((x**2).sum()) - 9]), [(-5, 5)] * 3, budget=20_000)
    assert ball.feasible and ball.fun == pytest.approx((np.sqrt(12) - 3) ** 2, abs=1e-3)

    def fail(x):
        raise ZeroDivisionError("here")

    with pytest.raises(ZeroDivisionError, match="here"):
        apsides.search(fail, [(0, 1)])
    assert "NoneType" in message(lambda: apsides.search(lambda x: None, [(0, 1)]))
    assert "method" in message(lambda: apsides.search(rastrigin, [(0, 1)], method="luck"))
    assert "budget" in message(lambda: apsides.search(rastrigin, [(0, 1)], budget=0))


def test_hazard():
    rows, columns = np.mgrid[0:120, 0:100]
    heights = 0.5 * columns * np.tan(np.radians(5.0))
    heights[60, 50] += 2.0
    heights[20, 20] = np.nan
    found = apsides.hazard(heights, 0.5)
    assert found.safe.shape == (120, 100)
    # A plane of 5 deg has this slope wherever the footprint has no rock and no gap.
    assert found["slope"][100, 80] == pytest.approx(np.radians(5.0), abs=1e-6)
    assert not found.safe[60, 50] and found.verdict[20, 20] == -1
    [site] = found.sites()
    assert site["clearance_m"] == pytest.approx(float(found.clearance.max()), rel=1e-6)
    assert not apsides.hazard(heights, 0.5, slope_max_deg=4.0).safe.any()
    assert "shape" in message(lambda: apsides.hazard(np.zeros(3), 1.0))
    assert "alhat" in message(lambda: apsides.hazard(heights, 1.0, "mars"))
    assert len(message(lambda: apsides.hazard(heights, -1.0))) > 10
    assert "slop" in message(lambda: apsides.hazard(heights, 1.0, slop=1))
