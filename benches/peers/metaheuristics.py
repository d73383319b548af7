"""Searches on shifted and rotated functions by pygmo: success, evaluations to the target, own time per evaluation.

Functions and instances are those of `apsides_problems::search`, written down once more here and checked against values
of the Rust ones. See README.md.
"""

import argparse
import json
import multiprocessing
import os
import statistics
import sys
import time

from common import built, numpy, output

try:
    import numba
    import pygmo
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (pip install pygmo numba)")
    sys.exit(0)

FUNCTIONS = ("sphere", "rosenbrock", "rastrigin", "griewank", "schwefel", "ackley")
FACTOR = (1.0, 0.02048, 0.0512, 6.0, 10.0, 1.0)
SCHWEFEL_POINT, SCHWEFEL_VALUE = 420.968746359982, 418.9828872724338
OFFSET = (0.0, 1.0, 0.0, 0.0, SCHWEFEL_POINT, 0.0)
TARGET = 1e-8


@numba.njit
def function(which, factor, offset, shift, rotation, x):
    """The six functions of `z = factor M (x - o) + offset`."""
    n = len(x)
    z = numpy.empty(n)
    for i in range(n):
        along = 0.0
        for j in range(n):
            along += rotation[i, j] * (x[j] - shift[j])
        z[i] = factor * along + offset
    value, other = 0.0, 1.0
    if which == 0:
        for i in range(n):
            value += z[i] ** 2
        return value
    if which == 1:
        for i in range(n - 1):
            value += 100.0 * (z[i] ** 2 - z[i + 1]) ** 2 + (z[i] - 1.0) ** 2
        return value
    if which == 2:
        for i in range(n):
            value += z[i] ** 2 - 10.0 * numpy.cos(2.0 * numpy.pi * z[i]) + 10.0
        return value
    if which == 3:
        for i in range(n):
            value += z[i] ** 2
            other *= numpy.cos(z[i] / numpy.sqrt(i + 1.0))
        return 1.0 + value / 4000.0 - other
    if which == 4:
        for i in range(n):
            size = abs(z[i])
            if size <= 500.0:
                term = z[i] * numpy.sin(numpy.sqrt(size))
            else:
                mirrored = 500.0 - size % 500.0
                term = mirrored * numpy.sin(numpy.sqrt(mirrored)) * numpy.sign(z[i])
                term -= (size - 500.0) ** 2 / (10000.0 * n)
            value += SCHWEFEL_VALUE - term
        return value
    other = 0.0
    for i in range(n):
        value += z[i] ** 2
        other += numpy.cos(2.0 * numpy.pi * z[i])
    return -20.0 * (numpy.exp(-0.2 * numpy.sqrt(value / n)) - 1.0) + (numpy.e - numpy.exp(other / n))


class Ended(Exception):
    """The target is met or the budget spent."""


class Run:
    """One function until the target or the budget; pygmo copies problems, so that the counts are here."""

    def __init__(self, which, instance, budget):
        self.parameters = which, FACTOR[which], OFFSET[which], *instance
        self.budget, self.evaluations, self.best = budget, 0, numpy.inf

    def value(self, x):
        if self.evaluations >= self.budget:
            raise Ended
        value = function(*self.parameters, x)
        self.evaluations += 1
        self.best = min(self.best, value)
        if self.best <= TARGET:
            raise Ended
        return value


CURRENT = None


class Problem:
    """What pygmo sees."""

    def __init__(self, dimension=2):
        self.dimension = dimension

    def get_bounds(self):
        return [-100.0] * self.dimension, [100.0] * self.dimension

    def fitness(self, x):
        return (CURRENT.value(x),)


