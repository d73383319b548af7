"""Landings with constant thrust on B-splines and on Radau points by apsides and by CasADi + Ipopt (MUMPS), in turns.

The program `flatness` of this package writes each program (start, bounds, units, knots); this file writes the equations
down once more, checks that they agree at the start, and lets both solvers run in turns. See README.md.
"""

import json
import os
import tempfile
import tomllib

import findings
import landing
from common import STRATEGIES, Problem, built, casadi, numpy, output, trajectories

SPLINES = {
    "paper, coarse start": ("flat", "paper"),
    "paper, fitted start": ("flat", "paper", "--fitted"),
    "order 9, Gauss": ("flat", "smooth"),
    "refined": ("flat", "refined", "--fitted"),
}
# Intervals and points of a Radau mesh whose re-simulated flight misses no more than that of the refined splines.
RADAU = {"lunar-perilune": (1, 11), "lunar-direct": (2, 10)}
# The barrier strategies that are compared, by the flags of the program.
FLAT = {"monotone": "monotone", "quality": "quality", "flatness": "method"}
STATES = {"monotone": "monotone", "quality": "quality", "trajectory": "method"}


def basis(order, knots, points):
    """Values and two derivatives of all B-splines: points x coefficients each; at the last knot from the left."""
    knots = numpy.array(knots)
    last = len(knots) - order - 1
    values = numpy.zeros((3, len(points), len(knots) - 1))
    for row, x in enumerate(points):
        span = max(k for k in range(last + 1) if knots[k] < knots[k + 1] and (knots[k] <= x or k == order - 1))
        values[0, row, span] = 1.0
    for k in range(2, order + 1):
        new = numpy.zeros_like(values)
        for j in range(len(knots) - k):
            for first, sign in ((j, 1.0), (j + 1, -1.0)):
                width = knots[first + k - 1] - knots[first]
                if width == 0.0:
                    continue
                # The factor of the recursion, and its slope.
                factor = (points - knots[j] if sign > 0.0 else knots[j + k] - points) / width
                for d in range(3):
                    new[d, :, j] += factor * values[d, :, first]
                    if d:
                        new[d, :, j] += d * sign / width * values[d - 1, :, first]
        values = new
    return values[:, :, : last + 1]


def collocation(dump):
    """Normalised times of the collocation points."""
    count = dump["points"]
    gauss = 0.5 * (numpy.polynomial.legendre.leggauss(count)[0] + 1.0)
    if dump["placement"] == "Uniform":
        return numpy.linspace(0.0, 1.0, count)
    if dump["placement"] == "Gauss":
        return gauss
    breaks = numpy.unique(dump["splines"][0][1])
    return numpy.concatenate([a + (b - a) * gauss for a, b in zip(breaks, breaks[1:])])


def posed(dump):
    """The nonlinear program in the units of the dump: coefficients of radius and angle, then the final time."""
    mission = tomllib.loads(dump["mission_file"])
    mu, thrust = mission["gravitational_parameter_km3_s2"] * 1e9, mission["thrust_n"]
    flow = thrust / (mission["isp_s"] * mission["standard_gravity_m_s2"])
    units, row_units = numpy.array(dump["variable_units"]), numpy.array(dump["row_units"])
    scaled = casadi.SX.sym("x", len(units))
    x = scaled * casadi.DM(units)
    time = x[-1]

    def outputs(points):
        """Radius and angle with two derivatives each."""
        first = 0
        for order, knots in dump["splines"]:
            rows = basis(order, knots, points)
            coefficients = x[first : first + rows.shape[2]]
            first += rows.shape[2]
            yield [casadi.mtimes(sparse(b), coefficients) / time**d for d, b in enumerate(rows)]

    points = collocation(dump)
    radius, angle = outputs(points)
    along = radius[0] * angle[2] + 2.0 * radius[1] * angle[1]
    upward = radius[2] - radius[0] * angle[1] ** 2 + mu / radius[0] ** 2
    mass = dump["mass_kg"] - flow * time * casadi.DM(points)
    residuals = mass**2 * (along**2 + upward**2) - thrust**2
    radius, angle = outputs(numpy.array([0.0, 1.0]))
    speed = radius[0] * angle[1]
    start = [radius[0][0], angle[0][0], speed[0], radius[1][0]]
    end = [radius[0][1], speed[1], radius[1][1]]
    rows = casadi.vertcat(residuals, *start, *end) / casadi.DM(row_units)
    return {"x": scaled, "f": time / dump["objective_unit"], "g": rows}


