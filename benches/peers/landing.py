"""The landing from perilune, discretised as by apsides, solved by CasADi + Ipopt (MUMPS): times in turns with apsides.

The program `landing` of this package writes the discretised problem (start, bounds, units); this file writes the same
equations down once more, checks that they agree at the start, and lets both solvers run in turns. See README.md.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib

# One thread each: set before any library reads it.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    import casadi
    import numpy
except ImportError as error:
    print(f"skipped: {error.name} is not installed (pip install casadi)")
    sys.exit(0)

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
STATES = 5
NODE = STATES + 1

# What differs from Ipopt's defaults, and why; everything else is default, as in apsides' settings.
IPOPT = {
    "tol": 1e-8,
    # MUMPS is the free linear solver that comes with CasADi; HSL is not free.
    "linear_solver": "mumps",
    # As apsides: wider bounds than needed move the optimum by more than 1e-8.
    "bound_relax_factor": 1e-10,
    "max_iter": 3000,
    "print_level": 0,
    "sb": "yes",
}
SOLVERS = ("apsides", "Ipopt")
# "trajectory" is what apsides-radau uses by default: adaptive with probing, from a small barrier parameter and
# multipliers of its size. Ipopt gets the same.
BARRIERS = ("monotone", "adaptive", "trajectory")
STOCK = ("monotone", "adaptive")
TRAJECTORY = {
    "mu_strategy": "adaptive",
    "mu_oracle": "probing",
    "mu_init": 1e-3,
    "bound_mult_init_val": 1e-3,
}


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


class Problem:
    """The nonlinear program in the units of the dump, with one solver per barrier strategy."""

    def __init__(self, dump, initial_barrier, expand):
        clock = time.process_time()
        array = {key: numpy.array(value) for key, value in dump.items() if isinstance(value, list)}
        intervals, points = dump["intervals"], dump["points"]
        nodes = intervals * points
        self.units, self.row_units = array["variable_units"], array["row_units"]
        self.objective_unit = dump["objective_unit"]
        scaled = casadi.MX.sym("x", len(self.units))
        x = scaled * casadi.DM(self.units)
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
        rows = casadi.vec(defects) / casadi.DM(self.row_units)
        nlp = {"x": scaled, "f": end_time / self.objective_unit, "g": rows}
        self.check(nlp, array, dump)
        self.pose_ms = (time.process_time() - clock) * 1e3
        self.arguments = {
            "x0": array["start"] / self.units,
            "lbx": array["lower"] / self.units,
            "ubx": array["upper"] / self.units,
            "lbg": array["row_lower"] / self.row_units,
            "ubg": array["row_upper"] / self.row_units,
        }
        self.solvers, self.build_ms = {}, {}
        for barrier in BARRIERS:
            clock = time.process_time()
            options = {f"ipopt.{key}": v for key, v in IPOPT.items()}
            stock = {"mu_strategy": barrier, "mu_init": initial_barrier}
            settings = TRAJECTORY if barrier == "trajectory" else stock
            options |= {f"ipopt.{key}": v for key, v in settings.items()}
            options |= {"expand": expand, "print_time": False}
            self.solvers[barrier] = casadi.nlpsol("landing", "ipopt", nlp, options)
            self.build_ms[barrier] = self.pose_ms + (time.process_time() - clock) * 1e3

    def check(self, nlp, array, dump):
        """Both sides must have written down the same equations."""
        values = casadi.Function("values", [nlp["x"]], [nlp["f"], nlp["g"]])
        f, g = values(array["start"] / self.units)
        expected = array["row_values"] / self.row_units
        assert abs(float(f) * self.objective_unit - dump["objective"]) < 1e-9, "objectives differ"
        difference = numpy.max(numpy.abs(numpy.array(g).ravel() - expected))
        assert difference < 1e-12, f"constraints differ by {difference:.1e} at the start"

    def solve(self, barrier):
        """CPU time in ms, iterations, objective, status."""
        solver = self.solvers[barrier]
        clock = time.process_time()
        solution = solver(**self.arguments)
        elapsed = (time.process_time() - clock) * 1e3
        statistics_ = solver.stats()
        return {
            "solve_ms": [elapsed],
            "build_ms": self.build_ms[barrier],
            "iterations": statistics_["iter_count"],
            "objective": float(solution["f"]) * self.objective_unit,
            "status": statistics_["return_status"],
            "success": statistics_["success"],
            "evaluation_ms": 1e3 * sum(v for k, v in statistics_.items() if k.startswith("t_proc_nlp_")),
        }


def run_apsides(program, common, *more):
    command = [program, "--json", *common, *more]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def compare(program, intervals, arguments):
    """Both solvers in turns on one mesh, from the same start."""
    common = ["--intervals", str(intervals), "--points", str(arguments.points)]
    common += ["--start", arguments.start]
    flags = {
        "monotone": ["--initial-barrier", str(arguments.initial_barrier)],
        "adaptive": ["--adaptive", "--initial-barrier", str(arguments.initial_barrier)],
        "trajectory": ["--method-settings"],
    }
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "problem.json")
        run_apsides(program, common, "--dump", path)
        with open(path, encoding="ascii") as file:
            problem = Problem(json.load(file), arguments.initial_barrier, not arguments.no_expand)
    runs = {(solver, barrier): [] for solver in SOLVERS for barrier in BARRIERS}
    for _ in range(arguments.turns):
        for barrier in BARRIERS:
            run = run_apsides(program, common, "--repeat", str(arguments.repeat), *flags[barrier])
            run["build_ms"] = min(run["setup_ms"])
            runs["apsides", barrier].append(run)
            runs["Ipopt", barrier].append(problem.solve(barrier))
    return {key: Entry(*key, value) for key, value in runs.items()}


class Entry:
    """All runs of one solver with one barrier strategy."""

    def __init__(self, solver, barrier, runs):
        self.solver, self.barrier, self.last = solver, barrier, runs[-1]
        times = [t for run in runs for t in run["solve_ms"]]
        self.least, self.median = min(times), statistics.median(times)
        self.build = min(run["build_ms"] for run in runs)

    def reaches(self, optimum):
        """Whether it ends at this optimum to 1e-8."""
        return self.last["success"] and abs(self.last["objective"] / optimum - 1.0) < 1e-8


COLUMNS = (
    ("intervals", 9), ("variables", 9), ("solver", 18), ("iterations", 10), ("solve ms", 9), ("median", 9),
    ("ms/iteration", 12), ("evaluation ms", 13), ("build ms", 9), ("objective s", 14), ("difference", 10),
    ("stock", 6), ("same", 6), ("status", 0),
)


def line(*cells):
    return " ".join(f"{cell:>{width}}" for cell, (_, width) in zip(cells, COLUMNS))


def report(intervals, entries):
    """Lines of the table; a ratio stands where the optimum is the best one."""
    optimum = min(e.last["objective"] for e in entries.values() if e.last["success"])
    rivals = [e for (s, b), e in entries.items() if s == "Ipopt" and b in STOCK and e.reaches(optimum)]
    rival = min(rivals, key=lambda e: e.least, default=None)
    variables = entries["apsides", BARRIERS[0]].last["variables"]
    for entry in entries.values():
        last = entry.last
        ratio = same = ""
        equal = entries["Ipopt", entry.barrier]
        if entry.solver == "apsides" and equal.reaches(optimum) and entry.reaches(optimum):
            same = f"{equal.least / entry.least:.2f}"
        if rival is not None and entry.solver == "apsides" and entry.reaches(optimum):
            ratio = f"{rival.least / entry.least:.2f}"
        elif entry is rival:
            ratio = "rival"
        print(
            line(
                intervals, variables, f"{entry.solver} {entry.barrier}", last["iterations"], f"{entry.least:.2f}",
                f"{entry.median:.2f}", f"{entry.least / max(last['iterations'], 1):.3f}",
                f"{last['evaluation_ms']:.2f}", f"{entry.build:.2f}", f"{last['objective']:.8f}",
                f"{last['objective'] / optimum - 1.0:.1e}", ratio, same, last["status"],
            )
        )
    sys.stdout.flush()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, nargs="+", default=[20, 100, 1000, 5000])
    parser.add_argument("--points", type=int, default=3)
    parser.add_argument("--start", default="auto", help="auto, line or coarse, see the program")
    parser.add_argument("--initial-barrier", type=float, default=0.1, help="barrier parameter at the start, both")
    parser.add_argument("--no-expand", action="store_true", help="keep CasADi's MX graph")
    parser.add_argument("--turns", type=int, default=5, help="turns of each solver")
    parser.add_argument("--repeat", type=int, default=3, help="solves of apsides per turn")
    parser.add_argument("--program", default=None, help="the built program `landing`")
    arguments = parser.parse_args()
    program = arguments.program
    if program is None:
        subprocess.run(
            ["cargo", "build", "--release", "-p", "apsides-benches", "--bin", "landing"], cwd=ROOT, check=True
        )
        target = os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target"))
        program = os.path.join(target, "release", "landing")
    print(f"CasADi {casadi.__version__}. Times in ms of CPU time of one thread, solve: minimum and median.")
    print("Difference: to the best optimum, relative. Ratios Ipopt / apsides, by minima, at that optimum:")
    print("stock: the faster of Ipopt's monotone and adaptive strategy; same: Ipopt with the settings of the row.")
    print(line(*(name for name, _ in COLUMNS)))
    for intervals in arguments.intervals:
        report(intervals, compare(program, intervals, arguments))


if __name__ == "__main__":
    main()
