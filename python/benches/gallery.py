"""Times of Python next to those of Rust: the gallery as compiled models in Rust, as files and as Python statements; the first solve of a process.

    cargo build --release --manifest-path tests/Cargo.toml --example gallery_table
    python3 python/benches/gallery.py --table target/release/examples/gallery_table

`--table` is the program of the first line, which solves the compiled models and prints the times of its solves; without it there are no ratios.
Every time is the least of several (`--turns`), in which both sides take turns. A solve is that of the method, without the certificate:
`timing_ms` of a solution, and of it the wall time around `Mission.solve` less the certificate is what a user of Python waits. Both sides
have the settings of `RadauSettings::default()`: the program's own tolerance of a mesh is a hundred times smaller. The package must be
installed (`cargo xtask python` builds its wheel). Each statement has at most 25 lines, which `python/tests/test_lengths.py` counts.
"""

import argparse
import pathlib
import statistics
import subprocess
import sys
import time

import numpy as np

import apsides

#: Settings of the compiled models: those of `RadauSettings::default()`.
EQUAL = {"radau__tolerance": 1e-8, "radau__points": 4}

FILES = pathlib.Path(__file__).resolve().parents[2] / "crates" / "apsides-problems" / "problems"

#: The first solve of a process, from the interpreter's first line.
FIRST = """
import time
begin = time.perf_counter()
import apsides, numpy as np
imported = time.perf_counter()
p = apsides.Problem("brachistochrone")
ph = p.phase("slide", duration=(0.1, 10))
x, y, v = ph.state("x", start=0, end=10), ph.state("y", start=10, end=5), ph.state("v", start=0)
a = ph.control("angle", unit="deg", lower=0, upper=180)
ph.dynamics(x=v * np.sin(a), y=-v * np.cos(a), v=9.80665 * np.cos(a))
p.minimize(ph.final_time)
assert p.solve().success
print(imported - begin, time.perf_counter() - imported)
"""


def hypersensitive():
    p = apsides.Problem("hypersensitive")
    ph = p.phase("whole", end=50)
    x, u = ph.state("x", start=1.5, end=1), ph.control("u")
    ph.dynamics(x=u - x**3)
    p.minimize(ph.integral((x**2 + u**2) / 2))
    return p


def van_der_pol():
    p = apsides.Problem("van_der_pol")
    ph = p.phase("damp", end=5)
    x1, x2 = ph.states("x1 x2", start=[0, 1])
    u = ph.control("u", lower=-0.3, upper=1)
    ph.dynamics([(1 - x2**2) * x1 - x2 + u, x1])
    p.minimize(ph.integral(x1**2 + x2**2 + u**2))
    return p


def bryson_denham():
    p = apsides.Problem("bryson_denham")
    ph = p.phase("move", end=1)
    x = ph.state("x", lower=-1, upper=1 / 9, start=0, end=0)
    v = ph.state("v", lower=-2, upper=2, start=1, end=-1)
    u = ph.control("u", lower=-20, upper=20)
    ph.dynamics(x=v, v=u)
    p.minimize(ph.integral(u**2 / 2))
    return p


def goddard_cops():
    p = apsides.Problem("goddard_cops")
    ph = p.phase("ascent", end=(0.05, 1))
    h = ph.state("h", lower=1, upper=1.1, start=1, scale=0.01)
    v = ph.state("v", lower=0, upper=1, start=0, scale=0.1)
    m = ph.state("m", lower=0.6, upper=1, start=1, end=0.6)
    T = ph.control("T", lower=0, upper=3.5)
    ph.dynamics(h=v, v=(T - 310 * v**2 * np.exp(-500 * (h - 1))) / m - h**-2, m=-2 * T)
    ph.guess([0, 0.2], h=[1, 1.01], v=[0, 0.1], T=1.75)
    p.maximize(h.end, scale=0.01)
    return p


