"""Hazard maps by OpenCV and NumPy in float32, written from the definitions, in turns with `hazard`.

Full layers on both sides: slope of the least-squares plane, largest residual, largest contact slope of four footpads in 18
headings, exact distance to the nearest pixel that is not safe, first site on the spiral. See README.md.
"""

import os
import sys
import tempfile
import time

import findings
from common import ROOT, built, numpy, output

try:
    import cv2
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (pip install opencv-python-headless)")
    sys.exit(0)

# Preset, size of a pixel, radii of the disk, of the circle of the footpads and of a footpad, limits of slope, deg, and roughness.
COARSE = ("chang-e-3-coarse", 1.0, 5.0, 2.5, 0.0, 8.0, 0.30, 5.0)
FINE = ("chang-e-3-fine", 0.1, 2.5, 2.5, 0.25, 8.0, 0.15, 2.5)
CASES = {
    "1000 x 1000 at 1 m": (1000, "gale_hirise_1m.tif", COARSE),
    "2300 x 2300 at 1 m": (2300, "gale_hirise_1m.tif", COARSE),
    "1000 x 1000 at 0.1 m": (1000, "rocky_scene_0p1m.npy", FINE),
}
HEADINGS = 18


def disk(radius):
    """Row and column offsets within a radius in pixels."""
    reach = int(numpy.floor(radius + 1e-9))
    south, east = numpy.mgrid[-reach : reach + 1, -reach : reach + 1]
    return reach, south, east, south**2 + east**2 <= radius**2 + 1e-9


class Maps:
    """Layers of a map or of a strip of it, for the pixels that are `margin` inside."""

    def __init__(self, z, case):
        _, pixel, radius, circle, pad, _, _, _ = case
        self.z, self.pixel = z, pixel
        self.reach, self.south, self.east, self.inside = disk(radius / pixel)
        self.circle, self.pad = circle / pixel, disk(pad / pixel)
        self.margin = max(self.reach, int(numpy.ceil(self.circle - 1e-9)) + 1)
        rows, cols = z.shape
        self.shape = rows - 2 * self.margin, cols - 2 * self.margin

    def at(self, image, south, east):
        """The pixels at an offset."""
        (rows, cols), m = self.shape, self.margin
        return image[m + south : m + south + rows, m + east : m + east + cols]

    def plane(self):
        inside = self.inside.astype(numpy.float32)
        moment = float((self.east[self.inside] ** 2).sum())
        kernels = [inside / inside.sum(), inside * self.east / moment, inside * self.south / moment]
        found = [cv2.filter2D(self.z, cv2.CV_32F, kernel.astype(numpy.float32)) for kernel in kernels]
        self.mean, self.gx, self.gy = (numpy.ascontiguousarray(self.at(image, 0, 0)) for image in found)
        self.steep = (self.gx**2 + self.gy**2) / numpy.float32(self.pixel**2)
        return numpy.arctan(numpy.sqrt(self.steep))

    def roughness(self):
        largest = numpy.zeros(self.shape, numpy.float32)
        work = numpy.empty_like(largest)
        for south in range(-self.reach, self.reach + 1):
            half = int(self.inside[south + self.reach].sum()) // 2
            plane = cv2.scaleAdd(self.gy, south, self.mean)
            plane = cv2.scaleAdd(self.gx, -half, plane)
            for east in range(-half, half + 1):
                cv2.absdiff(self.at(self.z, south, east), plane, work)
                cv2.max(largest, work, largest)
                cv2.add(plane, self.gx, plane)
        return largest / numpy.sqrt(1 + self.steep)

    def sample(self, top, south, east):
        """Bilinear heights at an offset."""
        near = [round(south), round(east)]
        south, east = (n if abs(v - n) < 1e-9 else v for v, n in zip((south, east), near))
        row, col = int(numpy.floor(south)), int(numpy.floor(east))
        south, east = south - row, east - col
        total = None
        for dy, dx, weight in (
            (0, 0, (1 - south) * (1 - east)),
            (0, 1, (1 - south) * east),
            (1, 0, south * (1 - east)),
            (1, 1, south * east),
        ):
            if weight:
                part = self.at(top, row + dy, col + dx)
                total = cv2.multiply(part, weight) if total is None else cv2.scaleAdd(part, weight, total)
        return total

    def footpads(self):
        top = self.z
        if self.pad[0]:
            top = cv2.dilate(self.z, self.pad[3].astype(numpy.uint8))
        largest = numpy.zeros(self.shape, numpy.float32)
        for k in range(HEADINGS):
            angle = numpy.pi / 2 * k / HEADINGS
            s, c = self.circle * numpy.sin(angle), self.circle * numpy.cos(angle)
            p = [self.sample(top, *o) for o in ((s, c), (c, -s), (-s, -c), (-c, s))]
            # The higher diagonal bears; squares of 2 rho times the tangents along and across it.
            one, other = cv2.subtract(p[0], p[2]), cv2.subtract(p[1], p[3])
            lead = cv2.subtract(cv2.add(p[0], p[2]), cv2.add(p[1], p[3]))
            lower = numpy.where(lead >= 0, other, one)
            size, lower = numpy.abs(lead, lead), numpy.abs(lower, lower)
            mixed = cv2.multiply(size, cv2.scaleAdd(lower, 2.0, size))
            tilt = cv2.add(cv2.add(cv2.multiply(one, one), cv2.multiply(other, other)), mixed)
            cv2.max(largest, tilt, largest)
        return numpy.arctan(numpy.sqrt(largest) / numpy.float32(2 * self.circle * self.pixel))

    def layers(self):
        return self.plane(), self.roughness(), self.footpads()


