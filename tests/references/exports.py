"""Ephemerides read by programs that are not ours: python exports.py PROGRAM DIRECTORY...

Each DIRECTORY is one that the program wrote with `--format csv,json,npz,oem,opm,czml` (and `aem` where the mission has an attitude).
To 1 m and 1 mm/s, and to 1e-9 for quaternions:

* ephemeris.oem by the packages `oem` and `ccsds-ndm-py`, initial.opm and final.opm and ephemeris.aem by the latter, which checks them against
  their standards too, with ephemeris.csv;
* ephemeris.npz by NumPy and ephemeris.json by Python, every column, to the bit;
* ephemeris.czml: what its sampled positions are in axes fixed to the body, by their instants in UTC (ERFA);
* states in axes of the ICRF turned into those of the body by SPICE, against the columns of the fixed axes;
* speeds, path angles, longitude, latitude of the fixed states, by their definitions;
* coasts of an injection, and of a problem with equations of its own, by Kepler's equation, from the first state of the phase to the last.

The JSON Schema that the program prints, by `jsonschema`: it accepts all mission files of the project, and refuses broken ones at the path of
the mistake. Exit status 1 where anything differs.
"""

import copy
import csv
import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import ccsds_ndm
import jsonschema
import numpy as np
import oem
import spiceypy as spice
from astropy.time import Time

from ephemeris_axes import POOL, seconds

ROOT = Path(__file__).resolve().parent.parent.parent
POSITION, VELOCITY, QUATERNION = 1.0, 1e-3, 1e-9
MU = {"EARTH": 398600.4418e9, "MOON": 4902.8001e9, "MARS": 42828.3752e9}

for name, values in POOL.items():
    spice.pdpool(name, values)


def columns(directory):
    """Columns of ephemeris.csv as arrays, texts as lists."""
    with open(directory / "ephemeris.csv", newline="") as file:
        rows = list(csv.reader(file))
    table = {}
    for k, header in enumerate(rows[0]):
        cells = [row[k] for row in rows[1:]]
        is_text = header == "phase" or header.startswith("epoch_")
        table[header] = cells if is_text else np.array([float(c) if c else math.nan for c in cells])
    return table


def vectors(table, what):
    unit = "m" if what.startswith("position") else "m_per_s"
    return np.stack([table[f"{what}_{axis}_{unit}"] for axis in "xyz"], axis=1)


def close(what, found, expected, tolerance):
    difference = np.max(np.abs(np.asarray(found) - np.asarray(expected)))
    assert difference <= tolerance, f"{what} differs by {difference}, allowed are {tolerance}"
    return float(difference)


def scale_of(table):
    return next(header for header in table if header.startswith("epoch_")).removeprefix("epoch_")


def distinct(table):
    """Rows of each segment whose instants differ, as messages have them: a segment begins with a phase, and where a time stands twice."""
    instants, times, kept = table[f"epoch_{scale_of(table)}"], table["time_s"], []
    for k, phase in enumerate(table["phase"]):
        begins = k == 0 or table["phase"][k - 1] != phase or times[k - 1] == times[k]
        if begins or instants[kept[-1]] != instants[k]:
            kept.append(k)
    return kept


def check_oem(directory, table):
    rows = distinct(table)
    position, velocity = vectors(table, "position_icrf")[rows], vectors(table, "velocity_icrf")[rows]
    ephemeris = oem.OrbitEphemerisMessage.open(str(directory / "ephemeris.oem"))
    states = [state for segment in ephemeris for state in list(segment.states)]
    assert len(states) == len(rows), (len(states), len(rows))
    worst = [
        close("oem position", [s.position * 1e3 for s in states], position, POSITION),
        close("oem velocity", [s.velocity * 1e3 for s in states], velocity, VELOCITY),
    ]
    message = ccsds_ndm.from_file(str(directory / "ephemeris.oem"))
    message.validate()
    found = np.concatenate([segment.data.state_vector_numpy[:, :6] for segment in message.segments]) * 1e3
    close("ccsds-ndm position", found[:, :3], position, POSITION)
    close("ccsds-ndm velocity", found[:, 3:], velocity, VELOCITY)
    epochs = [str(epoch) for segment in message.segments for epoch in segment.data.state_vector_epochs]
    assert epochs == [table[f"epoch_{scale_of(table)}"][k] for k in rows]
    return worst


