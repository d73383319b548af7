"""Problems stated in Python have the known optima of the literature, and those of the same problems in files."""

import importlib.util
import pathlib

import numpy as np
import pytest

import apsides

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILES = ROOT / "crates" / "apsides-problems" / "problems"

# The statements whose times the bench takes.
_spec = importlib.util.spec_from_file_location("gallery", ROOT / "python" / "benches" / "gallery.py")
gallery = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(gallery)

# Two solves of one problem on the same mesh: the formulas are the same up to the order of operations.
SAME = 1e-8

# Optima in closed form.
CLOSED_FORM = 1e-8


def brachistochrone():
    p = apsides.Problem("brachistochrone")
    ph = p.phase("slide", duration=(0.1, 10))
    x = ph.state("x", unit="m", start=0, end=10, lower=0, upper=10)
    y = ph.state("y", unit="m", start=0, end=5, lower=0, upper=10)
    v = ph.state("v", unit="m/s", start=0, lower=0, upper=20)
    angle = ph.control("angle", unit="deg", lower=0, upper=180)
    ph.dynamics(x=v * np.sin(angle), y=v * np.cos(angle), v=9.80665 * np.cos(angle))
    p.minimize(ph.final_time)
    return p


def cycloid():
    """The time to slide from rest to 10 m away and 5 m down: a cycloid (Johann Bernoulli, 1696)."""
    low, high = 0.1, 6.2
    for _ in range(200):
        middle = (low + high) / 2
        if (middle - np.sin(middle)) / (1 - np.cos(middle)) < 2:
            low = middle
        else:
            high = middle
    return low * np.sqrt(5 / (1 - np.cos(low)) / 9.80665)


def test_brachistochrone_is_the_cycloid():
    s = brachistochrone().solve()
    assert s.objective == pytest.approx(cycloid(), rel=SAME)
    assert s.success and s.verdict == "strict-local-optimum"
    assert s["x"][-1] == pytest.approx(10) and s.units["angle"] == "deg"
    assert s["angle"].max() <= 180.0 + 1e-6
    assert s.summary["objective"]["unit"] == "s"


def test_least_effort_in_vector_style():
    # Rest to rest over 1 m in 1 s: u = 6 - 12 t, the objective is 6 (A. E. Bryson and Y.-C. Ho, 1975).
    p = apsides.Problem("push")
    ph = p.phase("push", end=1)
    ph.states("x v", start=[0, 0], end=[1, 0])
    ph.control("u")
    ph.dynamics(lambda t, x, u: [x[1], u[0]])
    p.minimize(ph.integral(lambda t, x, u: u[0] ** 2 / 2))
    s = p.solve()
    assert s.objective == pytest.approx(6.0, rel=1e-9)
    assert s["u"][0] == pytest.approx(6.0, abs=1e-6)
    assert np.allclose(s["u"], 6 - 12 * s.time, atol=1e-6)


def test_linear_tangent_in_kilometres():
    # A. E. Bryson and Y.-C. Ho, Applied Optimal Control, 1975: 55.4570878 s.
    p = apsides.Problem("linear tangent")
    a = p.constant("acceleration", 10, "m/s2")
    ph = p.phase("ascent", end=(10, 200))
    ph.state("x", unit="km", lower=0, upper=30, start=0)
    vx = ph.state("vx", unit="m/s", lower=0, upper=1000, start=0, end=450)
    ph.state("y", unit="km", lower=0, upper=10, start=0, end=5)
    vy = ph.state("vy", unit="m/s", lower=-500, upper=500, start=0, end=0)
    angle = ph.control("angle", unit="deg", lower=-90, upper=90)
    ph.dynamics([vx, a * np.cos(angle), vy, a * np.sin(angle)])
    ph.guess([0, 60], x=[0, 12])
    p.minimize(ph.final_time)
    s = p.solve()
    assert s.objective == pytest.approx(55.4570878, rel=1e-8)
    assert s["y"][-1] == pytest.approx(5.0)
    price = s.sensitivity("acceleration")["acceleration"]["objective"]
    higher = p.solve(acceleration=10.01)
    lower = p.solve(acceleration=9.99)
    assert price == pytest.approx((higher.objective - lower.objective) / 0.02, rel=1e-4)
    cases = p.sweep(acceleration=[9, 10, 11])
    assert [c.case["acceleration"] for c in cases] == [9, 10, 11]
    assert cases[1].objective == pytest.approx(s.objective, rel=SAME)


