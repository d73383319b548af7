"""The landing from perilune, discretised as by apsides, solved by CasADi + Ipopt (MUMPS): times in turns with apsides.

The program `landing` of this package writes the discretised problem (start, bounds, units); this file writes the same
equations down once more, checks that they agree at the start, and lets both solvers run in turns. See README.md.
"""

import json
import os
import tempfile
import tomllib

import findings
from common import STRATEGIES, Problem, built, casadi, numpy, output, trajectories

STATES = 5
NODE = STATES + 1


def radau(points):
    """Legendre-Gauss-Radau nodes with -1 and the differentiation matrix on nodes and 1: points x (points + 1)."""
    legendre = numpy.polynomial.legendre
    nodes = numpy.sort(legendre.legroots([0.0] * (points - 1) + [1.0, 1.0]).real)
    nodes[0] = -1.0
    support = numpy.append(nodes, 1.0)
    gaps = support[:, None] - support[None, :]
    numpy.fill_diagonal(gaps, 1.0)
    weights = 1.0 / gaps.prod(axis=1)
    matrix = weights[None, :] / weights[:, None] / gaps
    numpy.fill_diagonal(matrix, 0.0)
    numpy.fill_diagonal(matrix, -matrix.sum(axis=1))
    return nodes, matrix[:points]


def rate(mission):
    """Equations of motion in polar coordinates, one node."""
    mu = mission["gravitational_parameter_km3_s2"] * 1e9
    thrust = mission["thrust_n"]
    exhaust = mission["isp_s"] * mission["standard_gravity_m_s2"]
    z = casadi.SX.sym("z", NODE)
    r, _, u, v, m, beta = casadi.vertsplit(z)
    f = casadi.vertcat(
        v,
        u / r,
        thrust / m * casadi.cos(beta) - u * v / r,
        thrust / m * casadi.sin(beta) + u * u / r - mu / (r * r),
        -thrust / exhaust,
    )
    return casadi.Function("rate", [z], [f])


def posed(dump):
    """The nonlinear program in the units of the dump."""
    units, row_units = numpy.array(dump["variable_units"]), numpy.array(dump["row_units"])
    intervals, points = dump["intervals"], dump["points"]
    nodes = intervals * points
    scaled = casadi.MX.sym("x", len(units))
    x = scaled * casadi.DM(units)
    grid = casadi.reshape(x[: nodes * NODE], NODE, nodes)
    start_time, end_time = x[nodes * NODE + STATES], x[nodes * NODE + STATES + 1]
    rates = rate(tomllib.loads(dump["mission_file"])).map(nodes)(grid)
    states = casadi.horzcat(grid[:STATES, :], x[nodes * NODE : nodes * NODE + STATES])
    # states (5 x nodes + 1) times D' of every interval.
    _, matrix = radau(points)
    row, column, value = [], [], []
    for k in range(intervals):
        for i in range(points):
            for j in range(points + 1):
                row.append(k * points + j)
                column.append(k * points + i)
                value.append(matrix[i, j])
    derivative = casadi.DM.triplet(row, column, casadi.DM(value), nodes + 1, nodes)
    defects = casadi.mtimes(states, derivative) - 0.5 / intervals * (end_time - start_time) * rates
    rows = casadi.vec(defects) / casadi.DM(row_units)
    return {"x": scaled, "f": end_time / dump["objective_unit"], "g": rows}


def compare(program, intervals, arguments):
    """Both solvers in turns on one mesh, from the same start."""
    common = [program, "--json", "--intervals", intervals, "--points", arguments.points]
    common += ["--start", arguments.start]
    barrier = ["--initial-barrier", arguments.initial_barrier]
    flags = {"monotone": barrier, "quality": ["--adaptive", *barrier], "trajectory": ["--method-settings"]}
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "problem.json")
        output(*common, "--dump", path)
        with open(path, encoding="ascii") as file:
            dump = json.load(file)
    problem = Problem(dump, posed(dump), 1e-12, expand=not arguments.no_expand)
    for strategy in trajectories.STRATEGIES:
        start = {"mu_init": arguments.initial_barrier}
        problem.build(strategy, start | STRATEGIES[strategy])
    command = [*common, "--repeat", arguments.repeat]
    return trajectories.in_turns(command, flags, {"Ipopt": problem}, arguments.turns, 0.0)


def growth(program, arguments):
    """Times of apsides alone from small meshes to large ones, and the memory that a process takes."""
    figures = findings.Figures(
        "Growth of the work with the mesh",
        f"The landing on intervals of {arguments.points} points by the strategy `quality`, apsides alone; the first solve of a process also waits for"
        " the memory that the system gives it. Memory is the largest resident set of the process.",
        ["intervals", "variables", "iterations", "first solve", "solve", "per iteration and interval", "set-up", "memory"],
    )
    for intervals in arguments.growth:
        command = [program, "--json", "--intervals", intervals, "--points", arguments.points, "--adaptive"]
        command += ["--initial-barrier", arguments.initial_barrier, "--repeat", max(3, 5000 // intervals)]
        run = output(*command)
        least, iterations = min(run["solve_ms"]), run["iterations"]
        figures.add(
            intervals,
            run["variables"],
            iterations,
            f"{run['solve_ms'][0]:.3g} ms",
            f"{least:.3g} ms",
            f"{1e3 * least / iterations / intervals:.2f} us",
            f"{min(run['setup_ms']):.3g} ms",
            f"{(run['peak_memory_kb'] or 0) / 1024:.0f} MB",
        )
        print("growth: " + ", ".join(figures.lines[-1]), flush=True)
    return figures


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--intervals", type=int, nargs="+", default=[20, 100, 1000, 5000])
    parser.add_argument("--growth", type=int, nargs="*", default=[20, 100, 1000, 5000, 20000], help="meshes of apsides alone")
    parser.add_argument("--points", type=int, default=3)
    parser.add_argument("--start", default="auto", help="auto, line or coarse, see the program")
    parser.add_argument("--initial-barrier", type=float, default=0.1, help="barrier parameter at the start, both")
    parser.add_argument("--no-expand", action="store_true", help="keep CasADi's MX graph")
    parser.add_argument("--turns", type=int, default=5, help="turns of each solver")
    parser.add_argument("--repeat", type=int, default=3, help="solves of apsides per turn")
    parser.add_argument("--program", default=None, help="the built program `landing`")
    arguments = parser.parse_args()
    program = arguments.program or built("landing")
    print(f"CasADi {casadi.__version__}.")
    trajectories.heading()
    found = findings.Findings(
        "Landing from perilune on finer and finer meshes, equal settings",
        f"Intervals of {arguments.points} points; meshes of 1000 and more start from the solution on 20.",
    )
    for intervals in arguments.intervals:
        entries = compare(program, intervals, arguments)
        trajectories.report(f"{intervals} intervals", 1.0, entries, 1e-8)
        for (peer, strategy), pair in trajectories.equal(entries, trajectories.optimum_of(entries), 1e-8).items():
            reached = "{} and {} iterations".format(*(e.last["iterations"] for e in pair))
            found.add(f"{intervals} intervals, {strategy}", peer, *(e.least for e in pair), reached)
    findings.write(arguments.findings, found, growth(program, arguments))


if __name__ == "__main__":
    main()