def sparse(matrix):
    return casadi.sparsify(casadi.DM(matrix))


def compare(program, mission, words, posed_by, strategies, arguments):
    """Both solvers in turns, and what the re-simulated flight misses."""
    command = [program, *words, "--mission", mission, "--milliseconds", arguments.milliseconds]
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "problem.json")
        misses = output(*command, "--dump", path, "--verify", "--strategy", "method")["misses"]
        with open(path, encoding="ascii") as file:
            dump = json.load(file)
    problem = Problem(dump, posed_by(dump), 1e-9, expand=True)
    for strategy in strategies:
        problem.build(strategy, STRATEGIES[strategy])
    flags = {strategy: ["--strategy", flag] for strategy, flag in strategies.items()}
    return misses, trajectories.in_turns(command, flags, {"Ipopt": problem}, arguments.turns, arguments.milliseconds)


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--missions", nargs="+", default=list(RADAU), choices=list(RADAU))
    parser.add_argument("--milliseconds", type=float, default=20.0, help="CPU time spent on each solve and turn")
    parser.add_argument("--turns", type=int, default=5, help="turns of each solver")
    parser.add_argument("--program", default=None, help="the built program `flatness`")
    arguments = parser.parse_args()
    program = arguments.program or built("flatness")
    print(f"CasADi {casadi.__version__}.")
    trajectories.heading()
    notes = []
    found = findings.Findings(
        "Landings on B-splines and on Radau points, the fastest strategy of each", "The same nonlinear programs of few unknowns."
    )
    for mission in arguments.missions:
        print(mission)
        cases = [(name, words, posed, FLAT) for name, words in SPLINES.items()]
        intervals, points = RADAU[mission]
        mesh = ("radau", "--intervals", intervals, "--points", points)
        cases.append((f"Radau {intervals} x {points}", mesh, landing.posed, STATES))
        for name, words, posed_by, strategies in cases:
            misses, entries = compare(program, mission, words, posed_by, strategies, arguments)
            ratios = trajectories.report(name, 1.0, entries, 1e-8).stock
            best = trajectories.optimum_of(entries)
            missed = f"the flight misses {misses['radius']:.0e} m"
            ours, theirs, peer = trajectories.least(entries, best, 1e-8)
            found.add(f"{mission}, {name}", peer, ours, theirs, missed)
            notes.append(f"{mission}, {name}: {described(misses, entries, ratios)}")
        for splines in ("paper", "refined"):
            notes.append(f"{mission}, whole call, {splines}: {called(program, mission, splines, arguments)}")
    findings.write(arguments.findings, found)
    print()
    print("\n".join(notes))


def described(misses, entries, ratios):
    rows = next(e for e in entries.values() if e.solver == "apsides").last["constraints"]
    radius, angle = misses["radius"], misses["polar angle"]
    fastest = f", {max(ratios.values()):.1f} times faster at best" if ratios else ""
    return f"{rows} constraints, the re-simulated flight misses {radius:.1e} m and {angle:.1e} rad{fastest}"


def called(program, mission, splines, arguments):
    runs = [
        output(program, "call", splines, "--mission", mission, "--milliseconds", arguments.milliseconds)
        for _ in range(arguments.turns)
    ]
    least = min(t for run in runs for t in run["call_ms"])
    sizes = ", ".join(f"{n} x {m} in {i}" for n, m, i in runs[0]["programs"])
    return f"{least:.2f} ms; variables x constraints in iterations: {sizes}"


if __name__ == "__main__":
    main()
