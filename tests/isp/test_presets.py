"""Presets of the isp plugin compose to components."""

from isethdr_isp import MergeIsp

import isethdr_core as hdr


def test_isetcams_rule_is_a_preset():
    from isethdr_core.plugins.registry import build_from_config

    assert build_from_config("isp", hdr.compose(["isp=merge_isetcam"]).isp) == MergeIsp(
        rule="isetcam"
    )
