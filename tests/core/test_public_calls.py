"""The calls that users of the Python API rely on, with a chart small enough to take seconds."""

import numpy as np
import pytest

import isethdr_core as hdr


@pytest.mark.slow
def test_the_chain_by_hand():
    scene = hdr.build(
        "scene", "point_lights", width=24, height=14, step_nm=150.0, horizontal_field_deg=5.0
    )()
    mixed = hdr.build("lighting", "weights", weights={"sky": 1e-3, "headlights": 1.0})(scene)
    assert mixed.dims == ("wavelength", "y", "x")
    lens = hdr.build("lens", "wavefront", f_number=4.0, focal_length_mm=4.0, zernike_um={4: 0.1})
    dirt = hdr.build("flare", "aperture", blades=6, seed=1)
    psf = lens.psf(wavelength_nm=[450, 550, 650], pitch_um=1.0, size=64, flares=[dirt])
    assert psf.shape == (3, 64, 64) and (psf >= 0).all() and 0.5 < psf.sum() / 3 <= 1
    light = lens(mixed, flares=[dirt])
    sensor = hdr.build("sensor", "split_pixel", exposure_s=0.016)
    mean = sensor.expected(light)
    assert mean.dims == ("capture", "y", "x") and mean.attrs["units"] == "e"
    shot = sensor(light, hdr.generator(seed=7, device="A", scene="s1"))
    picture = hdr.build("isp", "merge")(shot)
    assert {"xyz", "variance", "valid"} <= set(picture.data_vars)


@pytest.mark.slow
def test_a_run_from_python_has_the_ledger_of_the_command_line(monkeypatch, tmp_path):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    result = hdr.run(
        hdr.compose(
            [
                "experiment=five_lights",
                "sensor=rgbw",
                "lens=ideal",
                "~flare@flare.dirt",
                "scene.width=48",
                "scene.height=27",
                "scene.horizontal_field_deg=8",  # makes the sensor small
                "draws=1",
            ]
        )
    )
    rows = {row.stage: row for row in result.ledger}
    assert {"scene point_lights", "lens ideal", "sensor rgbw", "isp rgbw"} <= set(rows)
    for row in result.ledger:
        assert row.seconds >= 0 and row.peak_bytes > 0 and isinstance(row.left_out, list)
        assert row.error is None or (np.isfinite(row.error) and row.error_unit)


def test_names_are_public_and_no_others():
    assert {"build", "compose", "run", "open_scene", "generator"} <= set(hdr.__all__)
    for name in hdr.__all__:
        assert getattr(hdr, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'bild'"):
        _ = hdr.bild
