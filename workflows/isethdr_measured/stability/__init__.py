"""Stability: every stage and the whole chain through hard cases, each against a closed form or
wider arithmetic.

| file       | content                                                                    |
|------------|----------------------------------------------------------------------------|
| `verdict`  | a case and its expected outcome, what it measures, and the verdict over it |
| `inputs`   | small light to feed a stage with                                           |
| `convolve` | twelve decades of light beside each other                                  |
| `lens`     | fast and slow apertures, much defocus, light of any level                  |
| `spectra`  | one band, three, three hundred, and lines between them                     |
| `lighting` | light groups that are alike, weights far apart, targets out of reach       |
| `dynamics` | pixels that overflow, over 18 decades of current and 10 of time            |
| `poisson`  | counts of means from 0 to 1e18                                             |
| `sensor`   | exposures, gains and wells at their ends, one pixel, one row               |
| `isp`      | filters that do not tell colours apart, captures that disagree, no light   |
| `chain`    | charts from the scene to the picture                                       |
| `bad_input`| values that make no sense, typed for fields, and files that are damaged    |
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
    """Drive every stage through hard cases and judge each result: right, refused or WRONG.

    A stage's module yields its cases as (name, measure) where the result must be right, and as
    (name, call, error class) where it must be refused.

    Parameters
    ----------
    stage : one stage alone; empty takes all.
    slow : 1 adds a frame of 8K.

    Returns
    -------
    rows with stage, case, expected outcome (right, or the error it must end in), verdict, error and
    bound in the same unit, and what the error is one of, or the message of a refusal.
    """
    if stage and stage not in STAGES:
        raise ConfigError(f"study stability has no stage {stage!r}{did_you_mean(stage, STAGES)}")
    options = {"chain": {"slow": slow}}
    return [
        judged(name, Case(*case))
        for name in ([stage] if stage else STAGES)
        for case in import_module(f".{name}", __package__).cases(**options.get(name, {}))
    ]