def test_two_phases_with_a_link_and_a_jump():
    # A sounding rocket without drag: closed form of the example `own_mission` of apsides-pipeline.
    m0, propellant, thrust, c, g = 300.0, 120.0, 12_000.0, 230.0 * 9.80665, 9.80665
    p = apsides.Problem("sounding rocket")
    burn = p.phase("burn", end=(1, 200))
    h, v, m = burn.state("h", start=0), burn.state("v", start=0), burn.state("m", start=m0, end=(m0 - propellant, m0), lower=100, upper=400)
    k = burn.control("k", lower=0, upper=1)
    burn.dynamics(h=v, v=k * thrust / m - g, m=-k * thrust / c)
    burn.guess([0, 40], h=[0, 5000], v=[0, 300], m=[300, 180], k=0.5)
    coast = p.phase("coast", end=(1, 500))
    H, V = coast.state("h"), coast.state("v", end=0)
    coast.dynamics(h=V, v=-g)
    coast.guess([40, 70], h=[5000, 10000], v=[300, 0])
    p.link(burn, coast)
    p.maximize(H.end)
    s = p.solve()
    ratio, t = m0 / (m0 - propellant), propellant * c / thrust
    h1 = c * t * (1 - np.log(ratio) / (ratio - 1)) - g * t * t / 2
    v1 = c * np.log(ratio) - g * t
    assert s.objective == pytest.approx(h1 + v1 * v1 / (2 * g), rel=1e-7)
    assert s.phase("burn").time[-1] == pytest.approx(t, rel=1e-6)
    assert s["coast", "h"].size == s.phase("coast").time.size
    frame = s.to_pandas()
    assert set(frame["phase"]) == {"burn", "coast"}
    assert s.to_xarray().sizes["node"] == len(frame)


def test_parameters_and_constraints_of_ends():
    # The rectangle of largest area under y = 4 - x^2, as parameters of a phase without choice: (8/9) sqrt(12) = 32 / (3 sqrt 3) / 2 * 2.
    p = apsides.Problem("rectangle")
    ph = p.phase("run", end=1)
    z = ph.state("z", start=0)
    ph.dynamics(z=1.0)
    a = p.parameter("a", lower=0.1, upper=1.9, guess=1.0)
    b = p.parameter("b", lower=0.1, upper=4, guess=1.0)
    p.constrain(b <= 4 - a**2)
    p.constrain(z.end == 1)
    p.maximize(2 * a * b)
    s = p.solve()
    assert s.objective == pytest.approx(32 / (3 * np.sqrt(3)), rel=1e-8)
    assert s.parameters["a"] == pytest.approx(2 / np.sqrt(3), rel=1e-6)
    assert float(s["a"]) == s.parameters["a"]


def test_state_constraint():
    # A. E. Bryson, W. F. Denham, S. E. Dreyfus, 1963: for a limit l <= 1/6 the least effort is 4 / (9 l).
    limit = 0.1
    p = apsides.Problem("bryson-denham")
    ph = p.phase("path", end=1)
    x = ph.state("x", start=0, end=0, lower=0)
    v = ph.state("v", start=1, end=-1)
    u = ph.control("u")
    ph.dynamics(x=v, v=u)
    ph.path(x <= limit, name="ceiling")
    p.minimize(ph.integral(u**2 / 2))
    s = p.solve()
    assert s.objective == pytest.approx(4 / (9 * limit), rel=1e-6)
    assert s["ceiling"].max() <= limit + 1e-6


