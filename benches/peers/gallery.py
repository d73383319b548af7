"""Problems of the gallery on fixed meshes by apsides and by Ipopt (MUMPS) and fatrop of CasADi, in turns.

The program `program` of this package writes each transcribed problem as formulas and index lists. See README.md.
"""

import statistics

import findings
from common import STRATEGIES, Problem, assembled, built, casadi, output, stages, trajectories

# Intervals and points: the optimum of the mesh is close to that of the problem.
MESHES = {
    "lunar-perilune": (40, 4),
    "brachistochrone_dymos": (30, 4),
    "goddard_cops": (60, 4),
    "moon_lander_soft": (60, 4),
    "hypersensitive": (200, 4),
    "shuttle_reentry": (40, 4),
    "free_flying_robot": (60, 4),
    "orbit_raising": (50, 4),
}


def compare(path, name, arguments):
    """Description and entries of one problem."""
    intervals, points = MESHES[name]
    command = [path, "problem", name, "--intervals", intervals, "--points", points]
    description = output(*command, "--formulas")
    problem = Problem(description, assembled(description), 1e-9)
    for strategy in trajectories.STRATEGIES:
        problem.build(strategy, STRATEGIES[strategy])
    staged = stages.Staged(description, points, problem.nlp, 1e-9)
    for strategy in stages.STRATEGIES:
        staged.build(strategy)
    command += ["--milliseconds", arguments.milliseconds]
    flags = {strategy: ["--strategy", strategy] for strategy in trajectories.STRATEGIES}
    entries = trajectories.in_turns(command, flags, {"Ipopt": problem, "fatrop": staged}, arguments.turns, arguments.milliseconds)
    return description, entries


def refined(path, name, arguments):
    """A whole call of the method with its defaults, the least time of all."""
    runs = [output(path, "refined", name, "--milliseconds", arguments.milliseconds) for _ in range(arguments.turns)]
    return runs[0] | {"ms": min(t for run in runs for t in run["call_ms"]) if runs[0]["solved"] else None}


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--problems", nargs="+", default=list(MESHES), choices=list(MESHES))
    parser.add_argument("--milliseconds", type=float, default=20.0, help="CPU time spent on each solve and turn")
    parser.add_argument("--turns", type=int, default=3, help="turns of each solver")
    parser.add_argument("--program", default=None, help="the built program `program`")
    arguments = parser.parse_args()
    path = arguments.program or built("program")
    print(f"CasADi {casadi.__version__}.")
    trajectories.heading()
    notes, ratios, counts = [], {}, []
    equal = findings.Findings(
        "Trajectories on one mesh, equal settings",
        "Solves of the same nonlinear program, from the same start, by the same method with the same strategy of the barrier parameter. "
        "fatrop has the equations of a mesh interval combined into stages, and of the strategy `trajectory` the first barrier parameter alone.",
    )
    fastest = findings.Findings(
        "Trajectories on one mesh, the fastest strategy of each",
        "The same programs, each side with the strategy that is fastest for it, against the fastest peer.",
    )
    refinement = findings.Findings(
        "Trajectories from the guess to an error of 1e-8",
        "Whole calls of the method with its defaults: meshes refined until the estimate of their error is below 1e-8. The peer solves one mesh, "
        "which somebody has to have chosen, once, with the strategy that is fastest.",
    )
    for name in arguments.problems:
        description, entries = compare(path, name, arguments)
        mesh = "{} intervals of {} points".format(*MESHES[name])
        sign = description["sign"]
        ratios[name] = trajectories.report(name, sign, entries, 1e-6)
        best = trajectories.optimum_of(entries)
        published = description["optimum"]
        note = f"{name}: {mesh}, {len(description['row_units'])} constraints, optimum of the mesh {sign * best:.9g}"
        if published is not None:
            note += f", published {published:.9g}, difference {sign * best / published - 1.0:.1e}"
        notes.append(note)
        for (peer, strategy), pair in trajectories.equal(entries, best, 1e-6).items():
            counts.append((name, peer, strategy, *(e.last["iterations"] for e in pair)))
            reached = "{} and {} iterations, objectives {:.0e} apart".format(*counts[-1][3:], trajectories.apart(pair))
            reached += stages.NOTES.get(strategy, "") if peer == "fatrop" else ""
            equal.add(f"{name}, {strategy}", peer, *(e.least for e in pair), reached)
        ours, theirs, peer = trajectories.least(entries, best, 1e-6)
        whole = refined(path, name, arguments)
        off = abs(whole["objective"] - sign * best) / abs(best)
        reached = f"{whole['meshes']} meshes, {whole['iterations']} iterations; objectives {off:.0e} apart"
        refinement.add(name, f"{peer}, {mesh}", whole["ms"], theirs, reached)
        fastest.add(name, peer, ours, theirs, mesh)
    print()
    print("\n".join(notes))
    print()
    for key in dict.fromkeys(key for r in ratios.values() for key in r.equal):
        found = {name: r.equal[key] for name, r in ratios.items() if key in r.equal}
        closing("{}, {}, equal settings".format(*key), found, len(ratios))
    closing("the fastest strategy of each, the fastest peer", {n: r.best for n, r in ratios.items() if r.best}, len(ratios))
    for strategy in trajectories.STRATEGIES:
        found = {name: r.stock[strategy] for name, r in ratios.items() if strategy in r.stock}
        closing(f"apsides {strategy} against the faster of Ipopt's own strategies", found, len(ratios))
    findings.write(arguments.findings, equal, fastest, refinement)
    for rival in trajectories.PEERS:
        more = [f"{name} {strategy} {ours}/{theirs}" for name, peer, strategy, ours, theirs in counts if peer == rival and ours > 1.1 * theirs]
        print(f"over 10 % more iterations than {rival} with equal settings: {', '.join(more) or 'none'}")


def closing(title, ratios, problems):
    if ratios:
        least = min(ratios, key=ratios.get)
        median = statistics.median(ratios.values())
        print(f"{title}: median {median:.1f}, least {ratios[least]:.1f} ({least}), {len(ratios)} of {problems}")


if __name__ == "__main__":
    main()
