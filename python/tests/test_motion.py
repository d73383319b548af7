"""Problems that say where their flight is about a body: ephemerides, their files, and statements that are refused."""

import json
import pathlib

import numpy as np
import pytest

import apsides

# Accuracy that files of an ephemeris must have, m and m/s.
POSITION, VELOCITY = 1.0, 1e-3

MU, RADIUS = 4902.8001e9, 1837.4e3


def orbit(phases=2):
    """A part of a circular orbit about the Moon in polar coordinates: a coast of 1000 s, then one of 500 s whose engine is switched off."""
    p = apsides.Problem("orbit")
    times = {"coast": {"end": 1000}, "idle": {"end": (1500, 1501)}}
    made, places, speeds, thrusts = [], {}, {}, {}
    for name in list(times)[2 - phases :]:
        ph = p.phase(name, **times[name])
        fixed = [None] * 4 if made else [RADIUS / 1e3, 0, 0, np.sqrt(MU / RADIUS)]
        r = ph.state("r", unit="km", lower=1700, upper=2000, start=fixed[0])
        angle = ph.state("angle", unit="deg", lower=-10, upper=200, start=fixed[1])
        up = ph.state("up", unit="m/s", lower=-100, upper=100, start=fixed[2])
        along = ph.state("along", unit="m/s", lower=1000, upper=2000, start=fixed[3])
        push = ph.control("push", unit="N", lower=0, upper=1) if name == "idle" else 0
        ph.dynamics(r=up, angle=along / r, up=along**2 / r - MU / r**2, along=-up * along / r + 1e-9 * push)
        cos, sin = np.cos(angle), np.sin(angle)
        places[ph] = (r * cos, r * sin, 0)
        speeds[name] = np.array([up * cos - along * sin, up * sin + along * cos, 0])
        thrusts[ph] = (push, 0, 0)
        made.append(ph)
    if phases == 2:
        p.link(*made)
    p.minimize(made[-1].final_time)
    return p, places, speeds, thrusts


def placed():
    p, places, speeds, thrusts = orbit()
    p.motion("moon", places, speeds, thrust=thrusts, mass=1200)
    return p


def circle(times):
    """Position and velocity in the axes of the ICRF: the plane is turned by the keys of the frame, node, then inclination."""
    rate = np.sqrt(MU / RADIUS**3)
    (sn, cn), (si, ci) = ((np.sin(a), np.cos(a)) for a in np.radians([40, 51.6]))
    turn = np.array([[cn, -sn * ci], [sn, cn * ci], [0, si]])
    cos, sin = np.cos(rate * times), np.sin(rate * times)
    return RADIUS * np.stack([cos, sin], 1) @ turn.T, RADIUS * rate * np.stack([-sin, cos], 1) @ turn.T


def vectors(table, what, unit):
    return np.stack([table[f"{what}_icrf_{axis}_{unit}"] for axis in "xyz"], 1)


@pytest.fixture(scope="module")
def solution():
    values = {"frame__reference": "icrf", "frame__node_deg": 40, "frame__inclination_deg": 51.6}
    return placed().solve(epoch="2027-05-04T03:02:01 TAI", **values)


def test_formulas_are_an_orbit(solution):
    table = solution.ephemeris(points=51)
    assert solution.success and list(dict.fromkeys(table["phase"])) == ["coast", "idle"]
    position, velocity = circle(table["time_s"])
    assert np.abs(vectors(table, "position", "m") - position).max() < POSITION
    assert np.abs(vectors(table, "velocity", "m_per_s") - velocity).max() < VELOCITY
    assert (table["mass_kg"] == 1200).all() and "thrust_N" in table
    assert table["epoch_tai"][0].startswith("2027-05-04T03:02:01")
    assert len(solution.ephemeris(step="500s")["time_s"]) == len(solution.ephemeris(step=500)["time_s"]) == 5


