"""Distortion: maps between ideal and distorted tangents, and their exact inverses.

Ideal (x, y) are tangents of the field angle, as in scene radiance; distorted ones are sensor position / focal length. Maps are
frozen
dataclasses with `forward(x, y)` and `inverse(x, y)`; the inverse is exact to 1e-12 wherever the map is one to one, and an
error elsewhere.
Light is moved by `distortion_resample`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NEWTON_STEPS = 60
CLOSE = 1e-13  # of the field: residual of an inverse


@dataclass(frozen=True)
class BrownConrady:
    """Radial and tangential polynomial (D. C. Brown, Photogramm. Eng. 32, 444 (1966)), in OpenCV's order of names."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    def forward(self, x, y):
        """Return distorted (x, y): x (1 + k1 r^2 + ...) + 2 p1 x y + p2 (r^2 + 2 x^2), and y alike."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        r2 = x**2 + y**2
        radial = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return (
            x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x**2),
            y * radial + self.p1 * (r2 + 2 * y**2) + 2 * self.p2 * x * y,
        )

    def _jacobian(self, x, y):
        r2 = x**2 + y**2
        radial = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        steep = 2 * (self.k1 + r2 * (2 * self.k2 + 3 * r2 * self.k3))
        cross = steep * x * y + 2 * self.p1 * x + 2 * self.p2 * y
        return (
            radial + steep * x**2 + 2 * self.p1 * y + 6 * self.p2 * x,
            cross,
            radial + steep * y**2 + 6 * self.p1 * y + 2 * self.p2 * x,
        )

    def inverse(self, x, y):
        """Return ideal (x, y) by Newton's method; ValueError where the polynomial folds the field over."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        u, v, det = x.copy(), y.copy(), np.ones(x.shape)
        for _ in range(NEWTON_STEPS):
            a, b = self.forward(u, v)
            dx, dy = a - x, b - y
            xx, xy, yy = self._jacobian(u, v)
            det = xx * yy - xy**2
            with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
                u, v = u - (yy * dx - xy * dy) / det, v - (xx * dy - xy * dx) / det
            if np.all(np.hypot(dx, dy) <= CLOSE * (1 + np.hypot(x, y))):
                break
        _check_inverse(np.hypot(dx, dy), np.hypot(x, y), (det > 0) & self._single(np.hypot(u, v)))
        return u, v

    def _single(self, radius):
        """Return whether distorted radius still grows everywhere up to `radius`, by the radial part alone."""
        r = np.linspace(0, 1, 257)[:, None] * np.atleast_1d(np.nanmax(radius, initial=0.0))
        grows = 1 + r**2 * (3 * self.k1 + r**2 * (5 * self.k2 + r**2 * 7 * self.k3))
        first = r[np.argmax(grows <= 0)] if np.any(grows <= 0) else np.inf
        return radius < first


