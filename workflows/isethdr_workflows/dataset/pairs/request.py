"""Settings of `isethdr dataset pairs`: scenes, folder, file format, shots and overrides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.storage.home_folder import home

from ..recipe import node_of

FORMATS = ("numpy", "exr")
WITHOUT_EFFECT = ("scene", "renderer", "motion")  # keys of the config that only a rendering uses
LARGEST_SHOTS = 64  # most noisy shots of one scene; their mean has an eighth of the noise


@dataclass(frozen=True)
class PairRequest:
    """Settings of `isethdr dataset pairs`.

    Parameters
    ----------
    name : name of a dataset, or of one stored scene.
    folder : folder to write; None: `pairs/NAME` of the home.
    format : `numpy` (one .npz for each camera) or `exr` (one file of several parts).
    shots : noisy shots of each member; 0: none.
    scenes : number of scenes, from the first one; None: all.
    blur : whether an image without blur is one of the members.
    overrides : overrides of all scenes: lighting, lens, flares, cameras.
    """

    name: str
    folder: Path | None = None
    format: str = "numpy"
    shots: int = 1
    scenes: int | None = None
    blur: bool = False
    overrides: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.format not in FORMATS:
            raise ConfigError(
                f"format is {self.format!r}{did_you_mean(self.format, FORMATS)}; type for example"
                " format=exr"
            )
        if not 0 <= self.shots <= LARGEST_SHOTS:
            raise ConfigError(
                f"shots is {self.shots}; expected 0 to {LARGEST_SHOTS} noisy shots of each scene;"
                " type for example shots=4"
            )
        if self.scenes is not None and self.scenes < 1:
            raise ConfigError(
                f"scenes is {self.scenes}; expected 1 or more; type for example scenes=3"
            )
        for text in self.overrides:
            if node_of(text) in WITHOUT_EFFECT:
                raise ConfigError(
                    f"{text} has no effect, because pairs show stored radiance of one moment;"
                    " expected overrides of the lighting, lens, flares or cameras; type for example"
                    " lens.f_number=4"
                )

    @property
    def target(self) -> Path:
        """The folder to write."""
        return self.folder or home() / "pairs" / self.name


def _switch(text: str) -> bool:
    if text not in ("true", "false"):
        raise ValueError(text)
    return text == "true"


# the command's own settings, which are not overrides: how each is read, and what its value is
OWN: dict[str, tuple[Callable[[str], Any], str]] = {
    "folder": (lambda text: Path(text).expanduser(), "a folder"),
    "format": (str, "a format"),
    "shots": (int, "a whole number"),
    "scenes": (int, "a whole number"),
    "blur": (_switch, "true or false"),
}
EXAMPLES = {"folder": "my_pairs", "format": "exr", "shots": "4", "scenes": "3", "blur": "true"}


def pair_request(name: str, settings: Sequence[str]) -> PairRequest:
    """Return the request of a command line.

    Parameters
    ----------
    name : name of a dataset or a stored scene.
    settings : settings as typed, key=value: the command's own, and overrides of all scenes.

    Raises
    ------
    ConfigError : a value of one of the command's own settings is wrong.
    """
    own: dict[str, Any] = {}
    overrides = []
    for text in settings:
        key, is_setting, value = text.partition("=")
        if not is_setting or key not in OWN:
            overrides.append(text)
            continue
        read, what = OWN[key]
        try:
            own[key] = read(value)
        except ValueError:
            raise ConfigError(
                f"{key} is {value!r}; expected {what}; type for example {key}={EXAMPLES[key]}"
            ) from None
    return PairRequest(name, overrides=tuple(overrides), **own)
