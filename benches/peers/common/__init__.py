"""What the comparisons share: CasADi with one thread, the programs of this package, Ipopt's settings and its runs."""

import os
import sys
import time

from programs import ROOT, built, output  # noqa: F401 for the scripts

# One thread each: set before any library reads it.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

try:
    import casadi
    import numpy
except ImportError as error:
    print(f"skipped: {error.name} is not installed (pip install casadi)")
    sys.exit(0)

# What all comparisons state; everything else is Ipopt's default.
STOCK = {
    "tol": 1e-8,
    # MUMPS is the free linear solver that comes with CasADi; HSL is not free.
    "linear_solver": "mumps",
    # As apsides: bounds widened by Ipopt's 1e-8 move optima by more than their digits.
    "bound_relax_factor": 1e-10,
    "max_iter": 3000,
    "print_level": 0,
    "sb": "yes",
}
# Strategies of the barrier parameter, by the names of the programs. "trajectory" is what apsides-radau uses by default:
# adaptive with probing, from a small barrier parameter and multipliers of its size; "flatness" is the default of
# apsides-flatness, monotone from there.
STRATEGIES = {
    "monotone": {},
    "quality": {"mu_strategy": "adaptive"},
    "probing": {"mu_strategy": "adaptive", "mu_oracle": "probing"},
    "trajectory": {
        "mu_strategy": "adaptive",
        "mu_oracle": "probing",
        "mu_init": 1e-3,
        "bound_mult_init_val": 1e-3,
    },
    "flatness": {"mu_init": 1e-3, "bound_mult_init_val": 1e-3},
}
STATUS = {"Solve_Succeeded": "optimal", "Solved_To_Acceptable_Level": "acceptable"}
SUCCESS = tuple(STATUS.values())


def evaluate(formula, inputs):
    """The outputs of a formula of apsides on the given expressions."""
    values = list(inputs)
    for name, *operands in formula["operations"]:
        if name == "constant":
            values.append(casadi.SX(float(operands[0])))
        elif name in ("powi", "powf"):
            values.append(values[operands[0]] ** float(operands[1]))
        else:
            values.append(FUNCTIONS[name](*(values[k] for k in operands)))
    return [values[k] for k in formula["outputs"]]


FUNCTIONS = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "neg": lambda a: -a,
    "recip": lambda a: 1 / a,
    "ln": casadi.log,
} | {
    name: getattr(casadi, name)
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "exp", "sinh", "cosh", "tanh")
}


def variables(description):
    """Symbols of all variables, and their values in SI units."""
    units = description["variable_units"]
    scaled = casadi.SX.sym("x", len(units))
    return scaled, [v * unit for v, unit in zip(casadi.vertsplit(scaled), units)]


def parts(description, x):
    """The rows, and the parts of the cost, each with a column that it depends on; both in SI units, as are the variables `x`."""
    rows = [casadi.SX(0) for _ in description["row_units"]]
    costs = [(column, x[column] * weight) for column, weight in description["linear_cost"]]
    for row, column, value in description["linear_rows"]:
        rows[row] += value * x[column]
    for term in description["terms"]:
        inputs = casadi.SX.sym("z", term["formula"]["inputs"])
        outputs = casadi.vertcat(*evaluate(term["formula"], casadi.vertsplit(inputs)))
        function = casadi.Function("term", [inputs], [outputs])
        initial, final = (x[k] for k in term["times"] or (0, 0))
        for i, columns in enumerate(term["columns"]):
            z = [x[column] for column in columns]
            if term["times"]:
                fraction = term["fractions"][i]
                z.append((1 - fraction) * initial + fraction * final)
            factor = term["factors"][i] * ((final - initial) if term["rate"] else 1)
            values = [factor * v for v in casadi.vertsplit(function(casadi.vertcat(*z)))]
            for row, weight, value in zip(term["rows"][i], term["costs"], values):
                if row is not None:
                    rows[row] += value
                if weight:
                    costs.append((columns[0], weight * value))
    return rows, costs


