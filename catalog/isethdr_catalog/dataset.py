"""Pictures of stored runs as a dataset for training: a length, and items of NumPy arrays.

It has the two methods that `torch.utils.data.DataLoader` calls, and does not import torch. An item
is read at its access. No file stays open, so that workers may have copies of the dataset.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from isethdr_core.data.categories import CATEGORIES
from isethdr_core.display import display_view
from isethdr_core.errors import CatalogError, ConfigError, did_you_mean
from isethdr_core.storage.atomic_write import temporary_path
from isethdr_core.storage.store import open_store

from .selection import Selection, StoredShot, found, select


@dataclass(frozen=True)
class Product:
    """An array of an item: where it is stored, and its type in the item."""

    group: str  # picture, truth or captures
    variable: str
    dtype: type[np.generic]
    # part of the names of kept arrays; it rises when the same run gives another array
    form: int = 1


# integers are signed, because not every version of torch takes uint16 and uint32
PRODUCTS = {
    "picture": Product("picture", "xyz", np.float32),  # (y, x, 3), XYZ in cd/m2
    "variance": Product("picture", "variance", np.float32),  # (y, x, 3), (cd/m2)^2
    "valid": Product("picture", "valid", np.bool_),  # (y, x)
    "display": Product("picture", "display", np.uint8),  # (y, x, 3), sRGB
    "truth": Product("truth", "xyz", np.float32),  # (y, x, 3), XYZ in cd/m2
    # (capture, y, x), DN; float32 if sensor.bits=0 switches the converter off
    "raw": Product("captures", "raw", np.int32),
    "instance": Product("truth", "instance", np.int32),  # (y, x), 0 without an object
    "category": Product("truth", "category", np.int32),  # (y, x), isethdr_core.data.categories
    "distance": Product("truth", "distance", np.float32),  # (y, x), m along the ray
    "depth": Product("truth", "depth", np.float32),  # (y, x), m along the axis
    "normal": Product("truth", "normal", np.float32),  # (y, x, 3), world axes
    "motion": Product("truth", "motion", np.float32),  # (y, x, 2), px right and down per frame
    # form 1 of both had all objects
    "boxes": Product("truth", "boxes", np.float32, form=2),  # (thing, 4), left, top, width, height
    "labels": Product("truth", "labels", np.int32, form=2),  # (thing,), category of each box
}
USUAL = ("picture", "truth")
NONE = "none"  # the category of pixels without an object, such as the sky
# surfaces and background that are not counted ("stuff" of COCO); all others are things
STUFF = (
    *("road", "tree", "guard rail", "building", "vegetation", "tunnel", "own vehicle", "chart"),
    "rock",
)


class PictureDataset:
    """Pictures of stored runs: `len(data)`, and `data[k]`, a dictionary of NumPy arrays.

    Parameters
    ----------
    names : runs or sweeps, as `isethdr export` takes them; without names, give conditions.
    products : arrays of an item, keys of `PRODUCTS`.
    transform : function that maps an item to the item that is returned. For workers it must be
        picklable, that is a function of a module.
    cache : folder in which arrays are kept as .npy files after their first use. Later they are
        mapped into memory, so that only the used parts of an array are read. None: no cache.
    conditions : conditions of a query, `property=value` or `property__operator=value`, as in
        `isethdr.find`.

    Raises
    ------
    CatalogError : nothing is found, or a name or property is unknown.
    ConfigError : a product is unknown, or names and conditions are given together.
    """

    def __init__(
        self,
        *names: str,
        products: Iterable[str] = USUAL,
        transform: Callable[[dict[str, Any]], Any] | None = None,
        cache: str | Path | None = None,
        **conditions: Any,
    ) -> None:
        self.products = tuple(products)
        for product in self.products:
            if product not in PRODUCTS:
                raise ConfigError(
                    f"there is no product {product!r}{did_you_mean(product, PRODUCTS)}"
                )
        self.transform = transform
        self.cache = None if cache is None else Path(cache).expanduser().absolute()
        self.shots = tuple(
            StoredShot(shot.path.absolute(), shot.camera)
            for shot in _selected(names, conditions).shots
        )

    def __len__(self) -> int:
        """Return the number of pictures."""
        return len(self.shots)

    def __getitem__(self, number: int) -> Any:
        """Return one item: `run` and `camera`, and each product by its name.

        Raises
        ------
        IndexError : `number` is beyond the last picture.
        CatalogError : the run does not hold a product, or its store is damaged.
        """
        shot = self.shots[number]
        item: dict[str, Any] = {"run": shot.path.stem, "camera": shot.camera}
        item |= {product: self._array(shot, product) for product in self.products}
        return item if self.transform is None else self.transform(item)

    def __iter__(self) -> Iterator[Any]:
        """Yield all items in their order."""
        return (self[number] for number in range(len(self)))

    def _array(self, shot: StoredShot, product: str) -> np.ndarray:
        if self.cache is None:
            return array_of(shot, product)
        form = PRODUCTS[product].form
        kept = product if form == 1 else f"{product}_{form}"
        path = self.cache / f"{shot.path.stem}_{shot.camera}_{kept}.npy"
        if not path.is_file():
            _keep(array_of(shot, product), path)
        # changes of an item do not reach the file
        return np.load(path, mmap_mode="c")


def _selected(names: tuple[str, ...], conditions: Mapping[str, Any]) -> Selection:
    if names and conditions:
        raise ConfigError(
            f"{names[0]!r} and conditions are given; expected names of runs and sweeps, or"
            " conditions of a query"
        )
    return select(names) if names else found({**conditions, "kind": "run"})


def array_of(shot: StoredShot, product: str) -> np.ndarray:
    """Return a product of one camera of a stored run.

    Raises
    ------
    CatalogError : the run does not hold the product.
    """
    wanted = PRODUCTS[product]
    data = open_store(shot.path, f"{wanted.group}/{shot.camera}")
    if product in DERIVED:
        values = DERIVED[product](data)
    else:
        values = data[wanted.variable].values if wanted.variable in data else None
    if values is None:
        raise CatalogError(
            f"run {shot.path.stem} holds no {product} for camera {shot.camera}; it holds"
            f" {', '.join(map(str, data.data_vars))} in {wanted.group}; labels are stored where a"
            " metric reads them"
        )
    if product == "raw" and np.issubdtype(values.dtype, np.floating):
        return np.ascontiguousarray(values, np.float32)  # electrons have fractions
    return np.ascontiguousarray(values, wanted.dtype)


def _display(picture: xr.Dataset) -> np.ndarray:
    """Return the display view of a picture with its own white; the report has one white per run."""
    white = display_view.white_cd_m2(picture)
    return display_view.display(picture, white, natural_colour=True)


def _category(truth: xr.Dataset) -> np.ndarray | None:
    """Return the map of categories: the stored one, or that of the objects."""
    if "category" in truth:
        return truth["category"].values
    rows = truth.attrs.get("objects")
    if "instance" not in truth or rows is None:
        return None
    instance = truth["instance"].values
    numbers = np.zeros(int(instance.max()) + 1, np.int32)
    for row in rows:
        if row["instance"] < len(numbers):
            numbers[row["instance"]] = CATEGORIES[row["category"]]
    return numbers[instance]


def is_thing(category: str) -> bool:
    """Return whether the objects of a category are counted individually ("things" of COCO)."""
    return category != NONE and category not in STUFF


def _things(truth: xr.Dataset) -> list[dict[str, Any]] | None:
    """Return the rows of things, as in COCO files: a road is no object to detect."""
    rows = truth.attrs.get("objects")
    return None if rows is None else [row for row in rows if is_thing(row["category"])]


def _boxes(truth: xr.Dataset) -> np.ndarray | None:
    rows = _things(truth)
    return None if rows is None else np.array([row["box"] for row in rows]).reshape(-1, 4)


def _labels(truth: xr.Dataset) -> np.ndarray | None:
    rows = _things(truth)
    return None if rows is None else np.array([CATEGORIES[row["category"]] for row in rows])


DERIVED: dict[str, Callable[[xr.Dataset], np.ndarray | None]] = {
    "display": _display,
    "category": _category,
    "boxes": _boxes,
    "labels": _labels,
}


def _keep(values: np.ndarray, path: Path) -> None:
    """Write an array as a whole or not at all; several workers may do so at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = temporary_path(path.parent, path.name)
    try:
        with temporary.open("wb") as file:
            np.save(file, values)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
