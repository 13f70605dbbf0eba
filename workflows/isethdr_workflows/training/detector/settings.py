"""Settings of `isethdr train detector`, as they are typed: key=value."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from isethdr_core.errors import ConfigError, did_you_mean

from ..clock import Length

CHOICES = {
    "size": ("small", "large"),
    "precision": ("auto", "bfloat16", "float32"),
    "device": ("auto", "cpu", "cuda"),
}
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
OF_RECIPE = "recipe"  # the lighting that the recipe of the dataset draws
STRIDE_PX = 16  # pixels of the picture per cell of the coarsest level of the network
EXAMPLE = "isethdr train detector dataset=streets minutes=40"


@dataclass(frozen=True)
class Settings:
    """The settings of a training, except the config of its cameras."""

    dataset: str = ""  # name of a dataset of rendered roads
    cameras: str = ""  # names, separated by commas; "": all of the config
    lightings: str = f"{OF_RECIPE},day"  # lightings of each scene, separated by commas
    realisations: int = 2  # number of noise realisations of each picture
    name: str = ""  # name of its folder; "": dataset and size
    size: str = "small"
    input_px: int = 640  # width to which pictures are shrunk
    patch_px: int = 256  # side of the crops
    batch: int = 8
    rate: float = 5e-4  # largest learning rate
    minutes: float = 0.0  # minutes of computing
    steps: int = 0
    seed: int = 0
    checks: int = 20  # number of checks of the held-out pictures, evenly over the training
    patience: int = 8  # number of checks without improvement after which it stops
    precision: str = "auto"  # auto: bfloat16 if the processor multiplies such matrices
    device: str = "auto"
    threads: int = 0  # number of threads of PyTorch; 0: its own choice

    def __post_init__(self) -> None:
        """Refuse values outside their ranges."""
        for key, allowed in CHOICES.items():
            value = getattr(self, key)
            if value not in allowed:
                raise ConfigError(
                    f"{key} is {value!r}{did_you_mean(value, allowed)}; type for example"
                    f" {key}={allowed[0]}"
                )
        least = {
            "realisations": 1,
            "input_px": 64,
            "patch_px": 32,
            "batch": 1,
            "seed": 0,
            "checks": 1,
            "patience": 1,
            "threads": 0,
        }
        for key, value in least.items():
            if getattr(self, key) < value:
                raise ConfigError(
                    f"{key} is {getattr(self, key)}; expected at least {value}; type for example"
                    f" {key}={getattr(Settings, key)}"
                )
        if self.name and not NAME.fullmatch(self.name):
            raise ConfigError(
                f"name is {self.name!r}; expected letters, digits and _ . -; type for example"
                " name=night"
            )
        if self.patch_px % STRIDE_PX or self.input_px % STRIDE_PX:
            raise ConfigError(
                f"patch_px={self.patch_px} input_px={self.input_px}; expected multiples of"
                f" {STRIDE_PX}; type for example patch_px=256 input_px=640"
            )
        if not 0 < self.rate < 1:
            raise ConfigError(
                f"rate is {self.rate:g}; expected a number between 0 and 1; type for example"
                f" rate={Settings.rate:g}"
            )
        self.length()

    def length(self) -> Length:
        """Return the length of the training."""
        return Length(self.minutes, self.steps)

    @property
    def folder_name(self) -> str:
        """The name of the training's folder."""
        return self.name or f"{self.dataset}_{self.size}"


# settings that do not change the result, except by rounding
FREE = ("device", "threads", "name")
FREE_OVERRIDES = ("cache_gb",)  # overrides of the config that do not change the result


def parsed(typed: Sequence[str]) -> tuple[Settings, list[str]]:
    """Return the settings, and the overrides of the config, which are all other keys.

    Raises
    ------
    ConfigError : there is no dataset, a setting is not key=value, or a value is not a number or
        outside its range.
    """
    fields = {field.name: field for field in dataclasses.fields(Settings)}
    values: dict[str, Any] = {}
    overrides = []
    for text in typed:
        key, equals, value = text.partition("=")
        if not equals and not text.startswith("~"):
            raise ConfigError(
                f"{text!r} is no setting{did_you_mean(text, fields)}; type key=value, for example"
                f" {EXAMPLE}"
            )
        if key not in fields:
            overrides.append(text)
            continue
        kind = {"int": int, "float": float}.get(str(fields[key].type), str)
        try:
            values[key] = kind(value)
        except ValueError:
            whole = "whole " if kind is int else ""
            raise ConfigError(
                f"{key} is {value!r}; expected a {whole}number; type for example"
                f" {key}={fields[key].default}"
            ) from None
    if "minutes" not in values and "steps" not in values:
        values["minutes"] = 40.0
    if not values.get("dataset"):
        raise ConfigError(f"a dataset is needed; type for example {EXAMPLE}")
    return Settings(**values), overrides