@dataclass(frozen=True)
class KannalaBrandt:
    """Fisheye: radius = angle + k1 angle^3 + k2 angle^5 + ... (Kannala and Brandt, IEEE Trans. PAMI 28, 1335 (2006), eq. 6)."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0

    def radius(self, angle_rad):
        """Return the distorted radius at a field angle, any angle up to pi."""
        t2 = np.square(angle_rad)
        return angle_rad * (1 + t2 * (self.k1 + t2 * (self.k2 + t2 * (self.k3 + t2 * self.k4))))

    def angle_rad(self, radius):
        """Return the field angle at a distorted radius; ValueError beyond the largest radius of the fisheye."""
        radius = np.asarray(radius, float)
        grid = np.linspace(0, np.pi, 2049)
        curve = self.radius(grid)
        turn = int(np.argmax(np.diff(curve) <= 0)) if np.any(np.diff(curve) <= 0) else len(grid) - 1
        if np.any(radius > curve[turn]):
            raise ValueError(
                f"radius {radius.max():.6g} is beyond {curve[turn]:.6g}, where this fisheye polynomial stops to grow; "
                "expected a smaller field"
            )
        angle = np.interp(radius, curve[: turn + 1], grid[: turn + 1])
        for _ in range(8):  # from a table of 2049 points: doubled digits each time
            t2 = angle**2
            slope = 1 + t2 * (3 * self.k1 + t2 * (5 * self.k2 + t2 * (7 * self.k3 + t2 * 9 * self.k4)))
            angle = angle - (self.radius(angle) - radius) / slope
        return angle

    def forward(self, x, y):
        """Return distorted (x, y) of tangents."""
        return _radially(x, y, lambda r: self.radius(np.arctan(r)))

    def inverse(self, x, y):
        """Return tangents (x, y); ValueError at 90 degrees and more, which have none (use `angle_rad`)."""

        def tangent(r):
            angle = self.angle_rad(r)
            if np.any(angle >= np.pi / 2):
                raise ValueError(f"field angle {np.degrees(angle.max()):.3g} degrees has no tangent; expected below 90")
            return np.tan(angle)

        return _radially(x, y, tangent)


@dataclass(frozen=True)
class RadialTable:
    """A table of distorted radius against ideal tangent: monotonic cubic of their ratio; both begin above 0 and rise."""

    tangent: tuple[float, ...]
    radius: tuple[float, ...]

    def __post_init__(self):
        t, r = np.array(self.tangent, float), np.array(self.radius, float)
        if len(t) != len(r) or len(t) < 2 or not (t[0] > 0 and r[0] > 0 and np.all(np.diff(t) > 0) and np.all(np.diff(r) > 0)):
            raise ValueError(
                "a distortion table needs two columns of one length, both above 0 and rising: a falling radius has no inverse"
            )
        fine = np.linspace(0, t[-1], 4001)
        if np.any(np.diff(self._radius(fine)) <= 0):
            raise ValueError("the distortion table turns back between its points; expected more points or a smaller field")

    def _ratio(self):
        from scipy.interpolate import PchipInterpolator

        t, r = np.array(self.tangent, float), np.array(self.radius, float)
        squares, ratio = np.concatenate([[0.0], t**2]), r / t
        # on the axis: the line through the first two ratios in tangent^2, which is what third-order distortion does
        start = ratio[0] - (ratio[1] - ratio[0]) / (t[1] ** 2 - t[0] ** 2) * t[0] ** 2
        return PchipInterpolator(squares, np.concatenate([[start], ratio]), extrapolate=False)

    def _radius(self, tangent):
        return tangent * self._ratio()(np.square(tangent))

    def forward(self, x, y):
        """Return distorted (x, y); ValueError beyond the table."""
        return _radially(x, y, lambda r: self._checked(r, self.tangent[-1], self._radius))

    def inverse(self, x, y):
        """Return ideal (x, y), by Newton's method safeguarded by bisection; ValueError beyond the table."""
        return _radially(x, y, lambda r: self._checked(r, self._radius(self.tangent[-1]), self._tangent))

    def _checked(self, value, largest, function):
        if np.any(value > largest * (1 + 1e-12)):
            raise ValueError(f"field {np.max(value):.6g} is beyond the distortion table, which ends at {largest:.6g}")
        return function(np.minimum(value, largest))

    def _tangent(self, radius):
        ratio = self._ratio()
        slope, low, high = ratio.derivative(), np.zeros_like(radius), np.full_like(radius, self.tangent[-1])
        t = np.interp(radius, (0.0, *self.radius), (0.0, *self.tangent))
        for _ in range(NEWTON_STEPS):
            miss = t * ratio(t**2) - radius
            low, high = np.where(miss < 0, t, low), np.where(miss >= 0, t, high)
            if np.all(np.abs(miss) <= CLOSE):
                break
            step = t - miss / (ratio(t**2) + 2 * t**2 * slope(t**2))
            t = np.where((step > low) & (step < high), step, (low + high) / 2)
        return t


def of_prescription(lens, largest_tangent: float, wavelength_nm: float | None = None, count: int = 33) -> RadialTable:
    """Return the distortion of a lens prescription from traced chief rays, as a table up to `largest_tangent`."""
    from .prescription_figures import distortion

    tangent = np.linspace(0, largest_tangent, count + 1)[1:]
    return RadialTable(tuple(tangent), tuple(tangent * (1 + distortion(lens, tangent, wavelength_nm))))


def _radially(x, y, function):
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    r = np.hypot(x, y)
    if np.any(~np.isfinite(r)):
        raise ValueError("a position is NaN or infinite; expected finite tangents")
    new = function(r)
    axis = max(float(np.max(r, initial=0.0)), 1.0) * 1e-9
    unit = function(np.full(1, axis))[0] / axis
    scale = np.where(r > axis, new / np.maximum(r, axis), unit)
    return x * scale, y * scale


def _check_inverse(miss, radius, single):
    if not np.all((miss <= 1e2 * CLOSE * (1 + radius)) & single):
        raise ValueError(
            f"no single ideal position belongs to distorted radius {np.max(radius):.6g}: the polynomial folds back; "
            "expected a smaller field or other coefficients"
        )
