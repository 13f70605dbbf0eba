"""Cameras of Acme, for isethdr.

| module   | content                                 |
|----------|-----------------------------------------|
| `lens`   | `acme_plastic`: a lens without blur     |
| `sensor` | `acme_nano`: a small sensor             |
"""

from isethdr_core import Component, hookimpl

from .lens import AcmePlastic
from .sensor import AcmeNano


@hookimpl
def isethdr_components():
    """Return Acme's components."""
    return [
        Component("lens", "acme_plastic", AcmePlastic),
        Component("sensor", "acme_nano", AcmeNano),
    ]


@hookimpl
def isethdr_config_paths():
    """Return the folder with Acme's presets and experiments."""
    return ["pkg://acme_camera.conf"]
