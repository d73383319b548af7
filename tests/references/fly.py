"""Flies the trajectory of a result directory again with equations, interpolation and an integrator of its own (DOP853 of SciPy).

    python fly.py RESULTS...    # directories that `apsides solve MISSION --out RESULTS` wrote

From `mission.toml` it takes the constants, from `trajectory.csv` the state at the start of each phase, the times and the controls at the
nodes. Each interval is flown with the polynomial through its controls. Compared with the file are the states at all interval ends, the masses,
and the throttle with its bounds. The missions of the lunar landings (planar polar coordinates) and of the main braking of Chang'e 3 (spherical
coordinates) are known. The exit status is 1 where a miss is above `LIMIT`, 2 where a mission is not known.
"""

import csv
import sys
import tomllib
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator

# Largest miss of a state relative to its largest value along the flight; the accuracy of meshes is 1e-10 to 1e-8 of it.
LIMIT = 1e-6
# Rounding of a throttle at its bounds.
ROUNDING = 1e-9

PLANAR = ["radius_m", "polar_angle_rad", "horizontal_speed_m_per_s", "radial_speed_m_per_s", "mass_kg"]
SPHERICAL = [
    "radius_m",
    "longitude_rad",
    "latitude_rad",
    "upward_speed_m_per_s",
    "eastward_speed_m_per_s",
    "northward_speed_m_per_s",
    "mass_kg",
]


def planar(constants, phase):
    mu, thrust, c, _ = constants

    def rate(x, u):
        r, _, h, v, m = x[:5]
        angle = x[5] if "pitch_rate_rad_per_s" in u else u.get("thrust_angle_rad", np.pi / 2)
        force = 0.0 if phase == "coast" else thrust * u.get("throttle", 1.0)
        rates = [
            v,
            h / r,
            force / m * np.cos(angle) - h * v / r,
            force / m * np.sin(angle) + h * h / r - mu / r**2,
            -force / c,
        ]
        return rates + ([u["pitch_rate_rad_per_s"]] if "pitch_rate_rad_per_s" in u else [])

    return rate


def spherical(constants, _phase):
    mu, thrust, c, w = constants

    def rate(x, u):
        r, _, lat, up, east, north, m = x
        force = thrust * u.get("throttle", 1.0)
        pitch, course = u["thrust_pitch_rad"], u["thrust_course_rad"]
        level = force / m * np.cos(pitch)
        return [
            up,
            east / (r * np.cos(lat)),
            north / r,
            (east**2 + north**2) / r - mu / r**2 + force / m * np.sin(pitch) + w * np.cos(lat) * (2 * east + w * r * np.cos(lat)),
            east * (north * np.tan(lat) - up) / r + level * np.sin(course) + 2 * w * (north * np.sin(lat) - up * np.cos(lat)),
            -(up * north + east**2 * np.tan(lat)) / r + level * np.cos(course) - w * np.sin(lat) * (2 * east + w * r * np.cos(lat)),
            -force / c,
        ]

    return rate


CONTROLS = ["thrust_angle_rad", "pitch_rate_rad_per_s", "throttle", "thrust_pitch_rad", "thrust_course_rad"]


def model(mission, heads):
    """States and equations of a mission, or none."""
    if mission.startswith("lunar-"):
        return PLANAR, planar
    if mission == "chang-e-3-braking" and all(name in heads for name in SPHERICAL):
        return SPHERICAL, spherical
    return None


def constants(mission):
    gravity = mission.get("standard_gravity_m_s2", 9.80665)
    turning = mission["rotation_rate_rad_s"] if mission.get("body_rotation") else 0.0
    return mission["gravitational_parameter_km3_s2"] * 1e9, mission["thrust_n"], mission["isp_s"] * gravity, turning


def misses(directory):
    """The largest relative miss of each state of each phase."""
    mission = tomllib.loads((directory / "mission.toml").read_text())
    rows = list(csv.DictReader((directory / "trajectory.csv").open()))
    found = model(mission["mission"], rows[0])
    if found is None:
        return None
    names, equations = found
    result = {}
    for phase in dict.fromkeys(row["phase"] for row in rows):
        own = [row for row in rows if row["phase"] == phase]
        rate = equations(constants(mission), phase)
        controls = [name for name in CONTROLS if own[0].get(name)]
        states = list(names)
        if "pitch_rate_rad_per_s" in controls:
            controls.remove("thrust_angle_rad")
            states.append("thrust_angle_rad")
        # A vertical descent has no horizontal motion.
        known = [name for name in states if own[0][name]]
        size = {name: max(abs(float(row[name])) for row in own) or 1.0 for name in known}
        throttles = [float(row["throttle"]) for row in own[:-1] if row.get("throttle")]
        result[phase, "throttle outside of 0 to 1"] = max([0.0, *(max(-t, t - 1.0) for t in throttles)])
        x = np.array([float(own[0][name] or 0.0) for name in states])
        starts = [k for k, row in enumerate(own) if k == 0 or row["interval"] != own[k - 1]["interval"]]
        for first, last in zip(starts, [*starts[1:], len(own) - 1]):
            nodes = [float(row["time_s"]) for row in own[first:last]]
            end = float(own[last]["time_s"])
            scale = end - nodes[0]
            local = [(t - nodes[0]) / scale for t in nodes]
            curves = {
                name: BarycentricInterpolator(local, [float(row[name]) for row in own[first:last]]) for name in controls
            }

            def derivative(s, x, curves=curves, scale=scale):
                u = {name: float(curve(s)) for name, curve in curves.items()}
                return scale * np.array(rate(x, u))

            x = solve_ivp(derivative, (0.0, 1.0), x, "DOP853", rtol=1e-12, atol=1e-9).y[:, -1]
            for name, value in zip(states, x):
                if name not in known:
                    continue
                miss = abs(value - float(own[last][name])) / size[name]
                result[phase, name] = max(miss, result.get((phase, name), 0.0))
    return result


def main():
    status = 0
    for directory in map(Path, sys.argv[1:]):
        result = misses(directory)
        if result is None:
            print(f"{directory}: no equations for this mission")
            status = max(status, 2)
            continue
        for (phase, name), miss in result.items():
            limit = ROUNDING if name.startswith("throttle") else LIMIT
            verdict = "ok" if miss <= limit else "MISS"
            print(f"{directory.name:24} {phase:12} {name:28} {miss:9.1e} {verdict}")
            if miss > limit:
                status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