def assembled(description):
    """The nonlinear program of formulas and index lists, as expanded (SX) expressions in its units."""
    scaled, x = variables(description)
    rows, costs = parts(description, x)
    cost = sum((value for _, value in costs), casadi.SX(0))
    g = casadi.vertcat(*(row / unit for row, unit in zip(rows, description["row_units"])), casadi.SX(0, 1))
    f, g = casadi.cse([cost / description["objective_unit"], g])
    return {"x": scaled, "f": f, "g": g}


class Peer:
    """Solvers of one nonlinear program by a plugin of CasADi; `nlp` and `arguments` in the units of the transcription."""

    def __init__(self, plugin, nlp, arguments, objective_unit, expand=False):
        self.plugin, self.nlp, self.arguments, self.objective_unit, self.expand = plugin, nlp, arguments, objective_unit, expand
        self.solvers, self.build_ms = {}, {}

    def make(self, key, settings):
        """Makes the solver `key`."""
        clock = time.process_time()
        options = {"expand": self.expand, "print_time": False, "record_time": True} | settings
        self.solvers[key] = casadi.nlpsol("peer", self.plugin, self.nlp, options)
        self.build_ms[key] = (time.process_time() - clock) * 1e3

    def solve(self, key, milliseconds=0.0):
        """Solves until so much CPU time is spent, once at least: times in ms, iterations, objective, status."""
        solver, times = self.solvers[key], []
        while not times or sum(times) < milliseconds:
            solution = solver(**self.arguments)
            stats = solver.stats()
            times.append(stats["t_proc_total"] * 1e3)
        return {
            "solve_ms": times,
            "build_ms": self.build_ms[key],
            "iterations": stats["iter_count"],
            "objective": float(solution["f"]) * self.objective_unit,
            "status": self.status(stats),
            "evaluation_ms": 1e3 * sum(v for k, v in stats.items() if k.startswith("t_proc_nlp_")),
        }

    def status(self, stats):
        """The word of apsides for the status of a solve."""
        return STATUS.get(stats["return_status"], stats["return_status"])


class Problem(Peer):
    """A nonlinear program for Ipopt: `nlp` in the units of `numbers`, whose values it must have."""

    def __init__(self, numbers, nlp, tolerance, expand=False):
        clock = time.process_time()
        super().__init__("ipopt", nlp, start_and_bounds(numbers), numbers["objective_unit"], expand)
        self.check(numbers, tolerance)
        self.check_ms = (time.process_time() - clock) * 1e3

    def check(self, numbers, tolerance):
        """Both sides must have written down the same program."""
        units, row_units = numpy.array(numbers["variable_units"]), numpy.array(numbers["row_units"])
        values = casadi.Function("values", [self.nlp["x"]], [self.nlp["f"], self.nlp["g"]])
        for sample in numbers["samples"]:
            f, g = values(numpy.array(sample["point"]) / units)
            off = abs(float(f) * self.objective_unit - sample["objective"])
            assert off <= tolerance * max(1.0, abs(sample["objective"])), f"objectives differ by {off:.1e}"
            rows = numpy.array(sample["rows"]) / row_units
            off = numpy.abs(numpy.array(g).ravel() - rows) / numpy.maximum(1.0, numpy.abs(rows))
            assert numpy.all(off <= tolerance), f"constraints differ by {numpy.max(off):.1e}"

    def build(self, key, settings):
        """Makes the solver `key`."""
        self.make(key, {f"ipopt.{name}": value for name, value in (STOCK | settings).items()})


def start_and_bounds(numbers):
    """Start and bounds in the units of `numbers`, as CasADi's solvers take them."""
    array = {key: numpy.array(numbers[key], dtype=float) for key in ARRAYS}
    for key in ("lower", "upper", "row_lower", "row_upper"):
        array[key][numpy.abs(array[key]) >= INFINITE] *= numpy.inf
    units, row_units = array["variable_units"], array["row_units"]
    return {
        "x0": array["start"] / units,
        "lbx": array["lower"] / units,
        "ubx": array["upper"] / units,
        "lbg": array["row_lower"] / row_units,
        "ubg": array["row_upper"] / row_units,
    }


ARRAYS = ("start", "lower", "upper", "row_lower", "row_upper", "variable_units", "row_units")
# Bounds of this size are none, to Ipopt too.
INFINITE = 1e19
