"""Questions: presets of the study; each is typed as one command."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from isethdr_core.errors import ConfigError, did_you_mean

# level at which a camera exposes an even field, over full scale; low, so that a scene's sky does
# not saturate
GREY = 0.15
# the three cameras of the main job (typical_bayer, typical_split_pixel, typical_rgbw), and the
# other bundled presets of sensors
BUNDLED = (
    "bayer",
    "split_pixel",
    "rgbw",
    "split_pixel_imx490",
    "bayer_imx363",
    "single_ar0132at_rccc",
    "typical_split_pixel_20bit",
    "typical_split_pixel_24bit",
    "split_pixel_isethdr",
    "bayer_isethdr",
    "rgbw_isethdr",
    "bayer_all_effects",
    "staggered_four",
    "lofic_miyauchi2019",
    "single_mt9v024",
    "ideal_photon_counter",
)


@dataclass(frozen=True)
class Question:
    """The settings of a question.

    Parameters
    ----------
    about : the question in one sentence, which is the title of the page.
    cameras : names of the cameras; each one is compared with the first.
    overrides : overrides of all scenes.
    levels : levels of the light; empty: the light of the scenes as it is.
    unit : unit of the levels: lux on the sensor, lux on the object, or a factor.
    kinds : classes of objects; empty: all.
    distances_m : smallest and largest distance of the objects, m.
    dipped : whether scenes with driving beams are left out.
    open_sky : whether tunnels, which daylight does not reach, are left out.
    bare : whether each camera is also run with objects removed by rendering the view without them.
    noisier : whether each camera is also run with twice the variance of the renderer's noise.
    transfer : whether contrast transfer accuracy is computed for each object.
    grey_field : whether cameras choose the exposure for an even field of the scene's mean light, so
        that equal light gives equal exposure on all roads.
    """

    about: str
    cameras: str = "bayer,split_pixel,rgbw"
    overrides: tuple[str, ...] = ()
    levels: tuple[float, ...] = ()
    unit: Literal["", "sensor_lux", "object_lux"] = ""
    kinds: tuple[str, ...] = ()
    distances_m: tuple[float, float] = (0.0, float("inf"))
    dipped: bool = False
    open_sky: bool = False
    bare: bool = False
    noisier: bool = False
    transfer: bool = False
    grey_field: bool = False


QUESTIONS = {
    "": Question("Which objects could be found at all?", transfer=True),
    "captures": Question(
        "One capture against three of the split pixel",
        cameras="split_pixel:LPHG,split_pixel:LPLG,split_pixel",
    ),
    "removal": Question(
        "Objects taken out by the ring around them, and by rendering the view again without them",
        cameras="bayer",
        kinds=("person", "rider", "animal"),
        bare=True,
    ),
    "noise": Question(
        "Does the renderer's noise change which objects could be found?",
        noisier=True,
    ),
    "filters": Question(
        "RGB against RGBW against RCCB: the same pixel and lens, from 0.003 to 100 lux",
        cameras="bayer,rgbw,rccb",
        overrides=(
            "+sensor@cameras.rccb=typical_bayer",
            "cameras.rccb.cfa=RCCB",
            "lighting=day",
            *(f"cameras.{name}.exposure_target={GREY}" for name in ("bayer", "rgbw", "rccb")),
        ),
        levels=(0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0),
        unit="sensor_lux",
        open_sky=True,
        grey_field=True,
    ),
    "dark": Question(
        "How dark may it get before the person 40 m ahead in the dipped beam is lost?",
        cameras=",".join(BUNDLED),
        overrides=("lighting=night_rural",),
        levels=(0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0),
        unit="object_lux",
        kinds=("person",),
        distances_m=(30.0, 55.0),
        dipped=True,
    ),
}


def question_of(name: str) -> Question:
    """Return the question of a name.

    Raises
    ------
    ConfigError : there is no question of that name.
    """
    if name not in QUESTIONS:
        known = [key for key in QUESTIONS if key]
        raise ConfigError(
            f"there is no question {name!r}{did_you_mean(name, known)}; type for example"
            " question=captures"
        )
    return QUESTIONS[name]