def hazards(z, case, strip):
    """Layers, clearance, site, and seconds of each part. `strip` rows at a time, or all."""
    _, pixel, _, _, _, slope_limit, rough_limit, clear = case
    whole = Maps(z, case)
    margin, pads = whole.margin, whole.pad[0]
    rows, cols = z.shape
    found = [numpy.full(z.shape, numpy.nan, numpy.float32) for _ in range(3)]
    strip = strip or rows
    for first in range(margin, rows - margin, strip):
        last = min(first + strip, rows - margin)
        # A footpad at the edge of a strip has its pixels beyond.
        above, below = min(pads, first - margin), min(pads, rows - margin - last)
        parts = Maps(z[first - margin - above : last + margin + below], case).layers()
        for layer, part in zip(found, parts):
            layer[first:last, margin : cols - margin] = part[above : len(part) - below]
    slope, rough, foot = found
    limit = numpy.float32(numpy.radians(slope_limit))
    safe = (slope <= limit) & (rough <= numpy.float32(rough_limit)) & (foot <= limit)
    distance = cv2.distanceTransform(safe.astype(numpy.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    clearance = distance * numpy.float32(pixel)
    return [slope, rough, foot, clearance], int(safe.sum()), spiral(clearance, clear)


def spiral(clearance, least):
    """First pixel with the clearance on the clockwise spiral from the middle: row, column, pixels seen."""
    rows, cols = clearance.shape
    row, col, seen, leg = rows // 2, cols // 2, 0, 0
    steps = ((0, 1), (1, 0), (0, -1), (-1, 0))
    length, left = 1, 1
    while leg < 4 * max(rows, cols):
        if 0 <= row < rows and 0 <= col < cols:
            seen += 1
            if clearance[row, col] >= least:
                return [row, col, seen]
        row, col = row + steps[leg % 4][0], col + steps[leg % 4][1]
        left -= 1
        if left == 0:
            leg += 1
            length = leg // 2 + 1
            left = length
    return None


def heights(file, size, folder):
    """A map of the folder, mirrored as often as need be; hills with boulders if it is not there."""
    path = os.path.join(folder, file)
    if not os.path.exists(path):
        print(f"{path} is not there: a made-up map instead", file=sys.stderr)
        fine = file.endswith(".npy")
        pixel = 0.1 if fine else 1.0
        north, east = numpy.mgrid[:size, :size] * pixel
        z = sum(
            h * numpy.sin(east / d) * numpy.cos((north + 1.3 * east) / d)
            for d, h in ((97.0, 3.0), (31.0, 0.5), (11.0, 0.1))
        )
        z[numpy.random.default_rng(1).random(z.shape) < 1e-3] += 0.5 * pixel
        return z.astype(numpy.float32)
    if file.endswith(".npy"):
        # The last column is none.
        z = numpy.load(path)[:, :-1]
    else:
        z = cv2.imread(path, cv2.IMREAD_UNCHANGED)
    tile = numpy.block([[z, z[:, ::-1]], [z[::-1], z[::-1, ::-1]]])
    times = [-(-size // n) for n in tile.shape]
    z = numpy.tile(tile, times)[:size, :size].astype(numpy.float64)
    # Near zero, where float32 has its digits.
    return (z - numpy.round((z.min() + z.max()) / 2)).astype(numpy.float32)


def main():
    parser = findings.parser(__doc__)
    parser.add_argument("--maps", default=os.path.join(os.path.dirname(ROOT), "shared", "terrain"))
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--strip", type=int, default=64, help="rows at a time of the second variant of the peer")
    arguments = parser.parse_args()
    program = built("hazard")
    header = ["map", "threads", "apsides", "verdicts alone", "OpenCV", "ratio", f"OpenCV, strips of {arguments.strip} rows", "ratio"]
    rows, notes = [], []
    found = findings.Findings("Hazard maps", "All layers of both sides; OpenCV in strips of rows that stay in the cache.")
    for name in arguments.cases:
        size, file, case = CASES[name]
        z = heights(file, size, arguments.maps)
        with tempfile.TemporaryDirectory() as folder:
            path, layers = os.path.join(folder, "map"), os.path.join(folder, "layers")
            z.tofile(path)
            call = [program, path, "--cols", size, "--pixel", case[1], "--preset", case[0]]
            for threads in arguments.threads:
                cv2.setNumThreads(threads)
                best = [float("inf")] * 4
                for _ in range(arguments.turns):
                    ours = output(*call, "--threads", threads, "--repeat", 3, "--layers", layers)
                    quick = output(*call, "--threads", threads, "--repeat", 3, "--verdicts")
                    best[0], best[1] = min(best[0], ours["seconds"]), min(best[1], quick["seconds"])
                    assert quick["safe"] == ours["safe"], "verdicts differ with and without layers"
                    for k, strip in ((2, 0), (3, arguments.strip)):
                        clock = time.perf_counter()
                        theirs = hazards(z, case, strip)
                        best[k] = min(best[k], time.perf_counter() - clock)
                a, b, c, d = best
                found.add(f"{name}, threads: {threads}", "OpenCV", 1e3 * a, 1e3 * min(c, d), f"{ours['safe']} and {theirs[1]} safe pixels")
                rows.append([name, str(threads), f"{a:.3f} s", f"{b:.3f} s", f"{c:.2f} s", f"{c / a:.1f}", f"{d:.2f} s", f"{d / a:.1f}"])
                print(rows[-1], file=sys.stderr, flush=True)
            notes.append(compared(name, ours, theirs, numpy.fromfile(layers, numpy.float32).reshape(4, size, size)))
    findings.write(arguments.findings, found)
    print("| " + " | ".join(header) + " |")
    print("| --- |" + " ---: |" * (len(header) - 1))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()
    for note in notes:
        print(note)


def compared(name, ours, theirs, layers):
    """How far both sides agree."""
    found, safe, site = theirs
    off = []
    for mine, other in zip(layers, found):
        known = ~numpy.isnan(mine) & ~numpy.isnan(other)
        off.append(float(numpy.abs(mine - other)[known].max()))
    angles = f"{numpy.degrees(off[0]):.1e} and {numpy.degrees(off[2]):.1e} deg"
    return (
        f"{name}: {ours['safe']} and {safe} safe pixels, sites {ours['site']} and {site}; "
        f"slopes differ by {angles} at most, roughness by {off[1]:.1e} m, clearance by {off[3]:.1e} m"
    )


if __name__ == "__main__":
    main()
