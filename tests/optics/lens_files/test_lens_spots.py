"""Spots of imported lenses, on the axis and off it, against an independent trace of skew rays."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_optics.lens_files.importing import figures, imported

from tests.optics.lens_files.skew_rays import Face, spot

WITHIN = 1e-3  # relative error of spot radius and centroid that the import promises

TRIPLET = [  # 50 mm f/5, with rims that vignette off-axis beams
    Face(1 / 22.01359, 3.25896, 1.62041, rim=6.0),
    Face(-1 / 435.76044, 6.00755),
    Face(-1 / 22.21328, 0.99997, 1.62004),
    Face(1 / 20.29192, 0.0),
    Face(0.0, 4.75041, rim=3.9, is_stop=True),
    Face(1 / 79.6836, 2.95208, 1.62041),
    Face(-1 / 18.39533, 42.20778, rim=5.5),
]
STOP = Face(0.0, 3.0, rim=5.0, is_stop=True)
LENSES = {
    "spheres": TRIPLET,
    # rays far outside the beam also pass the stop after strong refraction; they do not count
    "spheres without rims": [
        face if face.is_stop else face._replace(rim=np.inf) for face in TRIPLET
    ],
    "conic": [STOP, Face(0.01, 4.0, 1.5, 0.4), Face(-1 / 30, 50.0, 1.0, -1.8)],
    "even asphere": [
        STOP,
        Face(1 / 40, 4.0, 1.6, -0.5, {4: -4e-6, 6: 2e-8, 8: -3e-10}),
        Face(-1 / 60, 40.0),
    ],
    "odd asphere": [
        STOP,
        Face(1 / 60, 5.0, 1.5),
        Face(-1 / 40, 45.0, 1.0, 0.0, {3: -2e-4, 4: 3e-6, 5: 1e-7}),
    ],
}
ALL_SHAPES = [
    STOP,
    Face(1 / 35, 4.0, 1.6, -0.7, {4: 2e-6, 6: -1e-8}, rim=5.6),
    Face(-1 / 50, 2.0, 1.0, 0.0, {3: -1e-4, 5: 2e-7}),
    Face(-1 / 45, 1.5, 1.7),
    Face(1 / 300, 60.0, 1.0, 3.0),
]
FIELD_DEG = 15.0
WIDEST_MM = 9.0  # half width of a square in the plane of the first vertex that holds every beam


def zmx(path, faces):
    """Write faces as a Zemax file of one wavelength."""
    lines = ["NAME lens", "UNIT MM X W X CM MR CPMM", "FTYP 0 0 2 1 0 0 0", f"YFLN 0 {FIELD_DEG}"]
    lines += ["WAVM 1 0.58756 1", "PWAV 1", "SURF 0", "  TYPE STANDARD", "  DISZ INFINITY"]
    for number, face in enumerate(faces, 1):
        odd = any(power % 2 for power in face.terms)
        shape = ("ODDASPHE" if odd else "EVENASPH") if face.terms else "STANDARD"
        lines += [f"SURF {number}", *["  STOP"] * face.is_stop, f"  TYPE {shape}"]
        lines += [f"  CURV {face.curvature:.17g} 0 0 0 0", f"  CONI {face.conic}"]
        per = 1 if odd else 2  # PARM k is the coefficient of r to the power k * per
        lines += [f"  PARM {power // per} {a:.17g}" for power, a in face.terms.items()]
        lines += [f"  DISZ {face.distance:.17g}"]
        if np.isfinite(face.rim):
            lines.append(f"  DIAM {face.rim} 1 0 0 1")
        if face.index != 1:
            lines.append(f"  GLAS I{face.index:g} 0 0 1.5 40 0 0")
    path.write_text("\n".join([*lines, f"SURF {len(faces) + 1}", "  TYPE STANDARD", "  DISZ 0"]))
    return path


def check(path, faces):
    """Compare the spots of an imported lens file with those of the skew ray trace."""
    glass = [f"I{index:g}={index:g}" for index in {face.index for face in faces} - {1.0}]
    found = figures(imported(zmx(path, faces), glass).lens)
    assert [angle for angle, _, _ in found.spots] == pytest.approx([0.0, 10.5, FIELD_DEG])
    for angle_deg, radius_um, centroid_mm in found.spots:
        wanted = spot(faces, angle_deg, WIDEST_MM)
        assert radius_um == pytest.approx(1e3 * wanted.radius, rel=WITHIN)
        # the centroid on the axis is 0 with 1e-9 mm of rounding
        assert centroid_mm == pytest.approx(wanted.centroid, rel=WITHIN, abs=1e-9)
        # much stricter than a share of the image height: within a hundredth of the spot's radius
        assert abs(centroid_mm - wanted.centroid) < 0.01 * wanted.radius


@pytest.mark.slow
@pytest.mark.parametrize("name", LENSES)
def test_spots_of_one_shape_of_surface_agree_with_skew_rays(tmp_path, name):
    check(tmp_path / "lens.zmx", LENSES[name])


def test_spots_of_all_shapes_of_surfaces_agree_with_skew_rays(tmp_path):
    check(tmp_path / "lens.zmx", ALL_SHAPES)
