"""Stability: hard cases for every stage and for the whole chain, each against a closed form or
arithmetic of higher precision.

| file       | content                                                                    |
|------------|----------------------------------------------------------------------------|
| `verdict`  | a case and its expected outcome, its measurement, and its verdict          |
| `inputs`   | small light fields, as inputs of the stages                                |
| `convolve` | neighbouring tiles that differ by up to 15 decades                         |
| `lens`     | fast and slow apertures, much defocus, light of any level                  |
| `spectra`  | one, three and three hundred bands, and spectral lines between bands       |
| `lighting` | nearly identical light groups, extreme weights, targets out of reach       |
| `dynamics` | pixels that overflow, over 18 decades of current and 10 of time            |
| `poisson`  | counts with means from 0 to 1e18                                           |
| `sensor`   | extreme exposures, gains and wells, one pixel, one row                     |
| `isp`      | filters without colour differences, captures that disagree, no light       |
| `chain`    | charts from the scene to the picture                                       |
| `bad_input`| nonsensical values of fields, and damaged files                            |
"""

from __future__ import annotations

from importlib import import_module

from isethdr_core.errors import ConfigError, did_you_mean

from .verdict import Case, judged

STAGES = (
    "convolve",
    "lens",
    "spectra",
    "lighting",
    "dynamics",
    "poisson",
    "sensor",
    "isp",
    "chain",
    "bad_input",
)


def stability(stage: str = "", slow: int = 0) -> list[dict]:
    """Run every stage through hard cases and judge each result: right, refused or WRONG.

    A stage's module yields its cases as (name, measure) where the result must be right, and as
    (name, call, error class) where it must be refused.

    Parameters
    ----------
    stage : name of one stage; empty takes all.
    slow : 1 adds a frame of 8K.

    Returns
    -------
    rows with stage, case, expected outcome (right, or the class of the error that must be raised),
    verdict, error and bound in the same unit, and `against`, the source of the true value or the
    message of a refusal.
    """
    if stage and stage not in STAGES:
        raise ConfigError(f"study stability has no stage {stage!r}{did_you_mean(stage, STAGES)}")
    options = {"chain": {"slow": slow}}
    return [
        judged(name, Case(*case))
        for name in ([stage] if stage else STAGES)
        for case in import_module(f".{name}", __package__).cases(**options.get(name, {}))
    ]