def check_opm(directory, table):
    position, velocity = vectors(table, "position_icrf"), vectors(table, "velocity_icrf")
    for name, row in (("initial.opm", 0), ("final.opm", -1)):
        message = ccsds_ndm.from_file(str(directory / name))
        message.validate()
        data = message.segment.data
        s = data.state_vector
        close(name, np.array([s.x, s.y, s.z]) * 1e3, position[row], POSITION)
        close(name, np.array([s.x_dot, s.y_dot, s.z_dot]) * 1e3, velocity[row], VELOCITY)
        close(name, data.spacecraft_parameters.mass, table["mass_kg"][row], 1e-5)


def check_aem(directory, table):
    """The axes of the vehicle in those of the body, from the message and from the attitude of the record."""
    message = ccsds_ndm.from_file(str(directory / "ephemeris.aem"))
    message.validate()
    found = np.concatenate([segment.data.attitude_states_numpy for segment in message.segments])
    recorded = np.stack([table[f"attitude_{k}"] for k in range(4)], axis=1)[distinct(table)]
    for q, record, text in zip(found, recorded, np.array(table[f"epoch_{scale_of(table)}"])[distinct(table)]):
        et = seconds(Time(text, scale=scale_of(table)).tdb)
        # SPICE quaternions, scalar first, are those of the transposed matrices of the message: q2m(q) takes the vehicle to the ICRF.
        to_icrf = spice.q2m([q[3], *q[:3]])
        to_fixed = spice.pxform("J2000", "IAU_EARTH", et) @ to_icrf
        close("aem attitude", to_fixed, spice.q2m(record / np.linalg.norm(record)), 2e-6)
    close("aem norm", np.linalg.norm(found, axis=1), 1.0, QUATERNION)


def check_arrays(directory, table):
    archive = np.load(directory / "ephemeris.npz")
    assert set(archive.files) == set(table), set(archive.files) ^ set(table)
    for header in table:
        same = list(archive[header]) == table[header] if isinstance(table[header], list) else np.array_equal(archive[header], table[header], equal_nan=True)
        assert same, f"npz: {header}"
    with open(directory / "ephemeris.json") as file:
        document = json.load(file)
    for column in document["columns"]:
        values = np.array([math.nan if v is None else v for v in column["values"]])
        assert np.array_equal(values, table[column["name"]], equal_nan=True), f"json: {column['name']}"
    return document["body"]


def check_czml(directory, table):
    with open(directory / "ephemeris.czml") as file:
        _, vehicle = json.load(file)
    samples = np.array(vehicle["position"]["cartesian"]).reshape(-1, 4)
    first = []
    for k, time in enumerate(table["time_s"]):
        # Both sides of a boundary are one sample.
        if not first or time - table["time_s"][first[-1]] > 1e-6:
            first.append(k)
    times = table["time_s"][first]
    close("czml position", samples[:, 1:], vectors(table, "position_fixed")[first], POSITION)
    begin = Time(vehicle["position"]["epoch"].removesuffix("Z"), scale="utc")
    start = Time(table[f"epoch_{scale_of(table)}"][0], scale=scale_of(table))
    assert abs((begin - start).to_value("s")) < 5e-5, (begin - start).to_value("s")
    close("czml times", samples[:, 0], times - times[0], 1e-9)


