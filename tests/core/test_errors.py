"""Errors state the mistake, suggest the nearest name, and belong to one family."""

from __future__ import annotations

import inspect

from isethdr_core import errors
from isethdr_core.errors import IsetHdrError, did_you_mean


def test_the_nearest_name_comes_first():
    assert did_you_mean("rgwb", ["bayer", "rgbw"]) == "; did you mean 'rgbw'? (one of: bayer, rgbw)"
    assert did_you_mean("zzz", ["bayer"]) == " (one of: bayer)"
    assert did_you_mean("x", []) == " (one of: none)"


def test_every_error_of_ours_is_an_isethdr_error_and_in_the_guide():
    ours = [
        cls
        for _, cls in inspect.getmembers(errors, inspect.isclass)
        if issubclass(cls, Exception) and cls is not IsetHdrError
    ]
    assert ours and all(issubclass(cls, IsetHdrError) for cls in ours)
    assert all(f"`{cls.__name__}`" in errors.__doc__ for cls in ours)