# Name, the algorithm for so many generations, and the population for a dimension, which is that of the algorithm of
# apsides beside it, but for gaco, whose kernel of 63 needs more. Stopping tests with a tolerance are off, so that the
# whole budget can be spent, but for cmaes; everything else is the default of pygmo.
ALGORITHMS = {
    "sga": (lambda gen, n: pygmo.sga(gen=gen), lambda n: 60),
    "sga, SBX": (
        lambda gen, n: pygmo.sga(gen=gen, crossover="sbx", eta_c=10.0, param_m=20.0, m=1.0 / n),
        lambda n: 60,
    ),
    "pso": (lambda gen, n: pygmo.pso(gen=gen), lambda n: 40),
    "pso_gen": (lambda gen, n: pygmo.pso_gen(gen=gen), lambda n: 40),
    "gaco": (lambda gen, n: pygmo.gaco(gen=gen), lambda n: 100),
    "simulated_annealing": (
        # One schedule that takes the whole budget.
        lambda gen, n: pygmo.simulated_annealing(Ts=10.0, Tf=1e-10, n_T_adj=100, n_range_adj=10, bin_size=10),
        lambda n: 1,
    ),
    "de": (lambda gen, n: pygmo.de(gen=gen, ftol=0.0, xtol=0.0), lambda n: 100),
    "de, 50 members": (lambda gen, n: pygmo.de(gen=gen, ftol=0.0, xtol=0.0), lambda n: 50),
    "sade": (lambda gen, n: pygmo.sade(gen=gen, ftol=0.0, xtol=0.0), lambda n: 100),
    "de1220": (lambda gen, n: pygmo.de1220(gen=gen, ftol=0.0, xtol=0.0), lambda n: 100),
    "cmaes": (
        lambda gen, n: pygmo.cmaes(gen=gen, ftol=1e-12, xtol=1e-12, force_bounds=True),
        lambda n: 4 + int(3 * numpy.log(n)),
    ),
}
# Algorithms of apsides and those of pygmo like them.
ROWS = {
    "GA": ("sga", "sga, SBX"),
    "PSO": ("pso", "pso_gen"),
    "ACO_R": ("gaco",),
    "SA": ("simulated_annealing",),
    "cooperation": (),
    "DE rand/1": ("de", "de, 50 members"),
    "jDE": ("sade",),
    "L-SHADE": ("de1220",),
    "CMA-ES": (),
    "IPOP-CMA-ES": (),
    "BIPOP-CMA-ES": ("cmaes",),
}


