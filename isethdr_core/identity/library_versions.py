"""Library versions: the installed version of a library, by the name under which it is imported."""

from __future__ import annotations

from contextlib import suppress
from functools import cache
from importlib import metadata

# libraries whose import name is not the name they are installed by
INSTALLED_AS = {
    "OpenEXR": "OpenEXR",
    "colour": "colour-science",
    "colour_demosaicing": "colour-demosaicing",
    "array_api_compat": "array-api-compat",
    "drjit": "drjit",
    "hydra": "hydra-core",
    "omegaconf": "omegaconf",
    "skimage": "scikit-image",
    "PIL": "pillow",
    "yaml": "PyYAML",
    "google_crc32c": "google-crc32c",
}
ABSENT = "not installed"


@cache
def version_of(library: str) -> tuple[str, str]:
    """Return the distribution and the version of a library by its import name."""
    for name in (INSTALLED_AS.get(library, library), library.replace("_", "-")):
        with suppress(metadata.PackageNotFoundError):
            return name, metadata.version(name)
    for name in metadata.packages_distributions().get(library, ()):
        return name, metadata.version(name)
    return library, ABSENT
