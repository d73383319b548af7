"""Powered descents on Mars from dispersed starts by ECOS, QOCO and Clarabel: the conic programs of the program `latency` of this package.

Each peer gets the same program in two forms, `stages` with all states as variables and `blocks` with states eliminated inside blocks of
five intervals, through its own interface, at the same tolerance, and counts the time that it reports itself (set-up apart); its better form
counts. See README.md.
"""

import json
import os
import sys

import findings
from programs import built, text

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    import clarabel
    import ecos
    import numpy
    import qoco
    import scipy.sparse
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (pip install clarabel ecos qoco scipy)")
    sys.exit(0)

CASES = (("free", "a, free"), ("glide-slope", "c, glide slope"))
FORMS = ("stages", "clarabel")
TOLERANCE = 1e-8


class Conic:
    """min q'x, A x + s = b, s in zero x nonnegative x second-order cones."""

    def __init__(self, line):
        data = json.loads(line)
        self.objective = data["objective"]
        self.q = numpy.array(data["linear"])
        self.b = numpy.array(data["right_hand_side"])
        shape = (self.b.size, self.q.size)
        self.a = scipy.sparse.coo_matrix((data["values"], (data["rows"], data["columns"])), shape).tocsc()
        self.zero, self.nonnegative, self.cones = data["zero"], data["nonnegative"], data["second_order"]
        self.equations = self.a[: self.zero], self.b[: self.zero]
        self.inequalities = self.a[self.zero :], self.b[self.zero :]


def by_clarabel(p):
    cones = [clarabel.ZeroConeT(p.zero), clarabel.NonnegativeConeT(p.nonnegative)]
    cones += [clarabel.SecondOrderConeT(size) for size in p.cones]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
    quadratic = scipy.sparse.csc_matrix((p.q.size, p.q.size))
    solution = clarabel.DefaultSolver(quadratic, p.q, p.a, p.b, cones, settings).solve()
    return 1e3 * solution.solve_time, solution.iterations, solution.obj_val, str(solution.status) in ("Solved", "PrimalInfeasible")


def by_ecos(p):
    (a, b), (g, h) = p.equations, p.inequalities
    dims = {"l": p.nonnegative, "q": p.cones}
    tolerances = {"feastol": TOLERANCE, "abstol": TOLERANCE, "reltol": TOLERANCE}
    answer = ecos.solve(p.q, scipy.sparse.csc_matrix(g), h, dims, scipy.sparse.csc_matrix(a), b, verbose=False, **tolerances)
    info = answer["info"]
    return 1e3 * info["timing"]["tsolve"], info["iter"], info["pcost"], info["exitFlag"] in (0, 1)


def by_qoco(p):
    (a, b), (g, h) = p.equations, p.inequalities
    n = p.q.size
    solver = qoco.QOCO()
    quadratic = scipy.sparse.csc_matrix((n, n))
    cones = numpy.array(p.cones)
    solver.setup(
        n, h.size, b.size, quadratic, p.q, scipy.sparse.csc_matrix(a), b, scipy.sparse.csc_matrix(g), h,
        p.nonnegative, cones.size, cones, verbose=False, abstol=TOLERANCE, reltol=TOLERANCE,
    )  # fmt: skip
    answer = solver.solve()
    return 1e3 * answer.solve_time_sec, answer.iters, answer.obj, answer.status == "QOCO_SOLVED"


PEERS = {"QOCO": by_qoco, "ECOS": by_ecos, "Clarabel": by_clarabel}


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--starts", type=int, default=200)
    parser.add_argument("--alone", type=int, default=10000, help="starts by the solver over stages alone")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    program = built("latency")
    common = ["--starts", str(arguments.starts), "--seed", str(arguments.seed)]
    print(f"ms, the least of {arguments.runs} runs of each of {arguments.starts} starts")
    ours = text(program, *common, "--runs", arguments.runs)
    print(ours)
    own = means(ours)
    found = findings.Findings(
        "Conic programs of a powered descent over 50 intervals from dispersed starts",
        f"{arguments.starts} starts, tolerance 1e-8; the form of the program that suits the peer better. Peers' times are those that they report of the solve alone.",
    )
    print("| case | peer | form | mean, ms | largest, ms | iterations: mean | largest | solved or certified | largest difference of the objective |")
    print("| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for case, name in CASES:
        better = {}
        for form in FORMS:
            command = [program, *common, "--write", case, "--solver", form]
            lines = text(*command).splitlines()
            programs = [Conic(line) for line in lines]
            for peer, solve in PEERS.items():
                rows = []
                for p in programs:
                    answers = [solve(p) for _ in range(arguments.runs)]
                    rows.append((min(a[0] for a in answers), *answers[0][1:]))
                times, iterations, objectives, solved = zip(*rows)
                reached = [
                    abs(o - p.objective) / max(1.0, abs(o))
                    for o, p, good in zip(objectives, programs, solved)
                    if good and p.objective is not None and numpy.isfinite(p.objective)
                ]
                row = (numpy.mean(times), max(times), sum(solved), max(reached, default=numpy.nan))
                better[peer] = min(better.get(peer, row), row)
                print(
                    f"| {name} | {peer} | {'stages' if form == 'stages' else 'blocks'} | {numpy.mean(times):.3f} | {max(times):.3f} |"
                    f" {numpy.mean(iterations):.1f} | {max(iterations)} | {sum(solved)} | {max(reached, default=numpy.nan):.0e} |",
                    flush=True,
                )
        for peer, (mean, largest, good, difference) in better.items():
            reached = f"{good} of {arguments.starts} solved or certified by the peer, objectives {difference:.0e} apart"
            found.add(f"{name}, mean", peer, own[name][0], mean, reached)
            found.add(f"{name}, largest", peer, own[name][1], largest, reached)
    findings.write(arguments.findings, found, *latency(program, arguments))


def latency(program, arguments):
    """What the solver over stages takes from many starts; none if none are asked for."""
    if arguments.alone == 0:
        return []
    command = [program, "--starts", arguments.alone, "--seed", arguments.seed, "--runs", 1]
    table = text(*command)
    print(table)
    heading, *_ = table.splitlines()
    figures = findings.Figures(
        "Latency of a powered descent over 50 intervals",
        f"The solver over stages alone from {arguments.alone} dispersed starts, each once, milliseconds of processor time.",
        [cell.strip() for cell in heading.strip("|").split("|")],
    )
    for cells in findings.of_table(table):
        figures.add(*cells)
    return [figures]


def means(table):
    """Mean and largest time of each case, ms, from the table of the program."""
    return {row[0]: (float(row[2]), float(row[4])) for row in findings.of_table(table) if len(row) > 4}


if __name__ == "__main__":
    main()
