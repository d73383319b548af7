"""Optima of the problems in tests/problems that have no closed form: collocation of degree 3 with Ipopt from many starts.

    python held_out.py [NAME ..]

The program reads the files of tests/problems as they are, so that a mistake in a statement would have to be made twice: once by this reader and
once by the project's own. Each phase is cut into equal intervals with three Radau points; states are continuous polynomials, controls are free at
the points. The first mesh starts from the straight line and from random waves about it; the best point is carried to finer meshes. Path
constraints hold at the points alone, so that an optimum with an arc is approached from below. Prints the objective on the last mesh and its
relative change from the one before.
"""

import math
import pathlib
import random
import re
import sys
import tomllib

import casadi as ca
import numpy as np

FOLDER = pathlib.Path(__file__).parent.parent / "problems"
DEGREE = 3
MESHES = [30, 120, 480]
STARTS = 3
# Last meshes differ by less, relative to the objective.
AGREE = 1e-4

FUNCTIONS = {
    name: getattr(ca, name)
    for name in "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log sqrt sign atan2".split()
}
FUNCTIONS.update(
    ln=ca.log,
    abs=ca.fabs,
    pow=lambda a, b: a**b,
    hypot=lambda *a: ca.sqrt(sum(x * x for x in a)),
    min=lambda a, *b: ca.fmin(a, FUNCTIONS["min"](*b)) if b else a,
    max=lambda a, *b: ca.fmax(a, FUNCTIONS["max"](*b)) if b else a,
    clamp=lambda x, least, most: ca.fmax(least, ca.fmin(most, x)),
    IF=lambda condition, then, otherwise: ca.if_else(condition, then, otherwise),
)
UNITS = dict(m=1, km=1e3, mm=1e-3, kg=1, t=1e3, s=1, day=86400, N=1, kN=1e3, kW=1e3, rad=1, deg=math.pi / 180, au=149597870700)
QUANTITY = re.compile(r"\s*([-+0-9.eE]+)\s+([A-Za-z].*)")


def unit(text):
    if not text:
        return 1.0
    text = re.sub(r"([A-Za-z]+)(\d)", r"\1**\2", text.replace("^", "**"))
    return float(eval(re.sub(r"(?<=[A-Za-z0-9)]) +(?=[A-Za-z(])", "*", text), {}, UNITS))


def formula(text, names):
    if isinstance(text, (int, float)):
        return float(text)
    text = re.sub(r"\[([^\]]*)\]", lambda m: f"*{unit(m.group(1))!r}", text).replace("^", "**")
    return eval(re.sub(r"\bif\(", "IF(", text), {"__builtins__": {}}, names)


def number(value, names, in_unit=1.0):
    if isinstance(value, (int, float)):
        return float(value) * in_unit
    stated = QUANTITY.fullmatch(value)
    return float(stated.group(1)) * unit(stated.group(2)) if stated else float(formula(value, names))


class Part:
    """A name with others behind a point."""

    def __init__(self, parts):
        self.__dict__.update(parts)


def as_table(value):
    if isinstance(value, list):
        return {"min": value[0], "max": value[1]}
    return {"unit": value} if isinstance(value, str) else value


