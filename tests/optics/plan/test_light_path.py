"""The path of light through the modules of a lens, counted while an image is computed.

A CALL ACROSS MODULES is a call from a function of one traced module to a function of another traced
module that receives light. Calls count while light on the sensor plane is computed from mixed
radiance. Traced modules are all modules of `isethdr_optics`, and of the core the modules of the
chain and of imaging plans.

- An argument is light if it is, or if a tuple or list in it holds, a DataArray over tiles, an array
  (band, y, x), or an array with as many tiles (its last two dims) as any light so far. `self` does
  not count: a component that computes a number about itself receives no light.
- Repeated calls of a function from the same module (band by band, flare by flare) are one call.
- A module IS LEFT when all its functions that received light have returned. A call BACK is a call
  into a module that was left, or into a module that waits for the caller. Methods of the values
  that a plan carries (sensor plane, kernels, photoelectron map) count as calls, but not as calls
  back: they are used wherever their value is used.
- Kernels are in memory: the image is computed once before it is traced, since no light takes part
  in the computation of kernels.
"""

from __future__ import annotations

import ast
import sys
import threading
from dataclasses import dataclass, field, is_dataclass, replace
from pathlib import Path

import isethdr_optics
import numpy as np
import pytest
import xarray as xr
from isethdr_optics import (
    ApertureFlare,
    DiffractionLimitedLens,
    GhostFlare,
    IdealLens,
    PrescribedLens,
    WavefrontLens,
)

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.pipeline import chain, imaging_plan
from isethdr_core.pipeline.chain import Chain, on_sensor
from isethdr_core.plugins.registry import build

MOST = 20  # calls across modules
ROOT = Path(isethdr_optics.__file__).parent
# numbers of tiles that no other array has
SHAPE = (31, 67)
TILE = 0.5 / 67
BANDS = np.linspace(440.0, 660.0, 12)
SENSOR = build("sensor", "bayer", pitch_um=3.75)
IN_A_WINDOW = replace(SENSOR, rows=80, columns=160)
WITHOUT_NOISE = build("sensor", "ideal", pitch_um=3.75)


@dataclass
class Trace:
    """The calls across modules of one image."""

    shapes: set[tuple[int, int]]  # shapes (y, x) of light so far
    bands: int
    calls: list[tuple[str, str, str]] = field(default_factory=list)  # from, to, function
    back: list[tuple[str, str, str]] = field(default_factory=list)
    waiting: dict[str, int] = field(default_factory=dict)  # frames of each module that hold light
    left: set[str] = field(default_factory=set)

    def __call__(self, frame, event, _arg):
        """Follow one call or return."""
        if event not in ("call", "return") or not (module := traced(frame)):
            return
        if not self.handed_light(frame):
            return
        if event == "return":
            self.waiting[module] -= 1
            if not self.waiting[module]:
                self.left.add(module)
            return
        caller = next((m for f in above(frame) if (m := traced(f))), None)
        if caller not in (None, module):
            call = caller, module, frame.f_code.co_name
            if call not in self.calls:
                self.calls.append(call)
                of_value = is_dataclass(owner := frame.f_locals.get("self")) and not hasattr(
                    owner, "plan"
                )
                if not of_value and (module in self.left or self.waiting.get(module)):
                    self.back.append(call)
        self.waiting[module] = self.waiting.get(module, 0) + 1

    def handed_light(self, frame) -> bool:
        """Return whether an argument of a function holds light."""
        code = frame.f_code
        count = code.co_argcount + code.co_kwonlyargcount
        names = [n for n in code.co_varnames[:count] if n != "self"]
        return any(self.is_light(frame.f_locals.get(n)) for n in names)

    def is_light(self, value) -> bool:
        """Return whether a value holds light."""
        if isinstance(value, tuple | list):
            return any(map(self.is_light, value))
        if isinstance(value, xr.DataArray):
            if {"y", "x"} <= set(value.dims):
                self.shapes.add(value.shape[-2:])
                return True
            return False
        if not isinstance(value, np.ndarray) or value.ndim < 2:
            return False
        if value.ndim == 3 and len(value) == self.bands:
            self.shapes.add(value.shape[-2:])
        return value.shape[-2:] in self.shapes


def traced(frame) -> str:
    """Return the name of the module of a frame if it is traced, else an empty string."""
    name = frame.f_globals.get("__name__", "")
    known = (f"{ROOT.name}.", f"{chain.__name__}.", imaging_plan.__name__)
    generated = frame.f_code.co_filename == "<string>"  # the __init__ of a dataclass
    return name if name.startswith(known) and not generated else ""


def above(frame):
    """Yield the callers of a frame."""
    while frame := frame.f_back:
        yield frame


def scene(lamp=False):
    """Return mixed radiance dim enough for truncated kernels; a lamp makes them whole."""
    level = 1e-3 * np.random.default_rng(1).uniform(0.5, 1, SHAPE)
    if lamp:
        level[15, 33] *= 1e5
    cube = (level * (1.3 - BANDS / 900)[:, None, None]).astype(np.float32)
    y, x = (quantities.centres(n, n * TILE) for n in SHAPE)
    return quantities.plane(cube, BANDS, x, y, quantities.RADIANCE)


