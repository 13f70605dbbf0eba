"""The rendering effort of sub-frames, of which only the mean matters."""

import pytest

import isethdr_core as hdr
from isethdr_core.motion.sub_frames import cheaper


def test_sub_frames_share_the_samples_and_have_seeds_of_their_own():
    renderer = hdr.build("renderer", "mitsuba", samples=64, seed=3)
    shared = [cheaper(renderer, number, 8) for number in (1, 2)]
    assert [r.samples for r in shared] == [8, 8]
    assert len({renderer.seed, *(r.seed for r in shared)}) == 3


def test_no_sub_frame_has_one_sample_whose_noise_nobody_knows():
    assert cheaper(hdr.build("renderer", "mitsuba", samples=16), 1, 60).samples == 2


def test_the_allowed_noise_of_a_part_grows_with_the_root_of_their_number():
    renderer = hdr.build("renderer", "mitsuba", error_allowed=0.1)
    assert cheaper(renderer, 1, 16).error_allowed == pytest.approx(0.4)
    assert cheaper(renderer, 1, 400).error_allowed == 0.999  # the most that a renderer accepts
    by_cameras = hdr.build("renderer", "mitsuba", noise_share_allowed=0.6)
    assert cheaper(by_cameras, 1, 4).noise_share_allowed == pytest.approx(1.2)