class Problem:
    def __init__(self, path):
        self.file = tomllib.loads(path.read_text())
        self.names = dict(FUNCTIONS, pi=math.pi, g0=9.80665)
        for name, value in self.file.get("constants", {}).items():
            self.names[name] = number(value, self.names)

    def with_definitions(self, more):
        names = {**self.names, **more}
        definitions = self.file.get("definitions", {})
        for _ in definitions:
            for name, text in definitions.items():
                try:
                    names[name] = formula(text, names)
                except NameError:
                    pass  # defined by one that comes later, or by quantities that are not here
        return names

    def range(self, value, in_unit=1.0):
        if value is None or value == "free":
            return -np.inf, np.inf
        if isinstance(value, list):
            return tuple(number(v, self.names, in_unit) for v in value)
        return (number(value, self.names, in_unit),) * 2

    def bounds(self, quantity):
        u = unit(quantity.get("unit"))
        return tuple(number(quantity[k], self.names, u) if k in quantity else s * np.inf for k, s in (("min", -1), ("max", 1)))

    def guess_of(self, phase):
        guess = self.file.get("guess", {})
        return guess if len(self.file["phase"]) == 1 else guess.get(phase, {})

    def scale(self, phase, name, quantity):
        """The size of a quantity: of its ends and guess, else of its bounds."""
        u = unit(quantity.get("unit"))
        ends = [v for end in ("start", "end") for v in self.range(quantity.get(end), u)]
        known = [abs(v) for v in ends if np.isfinite(v) and v != 0]
        known = known or [abs(v) for v in self.bounds(quantity) if np.isfinite(v) and v != 0]
        return max(known) if known else 1.0

    def comparison(self, row, names):
        """A formula with its bounds."""
        if isinstance(row, dict):
            u = unit(row.get("unit"))
            least, most = (row.get("equals", row.get(k)) for k in ("min", "max"))
            low = -np.inf if least is None else number(least, self.names, u)
            return formula(row["value"], names), low, np.inf if most is None else number(most, self.names, u)
        parts = re.split(r"(<=|>=|==)", row)
        if len(parts) == 5:
            return formula(parts[2], names), float(formula(parts[0], names)), float(formula(parts[4], names))
        difference = formula(parts[0], names) - formula(parts[2], names)
        return difference, -np.inf if parts[1] == "<=" else 0.0, np.inf if parts[1] == ">=" else 0.0

    def transcribe(self, intervals):
        """Unknowns, in units of their scales, are keyed (phase, name, fraction); times and parameters have no fraction."""
        tau = np.append(0, ca.collocation_points(DEGREE, "radau"))
        basis = [np.poly1d(np.delete(tau, j), True) / np.prod(tau[j] - np.delete(tau, j)) for j in range(DEGREE + 1)]
        slopes = np.array([np.polyder(b)(tau) for b in basis])
        weights = [np.polyint(b)(1.0) for b in basis]
        self.keys, self.scales, symbols, low, high, rows, row_low, row_high = [], [], [], [], [], [], [], []

        def unknown(key, least, most, scale=1.0):
            symbol = ca.MX.sym("x")
            symbols.append(symbol)
            low.append(least / scale)
            high.append(most / scale)
            self.keys.append(key)
            self.scales.append(scale)
            return scale * symbol

        def row(value, least, most, scale=1.0):
            rows.append(value / scale)
            row_low.append(least / scale)
            row_high.append(most / scale)

        parameters = {k: unknown(("", k, None), *self.bounds(v)) for k, v in self.file.get("parameters", {}).items()}
        ends, last = {}, None
        for phase, stated in self.file["phase"].items():
            states = {k: as_table(v) for k, v in stated["states"].items()}
            controls = {k: as_table(v) for k, v in stated.get("controls", {}).items()}
            scales = {k: self.scale(phase, k, v) for k, v in (states | controls).items()}
            times = stated["time"]
            spans = [v for v in self.range(times.get("end")) + self.range(times.get("duration")) if np.isfinite(v)]
            time_scale = max([abs(v) for v in spans if abs(v) < 1e6] or [1.0])
            begin = self.range(times.get("start")) if "start" in times or last is not None else (0.0, 0.0)
            start_time = unknown((phase, "start", None), *begin, time_scale)
            end_time = unknown((phase, "end", None), *self.range(times.get("end")), time_scale)
            if last is not None and "start" not in times:
                row(start_time - last, 0.0, 0.0, time_scale)
            span, last = end_time - start_time, end_time
            least, most = self.range(times.get("duration"))
            row(span, max(least, 0.0), most, time_scale)

            def state_at(fraction, end=None):
                values = {}
                for k, quantity in states.items():
                    (a, b), (c, d) = self.bounds(quantity), self.range(quantity.get(end), unit(quantity.get("unit")))
                    a, b = (c, d) if c == d else (max(a, c), min(b, d))
                    values[k] = unknown((phase, k, fraction), a, b, scales[k])
                return values

            current = first = state_at(0.0, "start")
            integrals = dict.fromkeys(stated.get("integrals", {}), 0.0)
            for i in range(intervals):
                fractions = [(i + t) / intervals for t in tau]
                points = [current]
                points += [state_at(f, "end" if f == 1.0 else None) for f in fractions[1:]]
                for j in range(1, DEGREE + 1):
                    control = {k: unknown((phase, k, fractions[j]), *self.bounds(v), scales[k]) for k, v in controls.items()}
                    time = start_time + fractions[j] * span
                    names = self.with_definitions({**parameters, **points[j], **control, "time": time})
                    for k in states:
                        rate = formula(stated["dynamics"][k], names)
                        row(sum(slopes[r, j] * points[r][k] for r in range(DEGREE + 1)) - span / intervals * rate, 0.0, 0.0, scales[k])
                    for text in stated.get("path", {}).values():
                        row(*self.comparison(text, names))
                    for k, v in stated.get("integrals", {}).items():
                        integrals[k] += weights[j] / intervals * span * formula(v["value"] if isinstance(v, dict) else v, names)
                current = points[-1]
            for k, v in stated.get("integrals", {}).items():
                if isinstance(v, dict):
                    row(*self.comparison({**v, "value": k}, integrals))
            both = (dict(first, time=start_time), dict(current, time=end_time))
            ends[phase] = {"start": Part(both[0]), "end": Part(both[1]), "duration": span, "scales": scales, **integrals}
        for one, joint in self.file.get("links", {}).items():
            joint = {"to": joint} if isinstance(joint, str) else joint
            before, after = ends[one]["end"].__dict__, ends[joint["to"]]["start"].__dict__
            for k in before.keys() & after.keys() - {"time", *joint.get("free", [])}:
                jump = number(joint.get("jump", {}).get(k, 0.0), self.names)
                row(after[k] - before[k] - jump, 0.0, 0.0, ends[one]["scales"][k])
        names = {**parameters, **{phase: Part(parts) for phase, parts in ends.items()}}
        if len(ends) == 1:
            names.update(next(iter(ends.values())))
        names = self.with_definitions(names)
        for text in self.file.get("boundary", {}).values():
            row(*self.comparison(text, names))
        goal = self.file["objective"]
        self.sign = 1.0 if "minimize" in goal else -1.0
        objective = self.sign * formula(goal.get("minimize", goal.get("maximize")), names)
        self.low, self.high = np.array(low), np.array(high)
        options = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-10, "ipopt.max_iter": 1000}
        nlp = {"x": ca.vertcat(*symbols), "f": objective, "g": ca.vertcat(*rows)}
        solver = ca.nlpsol("solver", "ipopt", nlp, {**options, "ipopt.bound_relax_factor": 0.0, "ipopt.mu_strategy": "adaptive"})

        def solve(start):
            found = solver(x0=np.clip(start, self.low, self.high), lbx=low, ubx=high, lbg=row_low, ubg=row_high)
            return solver.stats()["success"], self.sign * float(found["f"]), np.array(found["x"]).ravel()

        return solve

    def line(self, phase, name, fraction):
        """Guess, else the straight line between the ends, else the middle of the bounds."""
        if not phase:
            return self.file["parameters"][name]["guess"]
        stated = self.file["phase"][phase]
        guess = self.guess_of(phase)
        if fraction is None:
            if "time" in guess:
                return number(guess["time"][name == "end"], self.names)
            low, high = self.range(stated["time"].get(name))
            return 0.5 * (max(low, -1e3) + min(high, 1e3)) if np.isfinite(low + high) else max(low, 0.0)
        quantity = as_table((stated["states"] | stated.get("controls", {}))[name])
        u = unit(quantity.get("unit"))
        if name in guess:
            value = guess[name]
            if isinstance(value, list):
                values = [number(v, self.names, u) for v in value]
                return float(np.interp(fraction, np.linspace(0, 1, len(values)), values))
            return float(formula(value, {**self.names, "fraction": fraction})) if isinstance(value, str) else value * u
        ends = [self.range(quantity.get(end), u) for end in ("start", "end")]
        middles = [0.5 * sum(e) if np.isfinite(sum(e)) else None for e in ends]
        bounds = self.bounds(quantity)
        if middles == [None, None]:
            middles = [0.5 * sum(bounds) if np.isfinite(sum(bounds)) else 0.0] * 2
        a, b = (m if m is not None else middles[1 - i] for i, m in enumerate(middles))
        return a + (b - a) * fraction

    def start(self, waves):
        """The line, with random waves of the size of each quantity on it."""
        amplitudes, values = {}, []
        for (phase, name, fraction), scale in zip(self.keys, self.scales):
            value = self.line(phase, name, fraction) / scale
            if waves and fraction is None:
                value *= math.exp(waves.gauss(0.0, 0.2))
            elif waves:
                own = amplitudes.setdefault((phase, name), [waves.gauss(0.0, 0.5) / (k + 1) for k in range(5)])
                value += sum(a * math.sin((k + 1) * math.pi * fraction) for k, a in enumerate(own))
            values.append(value)
        return np.array(values)

    def carried(self, keys, scales, found):
        """A point of another mesh at the unknowns of this one."""
        series = {}
        for (phase, name, fraction), scale, value in zip(keys, scales, found):
            series.setdefault((phase, name), []).append((fraction, scale * value))
        values = []
        for (phase, name, fraction), scale in zip(self.keys, self.scales):
            of = series[(phase, name)]
            value = of[0][1] if fraction is None else np.interp(fraction, *zip(*sorted(of)))
            values.append(value / scale)
        return np.array(values)