def check_axes(table, body):
    position, velocity = vectors(table, "position_icrf"), vectors(table, "velocity_icrf")
    fixed, over_ground = vectors(table, "position_fixed"), vectors(table, "velocity_fixed")
    worst = [0.0, 0.0]
    for k, text in enumerate(table[f"epoch_{scale_of(table)}"]):
        et = seconds(Time(text, scale=scale_of(table)).tdb)
        turned = spice.sxform("J2000", f"IAU_{body}", et) @ np.concatenate([position[k], velocity[k]])
        worst[0] = max(worst[0], close("fixed position", turned[:3], fixed[k], POSITION))
        worst[1] = max(worst[1], close("fixed velocity", turned[3:], over_ground[k], VELOCITY))
    r, v = np.linalg.norm(fixed, axis=1), np.linalg.norm(over_ground, axis=1)
    close("ground speed", table["ground_speed_m_per_s"], v, VELOCITY)
    close("speed", table["speed_m_per_s"], np.linalg.norm(velocity, axis=1), VELOCITY)
    close("longitude", np.radians(table["longitude_deg"]), np.arctan2(fixed[:, 1], fixed[:, 0]), 1e-12)
    if "east_of_site_m" not in table and body == "MOON":
        sine = np.sum(fixed * over_ground, axis=1) / (r * np.maximum(v, 1e-3))
        close("ground path angle", np.sin(np.radians(table["ground_path_angle_deg"]))[v > 1], sine[v > 1], 1e-9)
    return worst


def kepler(mu, r, v, t):
    """Position and velocity of an ellipse after a time, by its eccentric anomaly."""
    size, speed = np.linalg.norm(r), np.linalg.norm(v)
    a = 1 / (2 / size - speed**2 / mu)
    n = math.sqrt(mu / a**3)
    cos_part, sin_part = 1 - size / a, r @ v / math.sqrt(mu * a)
    change = n * t
    for _ in range(60):
        f = change - cos_part * math.sin(change) + sin_part * (1 - math.cos(change)) - n * t
        change -= f / (1 - cos_part * math.cos(change) + sin_part * math.sin(change))
    c, s = math.cos(change), math.sin(change)
    f, g = 1 - a / size * (1 - c), t - math.sqrt(a**3 / mu) * (change - s)
    later = f * r + g * v
    distance = np.linalg.norm(later)
    return later, (-math.sqrt(mu * a) / (distance * size) * s) * r + (1 - a / distance * (1 - c)) * v


def check_coasts(table, body):
    phases = np.array(table["phase"])
    position, velocity = vectors(table, "position_icrf"), vectors(table, "velocity_icrf")
    for phase in dict.fromkeys(p for p in table["phase"] if p.startswith(("coast-", "coast_"))):
        first, last = np.flatnonzero(phases == phase)[[0, -1]]
        found = kepler(MU[body], position[first], velocity[first], table["time_s"][last] - table["time_s"][first])
        close(f"{phase} position", position[last], found[0], POSITION)
        close(f"{phase} velocity", velocity[last], found[1], VELOCITY)


# A problem with equations of its own.
OWN = "lunar-orbit-raise"

BROKEN = [
    ("lunar-perilune", ["thrust_n"], -440.0),
    ("lunar-perilune", ["thrust_n"], "much"),
    ("lunar-perilune", ["throttle"], "half"),
    ("lunar-perilune", ["radau", "points"], 4.5),
    ("lunar-perilune", ["radau", "points"], 0),
    ("lunar-perilune", ["radau"], 7),
    ("geo-2-burn", ["oblateness"], "yes"),
    ("geo-2-burn", ["frame", "inclination_deg"], 181.0),
    ("capsule-reentry", ["epoch"], 2030),
    ("chang-e-3", ["mission"], "chang-e-4"),
    (OWN, ["motion"], 7),
    (OWN, ["motion", "body"], 301),
    (OWN, ["motion", "axes"], "polar"),
    (OWN, ["motion", "site"], {"longitude": 0, "latitude": 0}),
    (OWN, ["motion", "position"], ["r", 0]),
    (OWN, ["motion", "position"], {}),
    (OWN, ["motion", "velocity", 2], True),
    (OWN, ["motion", "mass"], ["m"]),
    (OWN, ["motion", "thrust", "coast_1"], [0, 0, 0, 0]),
    (OWN, ["motion", "thrust", "burn_1", 0], ""),
    (OWN, ["frame", "inclination_deg"], 181.0),
    (OWN, ["check_units"], "no"),
]
UNKNOWN = [
    ("lunar-perilune", [], "thrst_n"),
    ("lunar-perilune", ["radau"], "point"),
    ("lunar-perilune", ["frame"], "tilt_deg"),
    (OWN, [], "motoin"),
    (OWN, ["motion"], "speed"),
]
MISSING = [(OWN, ["motion"], key) for key in ("body", "position", "velocity")]


