"""Promises of a scene: a description that a renderer can use, or scene radiance."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..data.categories import CATEGORIES
from ..data.quantities import check_scene
from ..data.scene_description import Part, SceneDescription, Spectrum
from ..data.sky import SkyDome
from ..plugins.protocols import Scene
from .promise import holds, keeps, same, stated

SAME_SEED = "the same seed gives the same scene"


def check(subject: str, scene: Scene) -> None:
    """Check one scene. The scene is made twice."""
    with keeps(subject, "makes a scene"):
        first = scene()
        second = stated(subject, scene) if isinstance(first, xr.Dataset) else scene()
    if isinstance(first, xr.Dataset):
        with keeps(subject, "returns valid scene radiance"):
            check_scene(first)
        same(subject, SAME_SEED, first, second)
    elif isinstance(first, SceneDescription) and isinstance(second, SceneDescription):
        check_description(subject, first)
        same(subject, SAME_SEED, _numbers(first), _numbers(second))
    else:
        holds(
            subject,
            "returns a SceneDescription or a scene radiance Dataset",
            False,
            repr(type(first)),
        )


def check_description(subject: str, description: SceneDescription) -> None:
    """Check that names resolve, meshes are sound, and lamps, spectra and reflectances are
    physically possible.
    """
    holds(subject, "has a light: a sky or a lamp", description.light_groups())
    unique = [o.name for o in description.objects]
    holds(subject, "object names are unique", len(set(unique)) == len(unique))
    for placed in description.objects:
        at = f"object {placed.name!r}"
        holds(subject, "every object has a model", placed.model in description.models, at)
        holds(
            subject,
            "every category is one of isethdr_core.data.categories",
            placed.category in CATEGORIES,
            f"{at}: {placed.category!r}",
        )
        pose = np.asarray(placed.pose, float)
        holds(
            subject,
            "every pose is a finite 4x4 matrix",
            pose.shape == (4, 4) and np.isfinite(pose).all(),
            at,
        )
        holds(subject, "no pose mirrors or flattens its model", np.linalg.det(pose[:3, :3]) > 0, at)
    for model in description.models.values():
        for part in model.parts:
            _check_part(subject, f"part {model.name}/{part.name}", part, description)
    for material in description.materials.values():
        values = np.asarray(material.reflectance.value)
        holds(
            subject,
            "reflectance lies within 0..1",
            np.all((values >= 0) & (values <= 1)),
            f"material {material.name!r}",
        )
        _check_spectrum(subject, f"material {material.name!r}", material.reflectance)
    if isinstance(description.sky, SkyDome):
        _check_dome(subject, description.sky)
    elif description.sky is not None:
        _check_spectrum(subject, "the sky", description.sky)
    for opening in description.openings:
        numbers = np.array([opening.corner_m, opening.first_m, opening.second_m], float)
        holds(
            subject,
            "every opening is a rectangle with an area",
            np.isfinite(numbers).all()
            and np.linalg.norm(np.cross(*numbers[1:])) > 0
            and abs(numbers[1] @ numbers[2]) < 1e-6 * np.linalg.norm(np.cross(*numbers[1:])),
            repr(opening),
        )
    view = description.camera
    holds(
        subject,
        "the camera looks somewhere",
        np.linalg.norm(np.subtract(view.target_m, view.position_m)) > 0,
    )
    widest = 150 if view.projection == "tangent" else 360
    holds(
        subject,
        f"the camera's field is above 0 and below {widest} degrees",
        0 < view.horizontal_field_deg < widest,
    )


def _check_part(subject: str, at: str, part: Part, description: SceneDescription) -> None:
    vertices = np.asarray(part.vertices, float)
    faces = np.asarray(part.faces)
    holds(
        subject,
        "vertices are finite (n, 3)",
        vertices.ndim == 2 and vertices.shape[1] == 3 and np.isfinite(vertices).all(),
        at,
    )
    holds(
        subject,
        "faces are (m, 3) indices of vertices",
        faces.ndim == 2
        and faces.shape[1] == 3
        and len(faces) > 0
        and faces.dtype.kind in "iu"
        and faces.min() >= 0
        and faces.max() < len(vertices),
        at,
    )
    holds(
        subject,
        "every part has a material",
        part.material in description.materials,
        f"{at}: {part.material!r}",
    )
    if part.normals is not None:
        length = np.linalg.norm(part.normals, axis=1)
        # 1e-3: normals stored as float32, averaged over neighbouring faces
        holds(
            subject,
            "normals are unit vectors, one per vertex",
            len(part.normals) == len(vertices) and np.allclose(length, 1, atol=1e-3),
            at,
        )
    if part.lamp is not None:
        lamp = part.lamp
        holds(
            subject, "lamps have finite intensities, 0 or more", 0 <= lamp.intensity_cd < np.inf, at
        )
        holds(
            subject,
            "lamp cones open from inner to outer, at most 90 degrees",
            0 <= lamp.inner_deg <= lamp.outer_deg <= 90,
            at,
        )
        holds(subject, "lamp axes are unit vectors", abs(np.linalg.norm(lamp.axis) - 1) < 1e-3, at)
        _check_spectrum(subject, at, lamp.spectrum)


def _check_dome(subject: str, dome: SkyDome) -> None:
    shapes = {np.shape(part.pattern) for part in dome.parts}
    holds(subject, "the parts of a sky have patterns of one shape", len(shapes) == 1, str(shapes))
    for number, part in enumerate(dome.parts):
        at = f"part {number} of the sky"
        value = np.asarray(part.pattern)
        holds(
            subject,
            "patterns of the sky are finite (rows, columns), 0 or more",
            value.ndim == 2 and bool(np.isfinite(value).all() and value.min() >= 0),
            at,
        )
        _check_spectrum(subject, at, part.spectrum)
    for disc in dome.discs:
        _check_spectrum(subject, f"the {disc.name}", disc.radiance)


def _check_spectrum(subject: str, at: str, spectrum: Spectrum) -> None:
    nm = np.asarray(spectrum.wavelength_nm, float)
    value = np.asarray(spectrum.value, float)
    holds(
        subject,
        "spectra have increasing wavelengths",
        nm.shape == value.shape and len(nm) > 0 and np.all(np.diff(nm) > 0),
        at,
    )
    holds(
        subject,
        "spectra are finite, 0 or more",
        np.isfinite(value).all() and np.all(value >= 0),
        at,
    )


def _numbers(description: SceneDescription) -> np.ndarray:
    """Return everything that a scene draws at random as one array: poses and the meshes'
    corners.
    """
    numbers = [np.asarray(o.pose, float).ravel() for o in description.objects]
    numbers += [
        np.asarray(p.vertices, float).ravel() for m in description.models.values() for p in m.parts
    ]
    return np.concatenate(numbers or [np.zeros(0)])