def test_files_are_written(solution, tmp_path):
    written = solution.write(tmp_path, "oem, opm,czml,csv", points=30)
    names = [pathlib.Path(path).name for path in written]
    assert sorted(names) == ["ephemeris.csv", "ephemeris.czml", "ephemeris.oem", "final.opm", "initial.opm"]
    rows = [line.split() for line in (tmp_path / "ephemeris.oem").read_text().splitlines()]
    states = np.array([[float(v) for v in row[1:7]] for row in rows if len(row) >= 7 and row[0].startswith("2027-05-04T")]) * 1e3
    times = solution.ephemeris(points=30)["time_s"]
    position, velocity = circle(times)
    assert states.shape == (times.size, 6)
    assert np.abs(states[:, :3] - position).max() < POSITION and np.abs(states[:, 3:] - velocity).max() < VELOCITY
    assert json.loads((tmp_path / "ephemeris.czml").read_text())[0]["id"] == "document"
    # The page has the path about the body.
    solution.report(tmp_path)
    assert "to scale with the body" in (tmp_path / "report.html").read_text()


def test_the_file_says_the_same(solution, tmp_path):
    file = tmp_path / "orbit.toml"
    file.write_text(solution.mission.to_file())
    again = apsides.load(file).solve().ephemeris(points=20)
    table = solution.ephemeris(points=20)
    assert list(again) == list(table)
    assert np.abs(vectors(again, "position", "m") - vectors(table, "position", "m")).max() < POSITION


def test_one_phase_states_formulas_alone():
    p, places, speeds, _ = orbit(phases=1)
    (place,), (speed,) = places.values(), speeds.values()
    p.motion("moon", place, lambda t, x, u: speed)
    assert 'position = ["' in p.mission().to_file()
    table = p.solve().ephemeris(points=5)
    assert np.hypot(table["position_fixed_x_m"][0], table["position_fixed_y_m"][0]) == pytest.approx(RADIUS, abs=POSITION)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"body": "mun"}, "mun"),
        ({"body": 301}, "`body` of the motion is of type int"),
        ({"axes": "polar"}, '"inertial", "fixed", "site"'),
        ({"axes": "site"}, "goes with a site"),
        ({"axes": "site", "site": {"longitude": 10}}, "longitude and latitude in deg"),
        ({"axes": "site", "site": {"longitude": 10, "latitude": 144}}, "allowed are -90 to 90"),
        ({"position": (0, 0)}, "the position has 2 components in phase `coast`"),
        ({"velocity": None}, "the velocity is None"),
        ({"mass": (1, 2)}, "the mass has 2 components"),
        ({"thrust": {"burn": (0, 0, 0)}}, "there are the phases coast, idle"),
        ({"thrust": {"idle": (0, 0, 0)}}, "`motion.thrust` has nothing of phase `coast`"),
    ],
)
def test_mistakes_have_their_line(change, words):
    p, places, speeds, _ = orbit()
    stated = {"body": "moon", "position": places, "velocity": speeds, **change}
    with pytest.raises(apsides.Error) as refused:
        p.motion(**stated)
        p.mission()
    assert words in str(refused.value) and "test_motion.py, line " in str(refused.value)


def test_formulas_of_another_phase_are_refused():
    p, places, speeds, _ = orbit()
    p.motion("moon", next(iter(places.values())), speeds)
    with pytest.raises(apsides.ProblemError, match="`angle` is a quantity of phase `coast`, and this is a formula of phase `idle`"):
        p.mission()


def test_rows_that_cannot_be_written_are_refused(solution, tmp_path):
    assert apsides.mission("lunar-perilune").solve().write(tmp_path, ["oem"], points=10)
    for arguments, words in [
        ({"formats": "xyz", "points": 5}, "xyz"),
        ({"formats": "aem", "points": 5}, "attitude"),
        ({"formats": [3], "points": 5}, "a format is of type int"),
        ({"step": "fast"}, "fast"),
        ({"step": [1]}, "`step` is of type list"),
        ({"points": 1}, "`points` is 1"),
        ({}, "say how far apart the rows are"),
        ({"step": 1, "points": 5}, "say how far apart the rows are"),
    ]:
        with pytest.raises(apsides.Error, match=words.replace("`", ".")):
            solution.write(tmp_path / "refused", **arguments)
    assert not (tmp_path / "refused").exists()
    p, *_ = orbit(phases=1)
    with pytest.raises(apsides.Error, match="motion"):
        p.solve().write(tmp_path, "oem", points=5)