def orbit_raising():
    p = apsides.Problem("orbit_raising")
    ph = p.phase("raise", end=3.32)
    r = ph.state("r", lower=0.5, upper=5, start=1)
    theta = ph.state("theta", lower=0, upper=6, start=0)
    vr = ph.state("vr", lower=-1, upper=1, start=0, end=0)
    vt = ph.state("vt", lower=0.1, upper=2, start=1)
    u1, u2 = ph.controls("u1 u2", lower=-1.1, upper=1.1)
    a = 0.1405 / (1 - 0.0749 * ph.time)
    ph.dynamics(r=vr, theta=vt / r, vr=vt**2 / r - r**-2 + a * u1, vt=a * u2 - vr * vt / r)
    ph.path(u1**2 + u2**2 == 1)
    p.constrain(vt.end - r.end**-0.5 == 0)
    ph.guess(r=[1, 1.5], theta=[0, 2.5], vt=[1, 0.8165], u1=0, u2=1)
    p.maximize(r.end)
    return p


def cart_pole():
    p = apsides.Problem("cart_pole")
    cart, pole, length, gravity = 1.0, 0.3, 0.5, 9.81
    ph = p.phase("swing", end=2)
    ph.state("position", lower=-2, upper=2, start=0, end=1)
    angle = ph.state("angle", start=0, end=np.pi)
    speed = ph.state("speed", start=0, end=0, scale=5)
    rate = ph.state("angular_rate", start=0, end=0, scale=10)
    force = ph.control("force", lower=-20, upper=20)
    sin, cos = np.sin(angle), np.cos(angle)
    inertia, swing = cart + pole * sin**2, length * rate**2
    turn = -(force * cos + pole * swing * sin * cos + (cart + pole) * gravity * sin) / (inertia * length)
    ph.dynamics([speed, rate, (force + pole * sin * (swing + gravity * cos)) / inertia, turn])
    p.minimize(ph.integral(force**2), scale=100)
    return p


STATEMENTS = [hypersensitive, van_der_pol, bryson_denham, goddard_cops, orbit_raising, cart_pole]


def of_python(mission):
    """What a user waits for a solve, without its certificate, and what the method took of it; ms."""
    begin = time.perf_counter()
    solution = mission.solve()
    wall = (time.perf_counter() - begin) * 1e3
    timing = solution.summary["timing_ms"]
    return wall - timing["verify"], timing["solve"]


def of_rust(table, name):
    """Milliseconds that the compiled model takes."""
    lines = subprocess.run([table, name], capture_output=True, text=True, check=True).stdout.splitlines()
    rows = [line.split("|") for line in lines if line.startswith(f"| {name} |")]
    return float(rows[0][9])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--table", help="the built example gallery_table")
    parser.add_argument("--turns", type=int, default=5)
    chosen = parser.parse_args()
    firsts = [subprocess.run([sys.executable, "-c", FIRST], capture_output=True, text=True, check=True).stdout for _ in range(chosen.turns)]
    imported, solved = (min(float(first.split()[k]) for first in firsts) for k in (0, 1))
    print(f"import {imported:.3f} s, first statement and solve {solved:.3f} s\n")
    missions = {path.stem: apsides.load(path) for path in sorted(FILES.glob("*.toml"))}
    cases = [(f.__name__, f"{f.__name__}, Python", f().mission()) for f in STATEMENTS]
    cases += [(name, f"{name}, file", mission) for name, mission in missions.items()]
    print("| problem | Rust ms | Python ms | of it the method | ratio |\n| --- | ---: | ---: | ---: | ---: |")
    ratios = []
    for name, title, mission in cases:
        mission = mission.having(**EQUAL)
        turns = [(of_rust(chosen.table, name) if chosen.table else float("nan"), *of_python(mission)) for _ in range(chosen.turns)]
        rust, wall, method = (min(column) for column in zip(*turns))
        ratios.append(wall / rust)
        print(f"| {title} | {rust:.1f} | {wall:.1f} | {method:.1f} | {ratios[-1]:.2f} |", flush=True)
    print(f"\nmedian ratio {statistics.median(ratios):.3f}, largest {max(ratios):.3f}")


if __name__ == "__main__":
    main()
