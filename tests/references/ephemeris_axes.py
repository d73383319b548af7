"""Time scales and axes of bodies, by ERFA (astropy) and by SPICE (spiceypy).

Scales: the instants of some dates in UTC and in TDB, as seconds from J2000 of TAI, TT and TDB. ERFA has the series of Fairhead and Bretagnon
for TDB, 1.7 ns at its epoch of fit, at the geocentre.

Axes: rotation from J2000 (the axes of the ICRF) to IAU_EARTH, IAU_MOON and IAU_MARS with its rate, row by row, by SPICE's own evaluation of
the constants of NAIF's pck00011.tpc (Archinal et al. 2018), which stand below. A place: a state relative to the body, to J2000.
"""

import numpy as np
import spiceypy as spice
from astropy.time import Time

POOL = {
    "BODY399_POLE_RA": [0.0, -0.641, 0.0],
    "BODY399_POLE_DEC": [90.0, -0.557, 0.0],
    "BODY399_PM": [190.147, 360.9856235, 0.0],
    "BODY301_POLE_RA": [269.9949, 0.0031, 0.0],
    "BODY301_POLE_DEC": [66.5392, 0.0130, 0.0],
    "BODY301_PM": [38.3213, 13.17635815, -1.4e-12],
    "BODY301_NUT_PREC_RA": [-3.8787, -0.1204, 0.0700, -0.0172, 0.0, 0.0072, 0.0, 0.0, 0.0, -0.0052, 0.0, 0.0, 0.0043],
    "BODY301_NUT_PREC_DEC": [1.5419, 0.0239, -0.0278, 0.0068, 0.0, -0.0029, 0.0009, 0.0, 0.0, 0.0008, 0.0, 0.0, -0.0009],
    "BODY301_NUT_PREC_PM": [3.5610, 0.1208, -0.0642, 0.0158, 0.0252, -0.0066, -0.0047, -0.0046, 0.0028, 0.0052, 0.0040, 0.0019, -0.0044],
    "BODY3_NUT_PREC_ANGLES": [
        125.045, -1935.5364525, 250.089, -3871.072905, 260.008, 475263.3328725, 176.625, 487269.629985, 357.529, 35999.0509575,
        311.589, 964468.49931, 134.963, 477198.869325, 276.617, 12006.300765, 34.226, 63863.5132425, 15.134, -5806.6093575,
        119.743, 131.84064, 239.961, 6003.1503825, 25.053, 473327.79642,
    ],
    "BODY499_POLE_RA": [317.269202, -0.10927547, 0.0],
    "BODY499_POLE_DEC": [54.432516, -0.05827105, 0.0],
    "BODY499_PM": [176.049863, 350.891982443297, 0.0],
    "BODY499_NUT_PREC_RA": [0.0] * 10 + [0.000068, 0.000238, 0.000052, 0.000009, 0.419057],
    "BODY499_NUT_PREC_DEC": [0.0] * 15 + [0.000051, 0.000141, 0.000031, 0.000005, 1.591274],
    "BODY499_NUT_PREC_PM": [0.0] * 20 + [0.000145, 0.000157, 0.000040, 0.000001, 0.000001, 0.584542],
    "BODY4_NUT_PREC_ANGLES": [
        190.72646643, 15917.10818695, 21.46892470, 31834.27934054, 332.86082793, 19139.89694742, 394.93256437, 38280.79631835,
        189.63271560, 41215158.18420050, 121.46893664, 660.22803474, 231.05028581, 660.99123540, 251.37314025, 1320.50145245,
        217.98635955, 38279.96125550, 196.19729402, 19139.83628608, 198.991226, 19139.4819985, 226.292679, 38280.8511281,
        249.663391, 57420.7251593, 266.183510, 76560.6367950, 79.398797, 0.5042615, 122.433576, 19139.9407476,
        43.058401, 38280.8753272, 57.663379, 57420.7517205, 79.476401, 76560.6495004, 166.325722, 0.5042615,
        129.071773, 19140.0328244, 36.352167, 38281.0473591, 56.668646, 57420.9295360, 67.364003, 76560.2552215,
        104.792680, 95700.4387578, 95.391654, 0.5042615,
    ],
}

DATES = [
    ("utc", "1972-01-01T00:00:00"),
    ("utc", "1985-07-01T00:00:00"),
    ("utc", "1999-12-31T23:59:59.25"),
    ("utc", "2016-12-31T23:59:60.5"),
    ("utc", "2017-01-01T00:00:00"),
    ("utc", "2026-07-14T06:30:15.125"),
    ("tdb", "2030-01-01T00:00:00"),
    ("tt", "1969-07-20T20:17:40"),
    ("tai", "2049-04-03T12:00:00.75"),
    ("tdb", "2099-10-31T18:45:00"),
]
INSTANTS = ["1969-07-20T20:17:40", "2000-01-01T12:00:00", "2013-12-14T13:11:18", "2030-01-01T00:00:00", "2077-05-05T05:05:05.5"]
STATE = {"EARTH": [4.1e6, -3.9e6, 3.0e6, 120.0, -7300.0, 900.0], "MOON": [-0.9e6, 1.2e6, 0.95e6, 15.0, 1600.0, -4.0],
         "MARS": [2.2e6, 2.4e6, -1.1e6, -3400.0, 80.0, 5.0]}


def seconds(time):
    """Seconds from J2000 in the scale of the time."""
    return ((time.jd1 - 2451545.0) + time.jd2) * 86400.0


def main():
    for scale, text in DATES:
        time = Time(text, scale=scale, format="isot")
        tai, tt, tdb = (getattr(time, s) for s in ("tai", "tt", "tdb"))
        print(f"scales {text} {scale.upper()} {seconds(tai):.6f} {seconds(tt):.6f} {seconds(tdb):.6f}")

    for name, values in POOL.items():
        spice.pdpool(name, values)
    for body, state in STATE.items():
        for text in INSTANTS:
            # TDB is SPICE's own time: seconds from J2000.
            et = seconds(Time(text, scale="tdb", format="isot"))
            turn = np.array(spice.sxform("J2000", f"IAU_{body}", et))
            assert np.allclose(turn[:3, :3] @ turn[:3, :3].T, np.eye(3), atol=1e-14)
            print(f"axes {body} {text} " + " ".join(f"{v:.17e}" for v in [*turn[:3, :3].ravel(), *turn[3:, :3].ravel()]))
            back = np.linalg.solve(turn, np.array(state))
            print(f"state {body} {text} " + " ".join(f"{v:.16e}" for v in [*state, *back]))


if __name__ == "__main__":
    main()
