"""Injection into geostationary orbit with several burns in the equatorial plane: numbers and guess.

Modified equinoctial elements p, f, g, L; units: parking radius, circular speed there, first mass. A coast of free
length changes L alone, so that the burns are all there is to solve.
"""

import math
import tomllib
from dataclasses import dataclass


@dataclass(frozen=True)
class Injection:
    """Numbers of a mission file."""

    burns: int
    acceleration: float  # thrust / first mass
    flow: float
    radius: float  # of the target
    dry_mass: float
    kilograms: float
    seconds: float

    @staticmethod
    def read(text):
        mission = tomllib.loads(text)
        parking = 1e3 * (mission["body_radius_km"] + mission["parking_altitude_km"])
        speed = math.sqrt(1e9 * mission["gravitational_parameter_km3_s2"] / parking)
        mass, seconds = mission["initial_mass_kg"], parking / speed
        return Injection(
            burns=mission["burns"],
            acceleration=mission["thrust_n"] / mass * seconds / speed,
            flow=mission["thrust_n"] / (mission["isp_s"] * 9.80665) * seconds / mass,
            radius=1e3 * mission["target_radius_km"] / parking,
            dry_mass=1.0 - mission["propellant_kg"] / mass,
            kilograms=mass,
            seconds=seconds,
        )

    @property
    def exhaust_speed(self):
        return self.acceleration / self.flow

    def propellant(self, durations):
        """In kg."""
        return self.kilograms * self.flow * float(sum(durations))


@dataclass(frozen=True)
class Guess:
    """The impulsive transfer: burns of equal times at perigee, ignitions symmetric to the apses.

    The first ignition is at longitude zero.
    """

    durations: list
    longitudes: list  # of ignitions, ascending
    swept: list  # longitude travelled by each burn
    orbits: list  # p and eccentricity before the first burn and after each
    perigee: float  # its longitude
    costates: list  # of p, f, g and burn time before the first burn, cost: the burn time


def guess(injection):
    """Costates: gradient of the cost of the impulses to go."""
    target, exhaust, perigees = injection.radius, injection.exhaust_speed, injection.burns - 1
    arrival = math.sqrt(2.0 / (target * (1.0 + target)))
    first, second = target * arrival - 1.0, 1.0 / math.sqrt(target) - arrival
    last_mass = math.exp(-(first + second) / exhaust)
    share = (1.0 - math.exp(-first / exhaust)) / injection.flow / perigees
    last = (math.exp(-first / exhaust) - last_mass) / injection.flow
    speeds = [1.0 - exhaust * math.log(1.0 - injection.flow * share * k) for k in range(perigees + 1)]
    swept = [0.5 * share * (a + b) for a, b in zip(speeds, speeds[1:])]
    swept.append(last * (arrival + 0.5 * second) / target)
    perigee = 0.5 * swept[0]
    apses = [perigee + 2.0 * math.pi * k for k in range(perigees)]
    apses.append(apses[-1] + math.pi)
    # Sum of both impulses from an orbit of perigee radius p / (1 + e), by p and e, where p = 1 and e = 0.
    by_radius = 0.5 * arrival * (-1.0 / (1.0 + target) - 1.0)
    by_radius = target * by_radius - 0.5 * arrival * target / (1.0 + target)
    by_p, by_e = by_radius + 0.5, -by_radius - 1.0
    scale = last_mass / (injection.flow * exhaust)
    return Guess(
        durations=[share] * perigees + [last],
        longitudes=[apsis - 0.5 * angle for apsis, angle in zip(apses, swept)],
        swept=swept,
        orbits=[(v * v, v * v - 1.0) for v in speeds] + [(target, 0.0)],
        perigee=perigee,
        costates=[
            scale * by_p,
            scale * by_e * math.cos(perigee),
            scale * by_e * math.sin(perigee),
            last_mass - 1.0,
        ],
    )
