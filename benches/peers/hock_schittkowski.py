"""The collection of Hock and Schittkowski by apsides and by CasADi + Ipopt (MUMPS), default with default and best with best.

The program `program` of this package writes every nonlinear program as formulas. See README.md.
"""

import statistics
import sys

import findings
from common import STRATEGIES, SUCCESS, Problem, assembled, built, casadi, output

COMPARED = ("monotone", "quality", "probing")
COLUMNS = (
    ("number", 6), ("n", 3), ("m", 3),
    ("iterations", 10), ("Ipopt", 6), ("ms", 8), ("Ipopt", 8), ("ratio", 7),
    ("best", 9), ("iterations", 10), ("ms", 8), ("Ipopt", 9), ("iterations", 10), ("ms", 8), ("ratio", 7),
    ("status", 0),
)


def line(*cells):
    return " ".join(f"{cell:>{width}}" for cell, (_, width) in zip(cells, COLUMNS))


def reached(run, program):
    """Whether a run ends at the published optimum to its tolerance."""
    off = abs(run["objective"] - program["optimum"])
    return run["status"] in SUCCESS and off <= program["tolerance"] * max(1.0, abs(program["optimum"]))


def verdict(run, program):
    """Status in a word, with the objective where it is not the published one."""
    if run["status"] in SUCCESS and not reached(run, program):
        return f"{run['status']}, but {run['objective']:.8g} for {program['optimum']:.8g}"
    return run["status"]


def merged(runs):
    """The last run with the least time of all."""
    return runs[-1] | {"ms": min(t for run in runs for t in run["solve_ms"])}


def solve_all(arguments):
    """Programs, and by solver and strategy the runs of all."""
    path = arguments.program or built("program")
    programs = output(path, "hock-schittkowski", "--formulas")
    for program in programs:
        if "no_formula" in program:
            print(f"not compared, {program['name']}: {program['no_formula']}")
    programs = [p for p in programs if "no_formula" not in p]
    names = {p["name"] for p in programs}
    problems = []
    for program in programs:
        problem = Problem(program, assembled(program), 1e-9)
        for strategy in COMPARED:
            problem.build(strategy, STRATEGIES[strategy])
        problems.append(problem)
    runs = {(solver, s): [[] for _ in programs] for solver in ("apsides", "Ipopt") for s in COMPARED}
    spend = arguments.milliseconds
    for _ in range(arguments.turns):
        for strategy in COMPARED:
            ours = output(path, "hock-schittkowski", "--strategy", strategy, "--milliseconds", spend)
            ours = [run for run in ours if run["name"] in names]
            for k, (run, problem) in enumerate(zip(ours, problems)):
                runs["apsides", strategy][k].append(run)
                runs["Ipopt", strategy][k].append(problem.solve(strategy, spend))
    return programs, {key: [merged(r) for r in value] for key, value in runs.items()}


def fastest(runs, solver, k, program):
    """Strategy and run of the fastest that reaches the optimum, if any."""
    candidates = [(s, runs[solver, s][k]) for s in COMPARED if reached(runs[solver, s][k], program)]
    return min(candidates, key=lambda c: c[1]["ms"], default=None)


