"""Powered descents on Mars by CVXPY and Clarabel: one conic program, in turns with the program `convex` of this package.

The same problem (case a and c of Acikmese and Ploen, given flight time, linear controls, tangents of the thrust bounds at the
mass of full thrust) in its straightforward form, with all states as variables. See README.md.
"""

import math
import os
import sys
import time
import warnings

import findings
from programs import built, output

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    import clarabel
    import cvxpy
    import numpy
    import scipy.sparse
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (pip install cvxpy clarabel)")
    sys.exit(0)

# CVXPY says that it takes its SciPy backend for norms of rows.
warnings.filterwarnings("ignore", category=UserWarning, module="cvxpy|__main__")
CANT = math.cos(math.radians(27.0))
EXHAUST = 225.0 * 9.807 * CANT
THRUST = [throttle * 6.0 * 3100.0 * CANT for throttle in (0.3, 0.8)]
MASS, DRY = 1905.0, 1505.0
GRAVITY = numpy.array([0.0, 0.0, -3.7114])
START = numpy.array([2000.0, 0.0, 1500.0]), numpy.array([100.0, 0.0, -75.0])
CASES = (("a", False, 72.0), ("c", True, 81.0))


def posed(intervals, glide_slope, flight_time):
    """The problem, in units of 100 m, 10 m/s and 1 m/s2 (steps of 10 s)."""
    length, speed = 100.0, 10.0
    h = flight_time / intervals / 10.0
    times = numpy.linspace(0.0, flight_time, intervals + 1)
    reference = numpy.log(numpy.maximum(MASS - THRUST[1] / EXHAUST * times, DRY))
    r, v = cvxpy.Variable((intervals + 1, 3)), cvxpy.Variable((intervals + 1, 3))
    u, s = cvxpy.Variable((intervals + 1, 3)), cvxpy.Variable(intervals + 1)
    z = cvxpy.Variable(intervals + 1)
    a, b = u[:-1] + GRAVITY, u[1:] + GRAVITY
    change = z - (reference - math.log(MASS))
    least, most = (thrust * numpy.exp(-reference) for thrust in THRUST)
    constraints = [
        r[0] == START[0] / length,
        v[0] == START[1] / speed,
        z[0] == 0,
        r[-1] == 0,
        v[-1] == 0,
        z[-1] >= math.log(DRY / MASS),
        v[1:] == v[:-1] + h / 2 * (a + b),
        r[1:] == r[:-1] + h * v[:-1] + h * h / 6 * (2 * a + b),
        z[1:] == z[:-1] - flight_time / intervals / (2 * EXHAUST) * (s[:-1] + s[1:]),
        cvxpy.norm(u, axis=1) <= s,
        s >= cvxpy.multiply(least, 1 - change),
        s <= cvxpy.multiply(most, 1 - change),
    ]
    if glide_slope:
        slope = math.tan(math.radians(4.0))
        constraints.append(slope * cvxpy.norm(r[1:-1, :2], axis=1) <= r[1:-1, 2])
    return cvxpy.Problem(cvxpy.Maximize(z[-1]), constraints), z


def clock():
    return 1e3 * time.process_time()


def propellant(case):
    """To a tolerance of 1e-10: with the default of 1e-8 it is up to 2e-3 kg too high."""
    problem, z = posed(*case)
    problem.solve(solver=cvxpy.CLARABEL, max_threads=1, tol_gap_abs=1e-10, tol_gap_rel=1e-10, tol_feas=1e-10)
    return MASS * -math.expm1(z.value[-1])


def by_cvxpy(case):
    """ms of everything from the statement on."""
    start = clock()
    posed(*case)[0].solve(solver=cvxpy.CLARABEL, max_threads=1)
    return clock() - start


def by_clarabel(case):
    """ms of Clarabel's set-up and solve on the form that CVXPY gives it, of the solve alone, variables, rows."""
    problem, _ = posed(*case)
    data = problem.get_problem_data(cvxpy.CLARABEL)[0]
    cones = []
    dims = data["dims"]
    if dims.zero:
        cones.append(clarabel.ZeroConeT(dims.zero))
    if dims.nonneg:
        cones.append(clarabel.NonnegativeConeT(dims.nonneg))
    cones.extend(clarabel.SecondOrderConeT(size) for size in dims.soc)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    variables = data["c"].size
    quadratic = scipy.sparse.csc_matrix((variables, variables))
    start = clock()
    solver = clarabel.DefaultSolver(quadratic, data["c"], data["A"], data["b"], cones, settings)
    middle = clock()
    solution = solver.solve()
    end = clock()
    assert str(solution.status) == "Solved", solution.status
    return end - start, end - middle, variables, data["b"].size


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--intervals", type=int, nargs="+", default=[50, 100, 200])
    parser.add_argument("--runs", type=int, default=8)
    arguments = parser.parse_args()
    program = built("convex")
    print("CPU times in ms, the least of", arguments.runs, "runs in turns")
    print("| case | N | apsides: set-up and solve | again | variables, rows | CVXPY with set-up | Clarabel on its form | solve alone | variables, rows | CVXPY : apsides |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    found = findings.Findings(
        "Powered descents as one conic program", "From the statement to the solution, beside CVXPY; new data in place and a solve, beside Clarabel's own set-up and solve."
    )
    for name, glide_slope, flight_time in CASES:
        for intervals in arguments.intervals:
            case = (intervals, glide_slope, flight_time)
            command = [program, "descent", "--runs", "3", "--intervals", str(intervals), "--flight-time", str(flight_time)]
            command += ["--glide-slope"] if glide_slope else []
            ours, theirs, alone = [], [], []
            for _ in range(arguments.runs):
                ours.append(output(*command))
                theirs.append(by_cvxpy(case))
                alone.append(by_clarabel(case))
            if abs(ours[0]["propellant"] - (other := propellant(case))) > 1e-3:
                sys.exit(f"propellant {ours[0]['propellant']} and {other} kg differ")
            setup, again = (min(o[key] for o in ours) for key in ("with_setup", "again"))
            peer = min(theirs)
            whole, solve = (min(a[k] for a in alone) for k in (0, 1))
            agreed = f"propellant {abs(ours[0]['propellant'] - other):.0e} kg apart"
            found.add(f"case {name}, {intervals} intervals, from the statement", "CVXPY, Clarabel", setup, peer, agreed)
            found.add(f"case {name}, {intervals} intervals, matrices given", "Clarabel", again, whole, agreed)
            print(
                f"| {name} | {intervals} | {setup:.2f} | {again:.2f} | {ours[0]['variables']}, {ours[0]['rows']} | {peer:.1f} |"
                f" {whole:.2f} | {solve:.2f} | {alone[0][2]}, {alone[0][3]} | {peer / setup:.1f} |",
                flush=True,
            )
    findings.write(arguments.findings, found)
    decision = output(program, "divert")
    print(
        f"\nOne decision over {decision['sites']} sites: {decision['milliseconds']:.0f} ms, {decision['solves']} programs,"
        f" {decision['landed']} reached, at most {decision['excess']:.4f} kg above a search of its own"
    )


if __name__ == "__main__":
    main()
