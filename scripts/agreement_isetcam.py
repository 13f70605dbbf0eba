"""Print how well isethdr agrees with numbers that ISETCam computed, as a table in Markdown.

    ISETHDR_REFERENCE=folder python scripts/agreement_isetcam.py

Each row is a quantity that tests compare. The tests record their largest difference in pytest's
report in XML, from which this script reads it. A test that fails, or that is skipped because the
reference numbers are missing, ends the script with exit code 2.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

TESTS = Path(__file__).resolve().parent.parent / "tests"
RELATIVE = "of the largest value"
ERRORS = "standard errors"


@dataclass(frozen=True)
class Row:
    """One row of the table.

    Parameters
    ----------
    recorded : name of the property that the test records.
    quantity : text of the compared quantity.
    test : file below `tests`, and the name of the test.
    limit : reason why the difference is not smaller.
    unit : unit of the difference.
    """

    recorded: str
    quantity: str
    test: str
    limit: str
    unit: str = RELATIVE


OPTICS = "optics/test_parity_isetcam.py"
SENSORS = "sensors/test_parity_isetcam.py"
COLOURS = "physics/colour/test_colour_spaces.py::test_agrees_with_isetcam"
LIGHTS = "physics/test_photometry.py::test_agrees_with_isetcam"
ROWS = (
    Row("luminance and XYZ of lights", "luminance, XYZ of lights", LIGHTS, "rounding"),
    Row("luminance of chart patches", "luminance of chart patches", LIGHTS, "single precision"),
    Row(
        "irradiance of a uniform scene",
        "irradiance of a uniform scene, 9 cases",
        f"{OPTICS}::test_irradiance_of_a_uniform_scene",
        "rounding",
    ),
    Row(
        "cos4 falloff",
        "cos4 falloff",
        f"{OPTICS}::test_cos4",
        "the original's near-field formula, which isethdr does not use",
    ),
    Row(
        "transfer function",
        "diffraction-limited transfer function",
        f"{OPTICS}::test_diffraction_transfer_function",
        "single precision",
    ),
    Row(
        "wavefront",
        "wavefront from Zernike coefficients",
        f"{OPTICS}::test_zernike_wavefront",
        "single precision",
    ),
    Row(
        "point spread",
        "point spread function of these wavefronts",
        f"{OPTICS}::test_zernike_point_spread",
        "single precision",
    ),
    Row(
        "image of points",
        "image of points, by the original's rule",
        f"{OPTICS}::test_optical_image_of_points",
        "single precision",
    ),
    Row(
        "volts",
        "noise-free volts, default and three OVT sensors",
        f"{SENSORS}::test_noise_free_volts",
        "single precision",
    ),
    Row(
        "noise of ISETCam",
        "the original's noise against its closed form: mean and variance of 18 cells for each of"
        " the noise flags 1 and 2",
        f"{SENSORS}::test_noise_statistics_of_all_cells",
        "32 768 or 65 536 draws per cell",
        ERRORS,
    ),
    Row(
        "noise of our sensor",
        "noise of isethdr, clipped as the original clips: mean and variance of the same cells",
        f"{SENSORS}::test_our_sensor_has_the_same_statistics",
        "the same; the original's PRNU multiplies noise too, 2e-4 of the variance",
        ERRORS,
    ),
    Row(
        "rule `saturated`",
        "rule `saturated` for three captures",
        "isp/test_merge.py::test_isetcams_rule_agrees_with_its_own_numbers",
        "rounding",
    ),
    Row(
        "bilinear demosaic",
        "bilinear demosaic",
        "isp/demosaic/test_interpolation.py::test_bayer_equals_isetcams_bilinear",
        "single precision",
    ),
    Row("Lab; colour difference", "Lab, dE 76, 94, 2000", COLOURS, "rounding"),
    Row("sRGB curve", "sRGB curve", COLOURS, "rounding"),
    Row(
        "light-group weights",
        "light-group weights, 27 cases",
        "core/test_lighting.py::test_iset_weights_agree_with_the_papers_script",
        "single precision",
    ),
)


def recorded(report: Path) -> dict[str, float]:
    """Return the largest value of each property in a report of pytest in XML."""
    values: dict[str, list[float]] = {}
    for one in ElementTree.parse(report).iter("property"):
        values.setdefault(one.attrib["name"], []).append(float(one.attrib["value"]))
    return {name: max(of_name, key=importance) for name, of_name in values.items()}


def importance(value: float) -> float:
    """Return a key that sorts NaN after all numbers; `max` without a key may ignore NaN."""
    return math.inf if math.isnan(value) else value


def table(found: dict[str, float]) -> str:
    """Return the rows as a table in Markdown.

    Raises
    ------
    KeyError : no test recorded the quantity of a row.
    """
    lines = ["| quantity | largest difference | unit | test | limited by |", "|" + "---|" * 5]
    for row in ROWS:
        cells = (row.quantity, f"{found[row.recorded]:.2g}", row.unit, f"`{row.test}`", row.limit)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> int:
    """Run the tests of all rows and print the table."""
    if "ISETHDR_REFERENCE" not in os.environ:
        print("set ISETHDR_REFERENCE to the folder of reference numbers", file=sys.stderr)
        return 2
    tests = list(dict.fromkeys(row.test for row in ROWS))
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        run = [sys.executable, "-m", "pytest", "-q", f"--junitxml={report}", *tests]
        done = subprocess.run(run, cwd=TESTS, capture_output=True, text=True)
        if done.returncode or " skipped" in done.stdout:
            print(done.stdout, file=sys.stderr)
            return 2
        print(table(recorded(report)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
