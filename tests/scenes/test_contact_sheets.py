"""Contact sheets: choice of things, positions of tiles, and the picture of a thing in its tile."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes import things
from isethdr_scenes.contact_sheets.choice import chosen
from isethdr_scenes.contact_sheets.sheet import CAPTION_PX, Look, picture, tiled, write

from isethdr_core.errors import ConfigError


def test_every_family_is_chosen_in_turn_and_shuffling_keeps_the_things():
    families = things.names("car")
    sheet = chosen("car", len(families) + 1, 0, False)
    assert [thing.family for thing in sheet[1:]] == list(families)
    assert sheet[0].family == sheet[1].family and sheet[0] != sheet[1]
    shuffled = chosen("car", len(families) + 1, 0, True)
    assert sorted(map(repr, shuffled)) == sorted(map(repr, sheet))
    with pytest.raises(ConfigError, match="no things 'ship'"):
        chosen("car,ship", 3, 0, False)


def test_tiles_lie_row_by_row_over_their_captions():
    tiles = [np.full((6, 8, 3), k, np.uint8) for k in range(10)]
    sheet = np.array(tiled(tiles, [""] * 10))
    assert sheet.shape == (2 * (6 + CAPTION_PX), 8 * 8, 3)
    for k in range(10):
        x = k % 8 * 8
        y = k // 8 * (6 + CAPTION_PX)
        assert (sheet[y : y + 6, x : x + 8] == k).all()


def test_a_sheet_is_a_picture_file_of_at_least_one_thing(tmp_path):
    with pytest.raises(ConfigError, match="ends in .png"):
        write(chosen("car", 1, 0, False), Look(), str(tmp_path / "sheet.txt"))
    with pytest.raises(ConfigError, match="chooses no thing"):
        write([], Look(), str(tmp_path / "sheet.png"))


@pytest.mark.slow
def test_a_tile_shows_the_car_brighter_by_day_and_its_lamps_by_night():
    thing = chosen("car", 1, 0, False)[0]
    day = picture(thing, Look(width=64, samples=8)).mean()
    night = picture(thing, Look(width=64, samples=8, night=True))
    assert day > night.mean() > 0
    assert night.max() == 255