def summary(title, pairs):
    """Ratios over the programs that both solve, given pairs of runs."""
    times = [(theirs["ms"] / ours["ms"], number) for number, ours, theirs in pairs]
    counts = [ours["iterations"] / max(theirs["iterations"], 1) for _, ours, theirs in pairs]
    total = [sum(run[k]["iterations"] for run in pairs) for k in (1, 2)]
    slower = [
        f"{number} ({ours['iterations']}/{theirs['iterations']})"
        for (number, ours, theirs), ratio in zip(pairs, counts)
        if ratio > 1.1
    ]
    print(f"{title}, {len(pairs)} solved by both:")
    print(f"  iterations apsides / Ipopt: median {statistics.median(counts):.2f}, sums {total[0]} / {total[1]}")
    print(f"  over 10 % more than Ipopt in {len(slower)}: {', '.join(slower) or 'none'}")
    (least, at), median = min(times), statistics.median(t for t, _ in times)
    close = [f"{number} ({ratio:.1f})" for ratio, number in sorted(times) if ratio < 5.0]
    print(f"  time Ipopt / apsides: median {median:.1f}, least {least:.1f} (program {at}); below 5: {', '.join(close) or 'none'}")


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--milliseconds", type=float, default=20.0, help="CPU time spent on each solve and turn")
    parser.add_argument("--turns", type=int, default=2, help="turns of each solver")
    parser.add_argument("--program", default=None, help="the built program `program`")
    arguments = parser.parse_args()
    programs, runs = solve_all(arguments)
    print(f"CasADi {casadi.__version__}. Least CPU time of a solve in ms; ratios are Ipopt / apsides.")
    print("First both with their defaults (monotone), then each with its fastest strategy.")
    print(line(*(name for name, _ in COLUMNS)))
    default, best, wins = [], [], {"apsides": 0, "Ipopt": 0}
    for k, program in enumerate(programs):
        number = program["name"]
        ours, theirs = runs["apsides", "monotone"][k], runs["Ipopt", "monotone"][k]
        cells = [number, len(program["start"]), len(program["row_units"])]
        cells += [ours["iterations"], theirs["iterations"], f"{ours['ms']:.3f}", f"{theirs['ms']:.2f}"]
        both = reached(ours, program) and reached(theirs, program)
        cells.append(f"{theirs['ms'] / ours['ms']:.1f}" if both else "")
        if both:
            default.append((number, ours, theirs))
        a, b = (fastest(runs, solver, k, program) for solver in ("apsides", "Ipopt"))
        for solver, found in (("apsides", a), ("Ipopt", b)):
            wins[solver] += found is not None
            cells += [found[0], found[1]["iterations"], f"{found[1]['ms']:.3f}"] if found else ["none", "", ""]
        cells.append(f"{b[1]['ms'] / a[1]['ms']:.1f}" if a and b else "")
        if a and b:
            best.append((number, a[1], b[1]))
        words = (verdict(ours, program), verdict(theirs, program))
        cells.append(words[0] if words[0] == words[1] else f"apsides: {words[0]}; Ipopt: {words[1]}")
        print(line(*cells))
        sys.stdout.flush()
    print()
    for strategy in COMPARED:
        for solver in ("apsides", "Ipopt"):
            mine = runs[solver, strategy]
            good = [r for r, p in zip(mine, programs) if reached(r, p)]
            missed = [p["name"] for r, p in zip(mine, programs) if not reached(r, p)]
            acceptable = sum(r["status"] == "acceptable" for r in good)
            print(
                f"{solver} {strategy}: {len(good)}/{len(programs)} at the published optimum"
                f" ({acceptable} to the acceptable tolerance only); not: {', '.join(missed) or 'none'}"
            )
    print(f"any strategy: apsides {wins['apsides']}, Ipopt {wins['Ipopt']} of {len(programs)}")
    found = findings.Findings(
        "Collection of Hock and Schittkowski",
        "Sums of the times of all programs that both bring to the published optimum. Ipopt through CasADi spends about 0.15 ms an iteration whatever the size.",
    )
    for title, pairs in (("both with their defaults", default), ("the fastest strategy of each", best)):
        sums = [sum(pair[k]["ms"] for pair in pairs) for k in (1, 2)]
        found.add(title, "Ipopt", *sums, f"{len(pairs)} of {len(programs)} programs")
    findings.write(arguments.findings, found)
    summary("default with default", default)
    summary("best with best", best)
    for strategy in COMPARED[1:]:
        pairs = zip(programs, runs["apsides", strategy], runs["Ipopt", strategy])
        summary(strategy, [(p["name"], a, b) for p, a, b in pairs if reached(a, p) and reached(b, p)])


if __name__ == "__main__":
    main()