def optimum(name):
    problem = Problem(FOLDER / f"{name}.toml")
    solve = problem.transcribe(MESHES[0])
    random_waves = random.Random(1)
    runs = [solve(problem.start(random_waves if k else None)) for k in range(STARTS)]
    runs = [run for run in runs if run[0]]
    for run in sorted(runs, key=lambda run: problem.sign * run[1]):
        found = on_finer_meshes(problem, *run)
        if found:
            return found
    raise AssertionError(f"{name}: no start whose meshes agree")


def on_finer_meshes(problem, success, objective, point):
    """Objective and its change; none where a coarse mesh had passed a singularity between its points."""
    problem.transcribe(MESHES[0])
    for intervals in MESHES[1:]:
        before, (keys, scales) = objective, (problem.keys, problem.scales)
        solve = problem.transcribe(intervals)
        success, objective, point = solve(problem.carried(keys, scales, point))
        if not success:
            return None
    change = (objective - before) / abs(objective)
    return (objective, change) if abs(change) < AGREE else None


if __name__ == "__main__":
    rows = tomllib.loads((FOLDER / "expected.toml").read_text())
    chosen = sys.argv[1:] or sorted(name for name, row in rows.items() if row.get("source") == "held_out.py")
    for name in chosen:
        objective, change = optimum(name)
        print(f"{name:44} {objective:.12g}  {change:+.1e}", flush=True)
