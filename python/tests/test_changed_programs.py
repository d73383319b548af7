"""A program that states a problem, with one mistake after the other: each is an exception of the package with a sentence and the line, in time."""

import linecache
import re
import time

import numpy as np
import pytest

import apsides

# Every part of the package's language. A line is a statement, so that a mistake has one line.
PROGRAM = """
import numpy as np, apsides
p = apsides.Problem("whole", "Every part of a problem")
mu = p.constant("mu", 398600.4418, "km3/s2", lower=1.0)
thrust = p.constant("thrust", 20, "kN", lower=1, upper=100, meaning="full thrust")
payload = p.parameter("payload", unit="kg", lower=10, upper=500, guess=100, scale=100)
density = apsides.table([0, 20e3, 40e3, 80e3, 120e3], [1.225, 0.088, 0.004, 2e-5, 1e-8], name="density")
map = apsides.table([0, 1, 2, 3], [[1, 2, 3, 4], [2, 3, 4, 5], [3, 4, 5, 6], [4, 5, 6, 7]], [0, 1, 2, 3])
ascent = p.phase("ascent", end=(50, 400))
h = ascent.state("h", unit="km", lower=0, upper=200, start=0)
v = ascent.state("v", unit="km/s", lower=0, upper=9, start=0.001, scale=1.0)
m = ascent.state("m", unit="kg", lower=500, upper=20000, start=(1000, 12000), guard="lower", tolerance=0.1)
throttle = ascent.control("throttle", lower=0, upper=1)
pitch = ascent.control("pitch", unit="deg", lower=-90, upper=90, rate=(-2, 2), start=90)
ascent.kink(h, 11)
drag = 0.5 * density(h) * v**2 * 3.0
ascent.dynamics(h=v * np.sin(pitch), v=(throttle * thrust - drag) / (m + payload) - mu / (6378e3 + h) ** 2 * np.sin(pitch), m=-throttle * thrust / 3138.0)
ascent.path(0.5 * density(h) * v**2, upper=40, unit="kPa", name="pressure", scale=10.0)
ascent.path(throttle * thrust / m <= 50.0, name="load")
loss = ascent.integral(mu / (6378e3 + h) ** 2, name="loss", unit="m/s", upper=4000)
coast = p.phase("coast", end=(60, 2000), duration=(1, 1500))
high, fast = coast.states("h v", unit=["km", "km/s"], lower=[0, 0], upper=[500, 9], end=[(100, 300), (0, 9)])
coast.dynamics([fast, -mu / (6378e3 + high) ** 2 + 0.0 * map(1.0, 2.0)])
p.link(ascent, coast, jump={"v": 0.0}, free=[])
p.constrain(m.end >= 600.0, name="enough")
p.constrain(high.end + 0.5 * fast.end**2 / 9.8, lower=50, unit="km", name="high")
p.maximize(high.end + 1e-3 * m.end - 0.1 * loss, name="height", unit="km", scale=100)
ascent.guess([0, 100, 200], h=[0, 30, 100], v=8.0 * ascent.time, pitch=45)
coast.guess(h=120)
"""

#: What is put in the place of a number.
OTHER_NUMBERS = ["float('nan')", "float('inf')", "None", "'a'", "[]", "1j", "-7e9"]

#: What is put in the place of a text.
OTHER_TEXTS = ["''", "'no such word'", "'metres'", "'km km'", "3", "None", "b'h'"]

#: The longest time for a message, s. Machines under load take a multiple of what is usual.
IN_TIME = 1.0

#: Python's own: a name or an argument that does not exist.
OF_PYTHON = (TypeError, NameError, SyntaxError, AttributeError)

#: What Rust says of a value that it cannot take apart, which tells a user nothing.
WITHOUT_HELP = ("failed to extract", "is not an instance of", "not supported between instances of 'NoneType'")


def state(lines, name):
    """Runs a program and poses its problem. Its exception, or None, and the seconds that it took."""
    text = "\n".join(lines)
    linecache.cache[name] = (len(text), None, [line + "\n" for line in lines], name)
    begin = time.perf_counter()
    try:
        namespace = {}
        exec(compile(text, name, "exec"), namespace)  # noqa: S102
        namespace["p"].mission()
    except Exception as e:  # noqa: BLE001
        return e, time.perf_counter() - begin
    return None, time.perf_counter() - begin


def changed(line):
    """Versions of a line with one mistake."""
    for found in re.finditer(r"(?<![\w.'\"])\d[\d.]*(e-?\d+)?(?![\w'\"])", line):
        for other in OTHER_NUMBERS:
            yield line[: found.start()] + other + line[found.end():]
    for found in re.finditer(r'"[^"]*"', line):
        for other in OTHER_TEXTS:
            yield line[: found.start()] + other + line[found.end():]
    for found in re.finditer(r"(?<=[(, ])[a-z_0-9]+=(\([^)]*\)|\[[^\]]*\]|[^,()]+)(, )?", line):
        yield line[: found.start()] + line[found.end():]
        yield line[: found.start()] + "no_" + line[found.start():]
    yield ""


