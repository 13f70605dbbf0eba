"""Settings of `isethdr train picture`, as they are typed: key=value."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from isethdr_core.errors import ConfigError, did_you_mean

from ..clock import Length

CHOICES = {
    "network": ("unet", "nafnet", "restormer"),
    "size": ("small", "large"),
    "loss": ("electrons", "view"),
    "captures": ("merged", "apart"),
    "start": ("linear", "learned"),
    "precision": ("auto", "bfloat16", "float32"),
    "device": ("auto", "cpu", "cuda"),
}
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
SHEET = 16  # number of patches of a sheet, a multiple of the batch
LEAST_PATCH = 32  # least side of a patch, pixels
PATCH_STEP = 16  # the side of a patch is a multiple of this, pixels


@dataclass(frozen=True)
class Settings:
    """The settings of a training, except its camera."""

    name: str = ""  # name of its folder; "": sensor, network and size
    network: str = "unet"
    size: str = "small"
    loss: str = "electrons"
    captures: str = "merged"  # or apart: the network itself merges the captures of a shot
    start: str = "linear"  # the best linear estimate, which the network corrects; or learned
    minutes: float = 0.0  # minutes of computing
    steps: int = 0
    seed: int = 0
    dataset: str = ""  # name of a dataset of rendered roads; "": only dead leaves
    roads_share: float = 0.5  # share of the patches that show roads, if there is a dataset
    pictures: int = 360  # number of pictures of dead leaves
    picture_px: int = 192  # side of a picture of dead leaves
    patch_px: int = 128
    batch: int = 4
    rate: float = 1e-3  # largest learning rate
    checks: int = 40  # number of checks of the held-out pictures, evenly over the training
    patience: int = 16  # number of checks without improvement after which it stops
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
            "seed": 0,
            "pictures": 2,
            "picture_px": LEAST_PATCH,
            "patch_px": LEAST_PATCH,
            "batch": 1,
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
        if not (0 < self.roads_share < 1 and 0 < self.rate < 1):
            raise ConfigError(
                f"roads_share and rate are {self.roads_share:g}, {self.rate:g}; expected numbers"
                " between 0 and 1; type for example roads_share=0.5"
            )
        if SHEET % self.batch:
            raise ConfigError(
                f"batch is {self.batch}; expected a number that divides {SHEET}; type for example"
                " batch=4"
            )
        if self.patch_px % PATCH_STEP:
            nearest = max(self.patch_px // PATCH_STEP, 1) * PATCH_STEP
            raise ConfigError(
                f"patch_px is {self.patch_px}; expected a multiple of {PATCH_STEP}; type for"
                f" example patch_px={nearest}"
            )
        if self.patch_px > self.picture_px:
            raise ConfigError(
                f"patch_px is {self.patch_px} and picture_px is {self.picture_px}; expected a patch"
                " that is not larger than a picture; type for example"
                f" picture_px={max(Settings.picture_px, self.patch_px)}"
            )
        self.length()

    def length(self) -> Length:
        """Return the length of the training."""
        return Length(self.minutes, self.steps)


# settings that change neither the data nor the result, except by rounding
FREE = ("device", "threads", "name")


def parsed(typed: Sequence[str]) -> tuple[Settings, list[str]]:
    """Return the settings, and the overrides of the config, which are all other keys.

    Raises
    ------
    ConfigError : a setting is not key=value, or a value is not a number or outside its range.
    """
    fields = {field.name: field for field in dataclasses.fields(Settings)}
    values: dict[str, Any] = {}
    overrides = []
    for text in typed:
        key, equals, value = text.partition("=")
        if not equals and not text.startswith("~"):
            raise ConfigError(
                f"{text!r} is no setting{did_you_mean(text, fields)}; type key=value, for example"
                " sensor=typical_bayer minutes=20"
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
        values["minutes"] = 30.0
    return Settings(**values), overrides