def solve(job):
    """Evaluations and error of one run; what stops early starts again with a new population."""
    global CURRENT
    name, which, dimension, seed, instance, budget = job
    CURRENT = run = Run(which, instance, budget)
    make, size = ALGORITHMS[name]
    size = size(dimension)
    restart = 0
    while True:
        try:
            problem = pygmo.problem(Problem(dimension))
            population = pygmo.population(problem, size, seed=1000 * seed + restart)
            algorithm = pygmo.algorithm(make(budget // size + 1, dimension))
            algorithm.set_seed(1000 * seed + restart)
            algorithm.evolve(population)
        except Ended:
            return run.evaluations, run.best
        restart += 1


def overhead(name, dimension, function_ns):
    """Time per evaluation on the compiled function of Rosenbrock without that function itself, ns; least of five."""
    make, size = ALGORITHMS[name]
    size = size(dimension)
    times = []
    for seed in range(1, 6):
        algorithm = pygmo.algorithm(make(100_000 // size, dimension))
        algorithm.set_seed(seed)
        population = pygmo.population(pygmo.problem(pygmo.rosenbrock(dimension)), size, seed=seed)
        clock = time.process_time()
        population = algorithm.evolve(population)
        used = time.process_time() - clock
        times.append(used / (population.problem.get_fevals() - size) * 1e9 - function_ns)
    return min(times)


def instances(program, dimension, seeds):
    """Shifts and rotations; the functions must have the values that they have in Rust."""
    read = []
    for entry in output(program, "instances", "--dimension", dimension, "--seeds", seeds):
        shift, point = numpy.array(entry["shift"]), numpy.array(entry["point"])
        rotation = numpy.array(entry["rotation"]).reshape(dimension, dimension)
        for which, value in enumerate(entry["values"]):
            mine = function(which, FACTOR[which], OFFSET[which], shift, rotation, point)
            assert abs(mine - value) <= 1e-11 * abs(value), f"{FUNCTIONS[which]}: {mine} and {value}"
        read.append((shift, rotation))
    return read


def measured(arguments, program):
    """Success of all algorithms of pygmo, and their own time per evaluation."""
    runs, times = [], []
    functions = output(program, "overhead", "--algorithms", "PSO", "--json")
    with multiprocessing.Pool(arguments.processes) as pool:
        for dimension in arguments.dimensions:
            cases = instances(program, dimension, arguments.seeds)
            for name in arguments.algorithms:
                for which, word in enumerate(FUNCTIONS):
                    jobs = [
                        (name, which, dimension, seed + 1, case, 10_000 * dimension)
                        for seed, case in enumerate(cases)
                    ]
                    results = pool.map(solve, jobs, chunksize=1)
                    reached = [evaluations for evaluations, best in results if best <= TARGET]
                    runs.append(
                        {
                            "algorithm": name,
                            "function": word,
                            "dimension": dimension,
                            "runs": len(results),
                            "successes": len(reached),
                            "evaluations": statistics.median(reached) if reached else None,
                            "error": statistics.median(best for _, best in results),
                        }
                    )
                    print(runs[-1], file=sys.stderr, flush=True)
    for dimension in arguments.dimensions:
        function = next((r["function"] for r in functions if r["dimension"] == dimension), 0.0)
        for name in arguments.algorithms:
            times.append(
                {
                    "algorithm": name,
                    "dimension": dimension,
                    "nanoseconds": overhead(name, dimension, function),
                }
            )
    return {"runs": runs, "times": times}


def table(header, rows):
    """Prints a table of Markdown; the first column is text, the others numbers."""
    print("| " + " | ".join(header) + " |")
    print("| --- |" + " ---: |" * (len(header) - 1))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()


def show(ours, peers, arguments):
    """Success side by side, evaluations and errors, times."""
    runs = {(r["algorithm"], r["function"], r["dimension"]): r for r in ours["runs"] + peers["runs"]}
    times = {(r["algorithm"], r["dimension"]): r["nanoseconds"] for r in ours["times"] + peers["times"]}
    names = [name for own, others in ROWS.items() for name in (own, *others)]
    label = {name: f"pygmo {name}" if name in ALGORITHMS else name for name in names}

    def cells(name, dimension, text):
        found = [runs.get((name, word, dimension)) for word in FUNCTIONS]
        return [text(r) if r else "" for r in found]

    for dimension in arguments.dimensions:
        print(f"## Success in {dimension} dimensions, of {arguments.seeds} runs\n")
        rows = [[label[n], *cells(n, dimension, lambda r: str(r["successes"]))] for n in names]
        table(["algorithm", *FUNCTIONS], rows)
    for dimension in arguments.dimensions:
        print(f"## Median evaluations to the target in {dimension} dimensions, or median error\n")

        def text(r):
            return f"{r['evaluations']:.0f}" if 2 * r["successes"] > r["runs"] else f"({r['error']:.1e})"

        table(["algorithm", *FUNCTIONS], [[label[n], *cells(n, dimension, text)] for n in names])
    print("## Own time per evaluation, ns\n")
    header = ["algorithm", *(f"{n} variables" for n in arguments.dimensions)]
    header += [f"pygmo: ratio, {n} variables" for n in arguments.dimensions]
    rows = []
    for own, others in ROWS.items():
        row = [own, *(f"{times[own, n]:.0f}" for n in arguments.dimensions)]
        for n in arguments.dimensions:
            ratios = [f"{o}: {times[o, n] / times[own, n]:.1f}" for o in others if (o, n) in times]
            row.append(", ".join(ratios))
        rows.append(row)
    table(header, rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--algorithms", nargs="+", default=list(ALGORITHMS), choices=list(ALGORITHMS))
    parser.add_argument("--dimensions", nargs="+", type=int, default=[10, 30])
    parser.add_argument("--seeds", type=int, default=2, help="runs of each; the documentation has 20")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--results", help="file of pygmo's results: read if it is there, else written")
    arguments = parser.parse_args()
    program = built("metaheuristics")
    if arguments.results and os.path.exists(arguments.results):
        with open(arguments.results, encoding="utf-8") as file:
            peers = json.load(file)
    else:
        peers = measured(arguments, program)
        if arguments.results:
            with open(arguments.results, "w", encoding="utf-8") as file:
                json.dump(peers, file)
    options = ["--json", "--dimensions", *arguments.dimensions]
    ours = {
        "runs": output(program, "runs", *options, "--seeds", arguments.seeds, "--threads", arguments.processes),
        "times": output(program, "overhead", *options),
    }
    show(ours, peers, arguments)


if __name__ == "__main__":
    main()
