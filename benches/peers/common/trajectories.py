"""Transcribed problems by apsides and its peers in turns: runs, and the table that the comparisons of trajectories print."""

import statistics
import sys
from typing import NamedTuple

from . import SUCCESS, output

PEERS = ("Ipopt", "fatrop")
STRATEGIES = ("monotone", "quality", "trajectory")
STOCK = ("monotone", "quality")


class Ratios(NamedTuple):
    """Times of peers over those of apsides on one problem, where both reach the best optimum."""

    equal: dict
    """By peer and strategy, the peer with the same settings."""
    best: float | None
    """The fastest of all strategies on either side, of all peers."""
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

    def verdict(self, optimum, tolerance):
        """Status, and whether the best optimum was missed."""
        missed = self.success and not self.reaches(optimum, tolerance)
        return f"{self.last['status']}, but not the best optimum" if missed else self.last["status"]


def in_turns(command, flags, peers, turns, milliseconds):
    """Entries by solver and strategy; `command` and the `flags` of a strategy run apsides, each of the `peers` repeats for `milliseconds`
    with the strategies that it has a solver for."""
    runs = {("apsides", strategy): [] for strategy in flags}
    runs |= {(name, strategy): [] for name, peer in peers.items() for strategy in peer.solvers}
    for _ in range(turns):
        for strategy in flags:
            run = output(*command, *flags[strategy])
            run["build_ms"] = min(run["setup_ms"])
            runs["apsides", strategy].append(run)
            for name, peer in peers.items():
                if strategy in peer.solvers:
                    runs[name, strategy].append(peer.solve(strategy, milliseconds))
    return {key: Entry(*key, value) for key, value in runs.items()}


def optimum_of(entries):
    """The best objective of all solves that ended well."""
    return min((e.last["objective"] for e in entries.values() if e.success), default=float("nan"))


def least(entries, optimum, tolerance):
    """Least time of apsides and of its peers among the strategies that reach the optimum, and the peer whose it is."""
    reaching = [e for e in entries.values() if e.reaches(optimum, tolerance)]
    ours = min((e.least for e in reaching if e.solver == "apsides"), default=None)
    fastest = min((e for e in reaching if e.solver != "apsides"), key=lambda e: e.least, default=None)
    return ours, fastest and fastest.least, fastest.solver if fastest else "none"


def equal(entries, optimum, tolerance):
    """Pairs of apsides and a peer with equal settings that both reach the optimum, by peer and strategy."""
    pairs = {key: (entries["apsides", key[1]], entry) for key, entry in entries.items() if key[0] != "apsides"}
    return {key: pair for key, pair in pairs.items() if all(e.reaches(optimum, tolerance) for e in pair)}


def apart(pair):
    """Relative difference of two objectives."""
    a, b = (e.last["objective"] for e in pair)
    return abs(a - b) / max(abs(a), abs(b), 1e-300)


COLUMNS = (
    ("problem", 21), ("variables", 9), ("solver", 18), ("iterations", 10), ("solve ms", 9), ("median", 9),
    ("ms/iteration", 12), ("evaluation ms", 13), ("build ms", 9), ("objective", 16), ("difference", 10), ("stock", 6), ("Ipopt", 6),
    ("fatrop", 6), ("status", 0),
)


def line(*cells):
    return " ".join(f"{cell:>{width}}" for cell, (_, width) in zip(cells, COLUMNS))


def heading():
    print("Times in ms of CPU time of one thread, solve: minimum and median.")
    print("Difference: to the best optimum, relative. Ratios peer / apsides, by minima, at that optimum:")
    print("stock: the faster of Ipopt's monotone and adaptive strategy; by the name of a peer: with the settings of the row.")
    print(line(*(name for name, _ in COLUMNS)))


def report(label, sign, entries, tolerance):
    """Lines of the table; a ratio stands where the optimum is the best one. Returns the `Ratios`."""
    optimum = optimum_of(entries)
    rivals = [
        e for (s, b), e in entries.items() if s == "Ipopt" and b in STOCK and e.reaches(optimum, tolerance)
    ]
    rival = min(rivals, key=lambda e: e.least, default=None)
    variables = entries["apsides", STRATEGIES[0]].last["variables"]
    same = {key: theirs.least / ours.least for key, (ours, theirs) in equal(entries, optimum, tolerance).items()}
    stock = {}
    for entry in entries.values():
        last = entry.last
        ratio, peers = "", [""] * len(PEERS)
        if entry.solver == "apsides":
            peers = [f"{same[name, entry.strategy]:.2f}" if (name, entry.strategy) in same else "" for name in PEERS]
        if rival is not None and entry.solver == "apsides" and entry.reaches(optimum, tolerance):
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
                ratio, *peers, entry.verdict(optimum, tolerance),
            )
        )
    sys.stdout.flush()
    ours, theirs, _ = least(entries, optimum, tolerance)
    best = theirs / ours if ours and theirs else None
    return Ratios(same, best, stock)
