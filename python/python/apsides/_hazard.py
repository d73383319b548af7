"""Hazard maps of elevation maps."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native


class HazardMap:
    """Layers, verdicts and clearance of an elevation map, arrays of its shape. Made by `hazard`."""

    def __init__(self, native: _native.Hazards) -> None:
        self._native = native
        self._shape = native.shape()

    @property
    def layers(self) -> list[str]:
        """Names of the layers."""
        return self._native.layers()

    @property
    def criteria(self) -> dict[str, Any]:
        """The criteria of a site."""
        return json.loads(self._native.criteria())

    def __getitem__(self, layer: str) -> np.ndarray:
        """A layer: angles in rad, lengths in m; not a number where the footprint has a gap."""
        found = self._native.layer(layer)
        if found is None:
            raise KeyError(f"there is no layer `{layer}`; there are {', '.join(self.layers)}")
        return found.reshape(self._shape)

    @property
    def safe(self) -> np.ndarray:
        """True where no threshold is broken."""
        return self._native.verdict().reshape(self._shape) == 1

    @property
    def verdict(self) -> np.ndarray:
        """1 where a pixel is safe, 0 where it is unsafe, -1 where it is unknown."""
        return self._native.verdict().reshape(self._shape)

    @property
    def clearance(self) -> np.ndarray:
        """Distance to the nearest pixel that is not safe, m."""
        return self._native.clearance().reshape(self._shape)

    def sites(self, count: int = 1, *, rule: Any = "clearance", separation_m: float = 0.0, start: tuple[int, int] | None = None) -> list[dict[str, Any]]:
        """The best landing sites, each a dictionary with ``row``, ``col``, ``position_m``, ``height_m``, ``clearance_m``.

        ``rule`` is ``"clearance"`` (the largest), ``"spiral"`` (the nearest to ``start``, the middle by default) or
        ``{"score": {"margin": 1.0, "clearance": 1.0, "divert_per_m": 1e-3}}``.
        """
        request = {"rule": rule, "count": count, "separation_m": separation_m, "start": None if start is None else list(start)}
        return json.loads(self._native.sites(json.dumps(request)))


def hazard(heights: ArrayLike, cell_m: float, criteria: str | dict[str, Any] = "chang-e-3-fine", **changed: Any) -> HazardMap:
    """The hazard map of heights.

    Parameters
    ----------
    heights : array of shape (rows, columns), m; row 0 is the northernmost, not a number is a gap
    cell_m : length of a cell, m
    criteria : name of known criteria or a dictionary; ``changed`` replaces some of them (``slope_max_deg=8``)

    >>> import apsides, numpy as np
    >>> flat = np.zeros((80, 80)); flat[40, 40] = 3.0
    >>> found = apsides.hazard(flat, 0.5)
    >>> bool(found.safe[40, 40]), bool(found.safe[20, 20])
    (False, True)
    """
    array = np.ascontiguousarray(heights, dtype=float)
    if array.ndim != 2:
        raise _native.Error(f"`heights` has the shape {array.shape}, allowed is (rows, columns)")
    known = json.loads(_native.known_criteria(criteria)) if isinstance(criteria, str) else criteria
    return HazardMap(_native.Hazards(array, float(cell_m), json.dumps({**known, **changed})))