def test_the_program_has_no_mistake():
    assert state(PROGRAM.splitlines(), "own.py")[0] is None


def test_hundreds_of_mistakes_each_have_a_sentence_and_a_place():
    lines = PROGRAM.splitlines()
    refused, tried = set(), 0
    for k, line in enumerate(lines):
        for other in changed(line) if "=" in line or "(" in line else ():
            error, seconds = state([*lines[:k], other, *lines[k + 1:]], "own.py")
            tried += 1
            assert seconds < IN_TIME, (other, seconds)
            if error is None:
                continue
            text = str(error)
            assert isinstance(error, (apsides.Error, *OF_PYTHON)), (other, repr(error))
            assert 12 < len(text) < 5000 and not any(part in text for part in WITHOUT_HELP), (other, text)
            if isinstance(error, apsides.IncompleteError):
                assert "missing is" in text or "missing are" in text, (other, text)
            elif isinstance(error, apsides.ProblemError):
                place = re.match(r"own\.py, line (\d+): ", text)
                assert place and 1 <= int(place[1]) <= len(lines), (other, text)
            elif isinstance(error, apsides.Error):
                # Of a function that stands for itself, which Python's traceback places.
                assert text.startswith(("a table: ", "table `")), (other, text)
            if isinstance(error, apsides.Error):
                refused.add((k, other))
    assert len(refused) >= 500, f"{len(refused)} of {tried} are refused"


@pytest.mark.parametrize(("part", "other", "line", "sentence"), [
    ('unit="km/s", lower=0, upper=9, start=0.001', 'unit="km/sek", lower=0, upper=9, start=0.001', 11, "no unit is named `sek`"),
    ("start=(1000, 12000)", "start=(12000, 1000)", 12, "12000"),
    ("upper=9, start=0.001", "upper=9, start=float('nan')", 11, "nan"),
    ("upper=[500, 9]", "upper=[500, 9, 3]", 22, "3 elements for 2 names"),
    ("coast.dynamics([fast,", "coast.dynamics([fast, fast,", 23, "these are 3 rates"),
    ("p.link(ascent, coast", "p.link(ascent, 'cost'", 24, "the nearest is `coast`"),
    ("jump={\"v\": 0.0}", "jump={\"w\": 0.0}", 24, "`w`"),
    ("free=[]", "free=[\"z\"]", 24, "`z`"),
    ("[0, 100, 200], h=[0, 30, 100]", "[0, 100, 50], h=[0, 30, 100]", 28, "increase"),
    ("coast.guess(h=120)", "coast.guess(hh=120)", 29, "known: `h`, `v`"),
    ("m.end >= 600.0", "m >= 600.0", 25, "many values"),
    ("high.end + 1e-3 * m.end", "throttle.end + 1e-3 * m.end", 27, "control"),
    ("pitch=45)", "pitch=float('inf'))", 28, "finite"),
    ("ascent.kink(h, 11)", "ascent.kink(throttle, 11)", 15, "no state `throttle`"),
])
def test_a_mistake_says_where_and_what(part, other, line, sentence):
    assert part in PROGRAM
    error, _ = state(PROGRAM.replace(part, other).splitlines(), "own.py")
    assert isinstance(error, apsides.Error) and sentence in str(error), repr(error)
    assert str(error).startswith(f"own.py, line {line}: "), str(error)


def with_rate(rate):
    p = apsides.Problem("large")
    ph = p.phase("run", end=1)
    x, u = ph.state("x", start=0.5), ph.control("u", lower=-1, upper=1)
    ph.dynamics(x=rate(x, u))
    p.minimize(x.end)
    begin = time.perf_counter()
    try:
        p.mission()
        return None, time.perf_counter() - begin
    except apsides.Error as e:
        return str(e), time.perf_counter() - begin


def test_large_and_deep_formulas_are_posed_or_refused():
    def long(x, u, factor=1e-3):
        total = u
        for k in range(50_000):
            total = total + factor * x if k % 2 else total - np.sin(u)
        return total

    def deep(x, u):
        for _ in range(50_000):
            x = np.sin(x + u)
        return x

    def doubled(x, u):
        for _ in range(200):
            x = np.tanh(x * x + x * u)
        return x

    for rate in (long, deep, doubled):
        assert with_rate(rate)[0] is None, rate.__name__
    message, seconds = with_rate(lambda x, u: long(x, u, float("nan")))
    assert "not a number" in message and "line" in message and seconds < IN_TIME, (message, seconds)
