"""The demosaic study has rows for every array, and orders the methods as far as it is known."""

import pytest
from isethdr_measured.demosaic_methods import ARRAYS, CHARTS, demosaic_methods


@pytest.mark.slow
def test_guided_and_published_methods_are_ahead_where_they_claim_it():
    pytest.importorskip(
        "colour_demosaicing",
        reason="colour-demosaicing is not installed: pip install 'isethdr[demosaic]'",
    )
    rows = demosaic_methods(rows=48, columns=64, luminances="100")
    assert len(rows) == len(CHARTS) * sum(map(len, ARRAYS.values()))
    psnr = {(r["chart"], r["cfa"], r["demosaic"]): r["psnr_db"] for r in rows}
    for method in ("guided", "malvar", "menon"):
        assert psnr["stripes", "RGGB", method] > psnr["stripes", "RGGB", "bilinear"] + 1
    assert psnr["slanted_edge", "RGGB", "guided"] > psnr["slanted_edge", "RGGB", "bilinear"] + 5
    for chart in CHARTS:
        rgbw = {m: psnr[chart, "WGWR/GWRW/WBWG/BWGW", m] for m in ("bilinear", "guided")}
        assert rgbw["guided"] > rgbw["bilinear"] + 3
