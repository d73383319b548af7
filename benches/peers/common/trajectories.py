"""Transcribed problems by both solvers in turns: runs, and the table that the comparisons of trajectories print."""

import statistics
import sys
from typing import NamedTuple

from . import SUCCESS, output

SOLVERS = ("apsides", "Ipopt")
STRATEGIES = ("monotone", "quality", "trajectory")
STOCK = ("monotone", "quality")


class Ratios(NamedTuple):
    """Times of Ipopt over those of apsides on one problem, where both reach the best optimum."""

    equal: dict
    """By strategy, Ipopt with the same settings."""
    best: float | None
    """The fastest of all strategies on either side."""
    stock: dict
    """By strategy of apsides, the faster of Ipopt's own two strategies."""


class Entry:
    """All runs of one solver with one barrier strategy."""

    def __init__(self, solver, strategy, runs):
        self.solver, self.strategy, self.last = solver, strategy, runs[-1]
        times = [t for run in runs for t in run["solve_ms"]]
        self.least, self.median = min(times), statistics.median(times)
        self.build = min(run["build_ms"] for run in runs)
        self.success = self.last["status"] in SUCCESS

    def reaches(self, optimum, tolerance):
        """Whether it ends at this optimum to a relative tolerance."""
        return self.success and abs(self.last["objective"] - optimum) <= tolerance * abs(optimum)


def in_turns(command, flags, problem, turns, milliseconds):
    """Entries by solver and strategy; `command` and the `flags` of a strategy run apsides, Ipopt repeats for
    `milliseconds`."""
    runs = {(solver, strategy): [] for solver in SOLVERS for strategy in flags}
    for _ in range(turns):
        for strategy in flags:
            run = output(*command, *flags[strategy])
            run["build_ms"] = min(run["setup_ms"])
            runs["apsides", strategy].append(run)
            runs["Ipopt", strategy].append(problem.solve(strategy, milliseconds))
    return {key: Entry(*key, value) for key, value in runs.items()}


def least(entries, optimum, tolerance):
    """Least time of each solver among the strategies that reach the optimum."""
    return [
        min((e.least for (s, _), e in entries.items() if s == solver and e.reaches(optimum, tolerance)), default=None)
        for solver in SOLVERS
    ]


def apart(pair):
    """Relative difference of two objectives."""
    a, b = (e.last["objective"] for e in pair)
    return abs(a - b) / max(abs(a), abs(b), 1e-300)


COLUMNS = (
    ("problem", 21), ("variables", 9), ("solver", 18), ("iterations", 10), ("solve ms", 9), ("median", 9),
    ("ms/iteration", 12), ("evaluation ms", 13), ("build ms", 9), ("objective", 16), ("difference", 10), ("stock", 6), ("same", 6),
    ("status", 0),
)


def line(*cells):
    return " ".join(f"{cell:>{width}}" for cell, (_, width) in zip(cells, COLUMNS))


def heading():
    print("Times in ms of CPU time of one thread, solve: minimum and median.")
    print("Difference: to the best optimum, relative. Ratios Ipopt / apsides, by minima, at that optimum:")
    print("stock: the faster of Ipopt's monotone and adaptive strategy; same: Ipopt with the settings of the row.")
    print(line(*(name for name, _ in COLUMNS)))


def report(label, sign, entries, tolerance):
    """Lines of the table; a ratio stands where the optimum is the best one. Returns the `Ratios`."""
    optimum = min((e.last["objective"] for e in entries.values() if e.success), default=float("nan"))
    rivals = [
        e for (s, b), e in entries.items() if s == "Ipopt" and b in STOCK and e.reaches(optimum, tolerance)
    ]
    rival = min(rivals, key=lambda e: e.least, default=None)
    variables = entries["apsides", STRATEGIES[0]].last["variables"]
    equal_settings, stock = {}, {}
    for entry in entries.values():
        last = entry.last
        ratio = same = ""
        equal = entries["Ipopt", entry.strategy]
        here = entry.reaches(optimum, tolerance)
        if entry.solver == "apsides" and equal.reaches(optimum, tolerance) and here:
            equal_settings[entry.strategy] = equal.least / entry.least
            same = f"{equal_settings[entry.strategy]:.2f}"
        if rival is not None and entry.solver == "apsides" and here:
            stock[entry.strategy] = rival.least / entry.least
            ratio = f"{stock[entry.strategy]:.2f}"
        elif entry is rival:
            ratio = "rival"
        print(
            line(
                label, variables, f"{entry.solver} {entry.strategy}", last["iterations"], f"{entry.least:.2f}",
                f"{entry.median:.2f}", f"{entry.least / max(last['iterations'], 1):.3f}",
                f"{last['evaluation_ms']:.2f}", f"{entry.build:.2f}",
                f"{sign * last['objective']:.9g}", f"{(last['objective'] - optimum) / abs(optimum):.1e}",
                ratio, same, last["status"],
            )
        )
    sys.stdout.flush()
    ours, theirs = least(entries, optimum, tolerance)
    best = theirs / ours if ours and theirs else None
    return Ratios(equal_settings, best, stock)
