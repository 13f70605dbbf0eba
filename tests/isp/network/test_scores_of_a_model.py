"""From scene to scores: with bilinear interpolation as its model, the scores of `isp=network` are
those of `isp=merge`.
"""

import numpy as np
import pytest
from isethdr_isp.develop import floor_e2, solve_matrix
from isethdr_isp.merge import charges

import isethdr_core as hdr
from isethdr_core.truth import truth

SHAPE = {"rows": 48, "columns": 64}
# Tolerance of a score: float32 rounds by 1e-6 of the brightest pixel, up to 1e-4 of a dark pixel
SCORE = 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("sensor", ["bayer", "rgbw", "split_pixel"])
def test_scores_of_a_bilinear_model_are_those_of_merge(models, tmp_path, sensor):
    scene = hdr.build("scene", "macbeth", width=80, height=60)()
    mixed = hdr.build("lighting", "ideal")(scene)
    camera = hdr.build("sensor", sensor, **SHAPE)
    focal_mm = camera.pitch_um * 1e-3 / (mixed.attrs["field_width"] / 72)
    shot = camera(hdr.build("lens", "ideal", focal_length_mm=focal_mm)(mixed), hdr.generator())
    path = bilinear_model_for(models, tmp_path, camera.shot_form(), shot)
    pictures = hdr.build("isp", "merge")(shot), hdr.build("isp", "network", model=str(path))(shot)
    true = truth(mixed, pictures[0])
    assert np.array_equal(pictures[0].valid.values, pictures[1].valid.values)
    for name in ("ciede2000", "ssim", "log_luminance_error", "pixel_shares"):
        metric = hdr.build("metric", name)
        expected, found = ({s.metric: s.value for s in metric(p, true)} for p in pictures)
        assert found == pytest.approx(expected, rel=SCORE, abs=SCORE), name


def bilinear_model_for(models, folder, form, shot):
    """Write bilinear interpolation with the colour matrix of a sensor; return its path."""
    groups, _ = charges(shot, "daylight")
    [read, *_] = groups[-1]
    nm = shot.wavelength.values
    matrix = solve_matrix(read.response, nm, "daylight", 20.0, floor_e2(groups[-1]))
    letters = [str(name) for name in shot.channel.values]
    contract = {
        **models.CONTRACT,
        "cfa": "/".join(form.filters),
        "channels": letters,
        "multiple_px": len(form.filters),
    }
    cell = [[letters.index(letter) for letter in row] for row in form.filters]
    unit = read.sensitivity[letters.index("G")]
    return models.bilinear_model(folder / "model.onnx", matrix * unit, cell, contract)