def test_where_and_abs_and_tables():
    # A road with a slow half: x' = speed(x), where the speed is 1 before x = 1 and 1/2 after it; 1 + 2 = 3 s.
    p = apsides.Problem("road")
    ph = p.phase("drive", duration=(0.1, 10))
    x = ph.state("x", start=0, end=2, lower=0, upper=2)
    throttle = ph.control("throttle", lower=0, upper=1)
    ph.dynamics(x=throttle * apsides.where(x < 1, 1.0, 0.5))
    p.minimize(ph.duration)
    assert p.solve().objective == pytest.approx(3.0, rel=1e-6)

    # The same by numpy.select, where the first condition that holds counts.
    q = apsides.Problem("lanes")
    ph = q.phase("drive", duration=(0.1, 10))
    x, throttle = ph.state("x", start=0, end=2, lower=0, upper=2), ph.control("throttle", lower=0, upper=1)
    ph.dynamics(x=throttle * np.select([x < 1, x < 3], [1.0, 0.5], 0.1))
    q.minimize(ph.duration)
    assert q.solve().objective == pytest.approx(3.0, rel=1e-6)

    speed = apsides.table(np.linspace(0, 2, 9), 1 + np.linspace(0, 2, 9))
    q = apsides.Problem("table")
    ph = q.phase("drive", duration=(0.1, 10))
    x = ph.state("x", start=0, end=2, lower=0, upper=2)
    throttle = ph.control("throttle", lower=0, upper=1)
    ph.dynamics(x=throttle * speed(x))
    q.minimize(ph.duration)
    # The integral of 1 / (1 + x).
    assert q.solve().objective == pytest.approx(np.log(3), rel=1e-7)

    xs, ys = np.linspace(0, 2, 7), np.linspace(0, 1, 6)
    plane = apsides.table(xs, 1 + xs[:, None] + 0 * ys[None, :], ys)
    assert plane(0.5, 0.3) == pytest.approx(1.5)
    assert np.allclose(plane(np.array([0.5, 1.0]), 0.3), [1.5, 2.0])


@pytest.mark.parametrize("method", ["radau", "multiple-shooting"])
def test_methods(method):
    s = brachistochrone().solve(method)
    assert s.summary["method"] == method
    assert s.objective == pytest.approx(cycloid(), rel=1e-7)


@pytest.mark.skipif(not FILES.is_dir(), reason="the problem files of the repository are not here")
@pytest.mark.parametrize("problem", gallery.STATEMENTS, ids=lambda problem: problem.__name__)
def test_the_same_optimum_as_the_file(problem):
    file = apsides.load(FILES / f"{problem.__name__}.toml").solve()
    here = problem().solve()
    assert here.objective == pytest.approx(file.objective, rel=SAME)
    assert here.verdict == file.verdict
    if problem in (gallery.van_der_pol, gallery.goddard_cops):
        # Counters, not times: the same formulas take the same work.
        assert here.counters == file.counters


def test_missions():
    assert "lunar-perilune" in apsides.missions()
    s = apsides.mission("lunar-perilune", perilune_altitude_km=20).solve()
    # The example of the Rust crate `apsides`.
    assert s.results["flight_time_s"] == pytest.approx(999.356984, abs=1e-5)
    assert s.certificate.is_verified
    assert s.mission.keys["perilune_altitude_km"] == 20.0
    again = s.mission.solve(start=s)
    assert again.counters["iterations"] < s.counters["iterations"]
    cheap = apsides.mission("lunar-perilune").solve(tolerance=1e-4)
    assert cheap.success


def test_report_and_certify(tmp_path):
    s = brachistochrone().solve()
    paths = s.report(tmp_path / "results")
    assert any(p.endswith("report.html") for p in paths)
    assert s.mission.certify(tmp_path / "results").verdict == s.verdict
    assert s.verify().verdict == s.verdict
    assert "<svg" in s._repr_html_()
    data = s.to_dict()
    assert data["phases"]["slide"]["x"][-1] == pytest.approx(10)
    sample = s.sample(11)
    assert sample["time"].shape == (11,)
    assert s.sample([0.0, 0.5])["x"][0] == pytest.approx(0)
    assert "verdict: strict-local-optimum" in repr(s.certificate)
    assert s.to_xarray()["x"].attrs["units"] == "m"


