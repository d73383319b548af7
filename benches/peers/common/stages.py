"""A transcribed problem in stages, for fatrop: the same nonlinear program, its variables in another order and its equations combined.

fatrop solves programs of the form x[k+1] = F(x[k], u[k]) with constraints on (x[k], u[k]). An interval of collocation is a stage: x has the
states at its start, and what all intervals share (times that are free), carried along; u has all else of the interval. A state at the
interval's end is in one equation of each point: that with the largest coefficient, solved for it, is a component of F, and its multiples
are taken off the others, which are constraints of the stage then. What bounds fix is a constant, as it is to Ipopt.
"""

from . import Peer, casadi, numpy, parts, start_and_bounds, variables

# As the settings of Ipopt in `common`, as far as fatrop has them.
STOCK = {"tol": 1e-8, "max_iter": 3000, "print_level": 0}
# The barrier parameter is monotone and bound multipliers are 1 at the start: of a strategy it has the first barrier parameter.
STRATEGIES = {"monotone": {"mu_init": 0.1}, "trajectory": {"mu_init": 1e-3}}
NOTES = {"trajectory": "; fatrop monotone from 1e-3"}


class Stages:
    """Columns and rows of a description, on intervals of so many points, by stages."""

    def __init__(self, description, points, fixed):
        dynamics = [term for term in description["terms"] if term["rate"] and None not in term["rows"][0]]
        assert len(dynamics) == 1, f"stages are made of one phase, not of {len(dynamics)}"
        nodes = dynamics[0]["columns"]
        last = len(nodes) // points
        at = {c: i // points for i, node in enumerate(nodes) for c in node}
        # States at the end of the last interval are in its equations, but not at its points.
        self.column = {c: last for _, c, _ in description["linear_rows"]} | at
        self.row = {r: self.column[c] for t in description["terms"] for (c, *_), rows in zip(t["columns"], t["rows"]) for r in rows}
        # Costs have no row.
        self.row.pop(None, None)
        self.shared = [c for c in range(len(fixed)) if c not in self.column and not fixed[c]]
        # Linear entries in a stage of their own, and of states at the end of the interval: by column, with their rows.
        self.inner, ends = [], {}
        for r, c, value in description["linear_rows"]:
            if self.column[c] == self.row[r] or fixed[c]:
                self.inner.append((r, c, value))
            else:
                ends.setdefault(c, []).append((r, value * description["variable_units"][c] / description["row_units"][r]))
        # Rows of the stages as combinations of the given ones.
        self.gaps, self.paths = {}, {r: {r: 1.0} for r in self.row}
        for c, equations in ends.items():
            pivot, largest = max(equations, key=lambda equation: abs(equation[1]))
            self.gaps[c] = {pivot: 1.0 / largest}
            del self.paths[pivot]
            for r, value in equations:
                if r != pivot:
                    self.paths[r][pivot] = -value / largest
        free = [c for c in self.column if not fixed[c]]
        self.states = by_stage(((c, self.column[c]) for c in free if c in ends), last)
        self.others = by_stage(((c, self.column[c]) for c in free if c not in ends), last)
        self.path = by_stage(((r, self.row[r]) for r in self.paths), last)

    def sizes(self):
        """The options of the plugin that say the structure."""
        return {
            "structure_detection": "manual",
            "N": len(self.states) - 1,
            "nx": [len(self.shared) + len(stage) for stage in self.states],
            "nu": [len(stage) for stage in self.others],
            "ng": [len(stage) for stage in self.path],
        }

    def columns(self):
        """Those of all stages in order."""
        return [c for states, others in zip(self.states, self.others) for c in self.shared + states + others]

    def rows(self):
        """Those of each stage in order, as combinations of the given ones: nothing for what is carried along."""
        follow = [[{} for _ in self.shared] + [self.gaps[c] for c in states] for states in self.states[1:]] + [[]]
        return [gaps + [self.paths[r] for r in path] for gaps, path in zip(follow, self.path)]


def by_stage(pairs, last):
    """Lists of what belongs to each stage, from pairs of thing and stage; nothing is after the last one."""
    lists = [[] for _ in range(last + 1)]
    for thing, stage in pairs:
        lists[stage].append(thing)
    return lists


def posed(description, stages, values):
    """The nonlinear program; columns without a stage have the given values."""
    scaled, x = variables(description)
    symbols = casadi.vertsplit(scaled)
    rows, costs = parts(description | {"linear_rows": stages.inner}, x)
    rows = [row / unit for row, unit in zip(rows, description["row_units"])]
    last = len(stages.states) - 1
    # The cost of what is carried along is that at the end.
    costs = by_stage(((value, stages.column.get(c, last)) for c, value in costs), last)
    copies = [[casadi.SX.sym(f"shared_{c}") for c in stages.shared] for _ in stages.states]
    free = set(stages.columns())
    constants = [c for c in range(len(values)) if c not in free]
    order, f, g = [], [], []
    for k, (here, combinations) in enumerate(zip(copies, stages.rows())):
        order += here + [symbols[c] for c in stages.states[k] + stages.others[k]]
        made = [casadi.vertcat(*(sum(w * rows[r] for r, w in row.items()) for row in combinations), casadi.SX(0, 1)), sum(costs[k], casadi.SX(0))]
        old = casadi.vertcat(*(symbols[c] for c in stages.shared + constants), casadi.SX(0, 1))
        made, cost = casadi.substitute(made, [old], [casadi.vertcat(*here, *values[constants], casadi.SX(0, 1))])
        if k + 1 < len(copies):
            follow = copies[k + 1] + [symbols[c] for c in stages.states[k + 1]]
            carried = [-copy for copy in here] + [0] * len(stages.states[k + 1])
            made += casadi.vertcat(*(a + b for a, b in zip(follow, carried)), casadi.SX(made.numel() - len(follow), 1))
        g.append(made)
        f.append(cost)
    f, g = casadi.cse([sum(f) / description["objective_unit"], casadi.vertcat(*g)])
    return {"x": casadi.vertcat(*order), "f": f, "g": g}


class Staged(Peer):
    """The program of a description for fatrop; `nlp` is the same one as assembled for Ipopt."""

    def __init__(self, description, points, nlp, tolerance):
        whole = start_and_bounds(description)
        fixed = whole["lbx"] == whole["ubx"]
        self.stages = Stages(description, points, fixed)
        columns = numpy.array(self.stages.columns())
        rows = [row for stage in self.stages.rows() for row in stage]
        taken = {key: whole[key][columns] for key in ("x0", "lbx", "ubx")}
        taken |= {key: combined(rows, whole[key]) for key in ("lbg", "ubg")}
        # What is carried along has its bounds once, in the first stage.
        again = numpy.isin(columns, self.stages.shared)
        again[: len(self.stages.shared)] = False
        taken["lbx"][again], taken["ubx"][again] = -numpy.inf, numpy.inf
        super().__init__("fatrop", posed(description, self.stages, whole["lbx"]), taken, description["objective_unit"])
        for sample in description["samples"]:
            point = numpy.array(sample["point"]) / description["variable_units"]
            self.check(nlp, columns, rows, numpy.where(fixed, whole["lbx"], point), tolerance)

    def check(self, nlp, columns, rows, point, tolerance):
        """Both forms must be the same program."""
        f, g = casadi.Function("values", [nlp["x"]], [nlp["f"], nlp["g"]])(point)
        own = casadi.Function("values", [self.nlp["x"]], [casadi.vertcat(self.nlp["g"], self.nlp["f"])])(point[columns])
        given = numpy.append(combined(rows, numpy.array(g).ravel()), float(f))
        off = numpy.abs(numpy.array(own).ravel() - given) / numpy.maximum(1.0, numpy.abs(given))
        assert numpy.all(off <= tolerance), f"the program in stages differs by {numpy.max(off):.1e}"

    def build(self, key):
        """Makes the solver of a strategy."""
        self.make(key, self.stages.sizes() | {"fatrop": STOCK | STRATEGIES[key]})

    def status(self, stats):
        return "optimal" if stats["success"] else stats["unified_return_status"]


def combined(rows, values):
    """Values of rows that are combinations of given ones."""
    return numpy.array([sum(weight * values[r] for r, weight in row.items()) for row in rows])