def trace(lens, flares, sensor, mixed) -> Trace:
    """Return the calls across modules while an image is computed with kernels in memory."""
    parts = Chain(None, None, None, {}, lens, dict(enumerate(flares)), {"one": sensor}, None, {})
    demand = sensor.narrow(Demand())
    on_sensor(parts, mixed, demand)
    found = Trace({SHAPE}, mixed.sizes["wavelength"])
    threading.setprofile(found)
    sys.setprofile(found)
    try:
        on_sensor(parts, mixed, demand)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return found


THIN = DiffractionLimitedLens(focal_length_mm=4.0)
BENT = {"model": "brown_conrady", "k1": -0.05}
FIELD = WavefrontLens(focal_length_mm=4.0, field_zernike_um={0.0: {}, 40.0: {4: 0.4}})


PRESCRIBED = PrescribedLens(focal_length_mm=4.0)


@pytest.mark.parametrize(
    ("lens", "flares", "sensor", "lamp"),
    [
        (IdealLens(focal_length_mm=4.0), (), IN_A_WINDOW, False),
        (THIN, (), WITHOUT_NOISE, True),
        (THIN, (), SENSOR, False),
        pytest.param(THIN, (ApertureFlare(),), SENSOR, True, marks=pytest.mark.slow),
        (THIN, (), IN_A_WINDOW, False),
        pytest.param(THIN, (GhostFlare(),), SENSOR, False, marks=pytest.mark.slow),
        (replace(THIN, distortion=BENT), (), SENSOR, False),
        pytest.param(FIELD, (), SENSOR, True, marks=pytest.mark.slow),
        pytest.param(PRESCRIBED, (), SENSOR, False, marks=pytest.mark.slow),
    ],
    ids=[
        "no blur, a window",
        "irradiance",
        "photocurrent, wings cut",
        "photocurrent, a lamp and dirt",
        "photocurrent in a window",
        "ghosts",
        "distortion",
        "point spreads over the field",
        "prescription",
    ],
)
def test_light_takes_few_calls_across_modules_and_none_back(lens, flares, sensor, lamp):
    mixed = scene(lamp)
    if lens.field_varies or flares and not lamp:
        mixed = mixed.isel(wavelength=slice(0, None, 6))  # quicker
    found = trace(lens, flares, sensor, mixed)
    print(len(found.calls), *(f"{a} -> {b}.{f}" for a, b, f in found.calls), sep="\n")
    assert len(found.calls) > 3, "the trace sees the path"
    assert len(found.calls) <= MOST
    assert not found.back


def test_modules_of_the_lens_import_each_other_in_one_direction():
    """There is no cycle of imports, imports inside functions included."""
    files = {
        ".".join((ROOT.name, *p.relative_to(ROOT).with_suffix("").parts)): p
        for p in ROOT.rglob("*.py")
        if p.name != "__init__.py"
    }
    imports = {
        name: imported(name, path, for_types=False) & files.keys() for name, path in files.items()
    }
    while imports:
        ground = {name for name, needs in imports.items() if not needs & imports.keys()}
        assert ground, f"a circle among {sorted(imports)}"
        imports = {name: needs for name, needs in imports.items() if name not in ground}


@pytest.mark.parametrize("folder", ["pupil", "psf", "field", "imaging"])
def test_nothing_below_a_plan_knows_a_lens_or_the_plan(folder):
    for path in (ROOT / folder).rglob("*.py"):
        name = ".".join((ROOT.name, *path.relative_to(ROOT).with_suffix("").parts))
        above = (f"{ROOT.name}.lenses", f"{ROOT.name}.plan")
        limits = f"{ROOT.name}.lenses.limits"  # holds ranges of dataclass fields, no lens
        found = [one for one in imported(name, path) if one.startswith(above)]
        assert [one for one in found if not one.startswith(limits)] == [], name


STAGES = (  # files with entry points that the core calls; they write to the ledger
    "plan/lens_plan.py",
    "plan/depth_layers.py",
    "plan/behind_glass.py",
    "flare/drops.py",
    "flare/film.py",
    "flare/ghosts/ghost_flare.py",
    "flare/windscreen.py",
    "lenses/measured_lens.py",
    "prescription/field.py",
)


def test_only_what_the_core_calls_writes_into_the_ledger():
    """All other functions return ledger terms with their result, and callers may discard both."""
    found = [
        (path.relative_to(ROOT).as_posix(), node.lineno)
        for path in ROOT.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and any(a.name == "ledger" for a in node.names)
    ]
    assert sorted({file for file, _ in found}) == sorted(STAGES)


def is_for_types(node: ast.stmt) -> bool:
    """Return whether a statement is `if TYPE_CHECKING: ...`."""
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def imported(name: str, path: Path, for_types: bool = True) -> set[str]:
    """Return the modules that a file may import, and all names that it imports from modules.

    `for_types` includes imports that only type checkers execute.
    """
    package = name.split(".")[:-1]
    out = set()
    tree = ast.parse(path.read_text(encoding="utf-8"))
    if not for_types:
        tree.body = [node for node in tree.body if not is_for_types(node)]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            out |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            whole = ".".join([*base, *filter(None, [node.module])])
            out |= {whole, *(f"{whole}.{alias.name}" for alias in node.names)}
    return out