def test_progress_stops_and_raises():
    seen = []
    s = brachistochrone().solve(progress=seen.append)
    assert len(seen) >= s.counters["iterations"] and "objective" in seen[0]
    stopped = brachistochrone().solve(progress=lambda record: record["iteration"] < 3)
    assert stopped.status == "interrupted" and not stopped.success

    def fail(record):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        brachistochrone().solve(progress=fail)


def test_control_c():
    import _thread
    import signal
    import threading

    # Processes in the background of a shell ignore the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    def interrupt(record):
        if record["iteration"] == 2:
            _thread.interrupt_main()

    assert threading.current_thread() is threading.main_thread()
    try:
        with pytest.raises(KeyboardInterrupt):
            brachistochrone().solve(progress=interrupt)
    finally:
        signal.signal(signal.SIGINT, before)


def test_many_operations():
    # 1e5 operations whose sum is the simple problem.
    p = apsides.Problem("long")
    ph = p.phase("push", end=1)
    x, v = ph.state("x", start=0, end=1), ph.state("v", start=0, end=0)
    u = ph.control("u")
    force = u
    for k in range(50_000):
        force = (force + k) - k
    ph.dynamics(x=v, v=force)
    p.minimize(ph.integral(u**2 / 2))
    assert p.mission().name == "long"
    del force, p, ph


def test_deep_sharing():
    p = apsides.Problem("shared")
    ph = p.phase("run", end=1)
    x = ph.state("x", start=0)
    total = x
    for _ in range(200):
        total = total + total
    ph.dynamics(x=1.0)
    p.minimize(x.end)
    ph.path(total * 2.0**-200 <= 2)
    assert p.solve().success


def test_drag_from_rest():
    # A length without a width has no derivative at rest, where the certificate stops.
    def rocket(speed):
        p = apsides.Problem("rocket")
        ph = p.phase("rise", duration=(0.5, 20))
        x, y, vx, vy = ph.states("x y vx vy", start=0, end=["free", 10, 3, 0])
        angle = ph.control("angle", unit="deg", lower=-180, upper=180)
        drag = 0.05 * speed(vx, vy)
        ph.dynamics(x=vx, y=vy, vx=2 * np.cos(angle) - drag * vx, vy=2 * np.sin(angle) - drag * vy)
        p.minimize(ph.final_time)
        return p.solve()

    sharp = rocket(lambda vx, vy: np.sqrt(vx**2 + vy**2))
    smooth = rocket(lambda vx, vy: apsides.norm([vx, vy], 1e-4))
    assert smooth.objective == pytest.approx(sharp.objective, rel=1e-7)
    assert smooth.verdict == "strict-local-optimum"


def test_a_range_without_a_bound(tmp_path):
    # Down a slope of unit acceleration over at least 2 m in at least 1 s: 2 s.
    p = apsides.Problem("slope")
    ph = p.phase("run", duration=(1, None))
    x, v = ph.state("x", start=0, end=(2, None)), ph.state("v", start=(None, 0))
    a = ph.control("a", lower=0, upper=1)
    ph.dynamics(x=v, v=a)
    p.minimize(ph.duration)
    s = p.solve()
    assert s.objective == pytest.approx(2, rel=CLOSED_FORM)
    (tmp_path / "slope.toml").write_text(s.mission.to_file())
    assert apsides.load(tmp_path / "slope.toml").solve().objective == pytest.approx(s.objective, rel=SAME)