def check_schema(program):
    schema = json.loads(subprocess.run([program, "schema"], check=True, capture_output=True, text=True).stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    folder = ROOT / "crates/apsides-missions/missions"
    own = ROOT / "tests/references"
    files = [*folder.glob("*.toml"), *(folder / "problem").glob("*.toml"), *(ROOT / "tests/problems").glob("*.toml"), *own.glob("*.toml")]
    files = [file for file in files if file.name != "expected.toml"]
    for file in files:
        errors = list(validator.iter_errors(tomllib.loads(file.read_text())))
        assert not errors, f"{file.name}: {errors[0].json_path}: {errors[0].message}"

    def deepest(errors):
        return [list(e.absolute_path) for e in errors]

    def table(mission, path):
        for key in path:
            mission = mission[key] if isinstance(mission, list) else mission.setdefault(key, {})
        return mission

    def mission_of(name):
        return tomllib.loads(((own if name == OWN else folder) / f"{name}.toml").read_text())

    def with_value(name, path, value):
        mission = mission_of(name)
        table(mission, path[:-1])[path[-1]] = value
        return mission

    for name, path, value in BROKEN:
        errors = deepest(validator.iter_errors(with_value(name, path, value)))
        assert errors == [path], f"{name} {path} = {value!r}: {errors}"
    for name, path, key in UNKNOWN:
        found = list(validator.iter_errors(with_value(name, [*path, key], 1.0)))
        assert deepest(found) == [path] and key in found[0].message, f"{name} {path} {key}: {found}"
    for name, path, key in MISSING:
        mission = mission_of(name)
        del table(mission, path)[key]
        found = list(validator.iter_errors(mission))
        assert deepest(found) == [path] and key in found[0].message, f"{name} {path} without {key}: {found}"
    at_site = with_value(OWN, ["motion", "axes"], "site")
    assert deepest(validator.iter_errors(at_site)) == [["motion"]], "a site that is missing"
    at_site["motion"]["site"] = {"longitude": "-19.5 deg"}
    assert deepest(validator.iter_errors(at_site)) == [["motion", "site"]], "a latitude that is missing"
    at_site["motion"]["site"]["latitude"] = 44.1
    assert not deepest(validator.iter_errors(at_site))
    return len(files), len(BROKEN) + len(UNKNOWN) + len(MISSING) + 2


def main():
    program, *directories = sys.argv[1:]
    accepted, refused = check_schema(program)
    print(f"schema: {accepted} files accepted, {refused} broken ones refused at their paths")
    for directory in map(Path, directories):
        table = columns(directory)
        body = check_arrays(directory, table)
        messages, axes = check_oem(directory, table), check_axes(table, body)
        check_opm(directory, table)
        check_czml(directory, table)
        check_coasts(table, body)
        if (directory / "ephemeris.aem").exists():
            check_aem(directory, table)
        print(
            f"{directory.name}: {len(table['phase'])} rows, oem {messages[0]:.1e} m {messages[1]:.1e} m/s, "
            f"SPICE {axes[0]:.1e} m {axes[1]:.1e} m/s"
        )


if __name__ == "__main__":
    main()
