"""Defocus of a thin lens: the areas of a disc on tiles."""

import numpy as np
import pytest

from isethdr_core.physics.optics import defocus


@pytest.mark.parametrize("radius", [1.3, 3.3, 11.7, 34.67])
def test_areas_of_a_disc_are_right_to_the_stated_share_of_a_tile(radius, monkeypatch):
    usual = defocus._areas(radius)
    monkeypatch.setattr(defocus, "CUTS", 320)
    error = np.abs(usual - defocus._areas(radius)).max() * np.pi * radius**2
    assert error < 8e-3