def test_the_file_of_a_problem(tmp_path):
    # A problem with units, links, jumps, tables, parameters, shared parts and a guess: its file gives the same optimum.
    density = apsides.table([0.0, 1e3, 2e3, 3e3, 4e3], [1.2, 1.0, 0.85, 0.7, 0.6])
    p = apsides.Problem("hop")
    thrust = p.constant("thrust", 0.3, "kN", lower=0.1, upper=1)
    up = p.phase("up", end=(0.1, 1), unit="min")
    h, v = up.state("h", unit="km", start=0), up.state("v", unit="m/s", start=0, end=(0, 200))
    k = up.control("k", lower=0, upper=1)
    drag = 1e-4 * density(h) * v**2
    up.dynamics(h=v, v=k * thrust / 10 - 9.81 - apsides.max(drag, 0.0))
    up.path(k * v, upper=180, unit="m/s", name="kv")
    up.guess([0, 0.5], h=[0, 1], k=0.5)
    coast = p.phase("coast", duration=(1, 60))
    H, V = coast.state("h", unit="km"), coast.state("v", unit="m/s", end=0)
    coast.dynamics(h=V, v=-9.81)
    coast.guess([30, 45], h=[1, 1.5], v=[100, 0])
    p.link(up, coast, jump={"v": -10})
    limit = p.parameter("limit", unit="km", lower=0, upper=1.5, guess=1)
    p.constrain(H.end <= limit)
    p.maximize(H.end - 10 * up.integral(k**2))
    s = p.solve()
    s.report(tmp_path / "results")
    again = apsides.load(tmp_path / "results" / "mission.toml").solve()
    assert s.success and again.objective == pytest.approx(s.objective, rel=SAME)
    assert again.counters == s.counters and again.units == s.units
    assert again.mission.certify(tmp_path / "results").verdict == s.verdict
    changed = p.mission().having(thrust=0.4)
    (tmp_path / "changed.toml").write_text(changed.to_file())
    assert apsides.load(tmp_path / "changed.toml").keys["constants.thrust"] == 0.4


def test_constants_and_settings_of_one_name():
    p = apsides.Problem("push")
    points = p.constant("points", 1.0)
    ph = p.phase("push", end=1)
    x, v, u = ph.state("x", start=0, end=points), ph.state("v", start=0, end=0), ph.control("u")
    ph.dynamics(x=v, v=u)
    p.minimize(ph.integral(u**2 / 2))
    # The effort grows with the square of the distance.
    assert p.solve(points=2).objective == pytest.approx(24.0, rel=1e-9)
    assert p.mission().having(**{"radau.points": 7}).keys["radau.points"] == 7


def test_every_method():
    expected = gallery.van_der_pol().solve().objective
    for method in ("multiple-shooting", "indirect", "piecewise", "successive-convexification"):
        assert gallery.van_der_pol().solve(method).objective == pytest.approx(expected, rel=1e-4), method


def test_ratio_of_integrals():
    # u = 2 (1 - t), by the inequality of Cauchy and Schwarz.
    p = apsides.Problem("ratio")
    ph = p.phase("a", end=1)
    x = ph.state("x", start=0, end=1)
    u = ph.control("u")
    ph.dynamics(x=u)
    p.minimize(ph.integral(u**2) / ph.integral(x) ** 2)
    s = p.solve()
    assert s.objective == pytest.approx(3, rel=1e-8)
    assert s.verdict == "strict-local-optimum"


def test_bound_on_a_ratio_of_integrals():
    # u = 3/2 (1 - t) + sqrt(3)/2.
    p = apsides.Problem("share")
    ph = p.phase("a", end=1)
    x = ph.state("x", start=0)
    u = ph.control("u")
    ph.dynamics(x=u)
    p.constrain(ph.integral(u**2) / ph.integral(x) <= 3)
    p.maximize(x.end)
    assert p.solve().objective == pytest.approx(0.75 + 0.75**0.5, rel=1e-8)


def test_a_thrust_that_is_vertical_at_the_end():
    p = apsides.Problem("thrust")
    ph = p.phase("run", end=1)
    x, v = ph.states("x v", start=0)
    angle = ph.control("angle", unit="deg", start=0, rate=(-180, 180))
    ph.dynamics(x=v, v=np.cos(angle))
    p.constrain(angle.end == np.pi / 2)
    p.maximize(x.end)
    s = p.solve()
    assert s.objective == pytest.approx(3 / 8 + 1 / np.pi**2, rel=CLOSED_FORM)
    assert s["angle"][-1] == pytest.approx(90, rel=CLOSED_FORM)
    assert np.abs(s["angle_rate"]).max() <= 180 * (1 + CLOSED_FORM)
