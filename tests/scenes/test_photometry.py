"""Families of lamps against the rules of their regulations, and files of measured lamps."""

import re

import numpy as np
import pytest
from isethdr_scenes import builders
from isethdr_scenes.lamps import KINDS
from isethdr_scenes.photometry import isocandela
from isethdr_scenes.photometry.eulumdat import read_ldt
from isethdr_scenes.photometry.families import FAMILIES, family, family_of_traffic
from isethdr_scenes.photometry.iesna import read_ies
from isethdr_scenes.photometry.report import lamp_of, report
from isethdr_scenes.photometry.rules import check, rule_sets

from isethdr_core.errors import CatalogError, ConfigError
from isethdr_core.scene import IntensityTable


@pytest.mark.parametrize(
    "name,rules", [(name, rules) for name in FAMILIES for rules in family(name).rules]
)
def test_each_family_keeps_all_its_rules(name, rules):
    lamp = family(name)
    found = check(lamp.table, lamp.intensity_cd, rules)
    assert found and not [f for f in found if not f.is_met]


@pytest.mark.parametrize("name", FAMILIES)
def test_a_lamp_of_left_hand_traffic_is_the_mirror_image(name):
    own = family(name)
    other = family_of_traffic(name, False)
    assert family_of_traffic(name, True) is own and other.intensity_cd == own.intensity_cd
    left = np.linspace(-85, 85, 69)
    up = np.linspace(-30, 30, 61)[:, None]
    np.testing.assert_allclose(other.table.at(left, up), own.table.at(-left, up), atol=1e-12)


def test_every_set_of_rules_has_a_family():
    assert {r for name in FAMILIES for r in family(name).rules} == set(rule_sets())


def test_a_stop_lamp_is_five_times_as_bright_as_the_position_lamp_beside_it():
    stop = family("stop")
    position = family("rear_position")
    left = np.arange(-20.0, 21, 5)
    up = np.arange(-10.0, 11, 5)[:, None]
    ratio = stop.intensity_cd * stop.table.at(left, up)
    assert (ratio >= 5 * position.intensity_cd * position.table.at(left, up)).all()


@pytest.mark.parametrize(
    "change,broken",
    [
        (lambda left, up: 0.2, {"75R", "50R", "50V", "25L", "25R"}),
        (lambda left, up: np.where(up > 0, 5, 1), {"B50L", "zone III"}),
        (lambda left, up: np.where((left > 4.9) & (up < 0), 0.1, 1), {"zone IV", "25L"}),
    ],
)
def test_a_lamp_outside_its_rules_is_told_by_name(change, broken):
    lamp = family("dipped_r112_b")
    left = lamp.table.left_deg
    up = lamp.table.up_deg
    changed = IntensityTable(left, up, lamp.table.value * change(left, up[:, None]))
    found = check(changed, lamp.intensity_cd, "r112_b")
    assert broken <= {f.rule.name for f in found if not f.is_met}


def ies(kind, vertical, level, candela, factor=2.0):
    """Return the text of an LM-63 file."""
    text = lambda v: " ".join(f"{x:g}" for x in v)
    head = f"1 1000 {factor:g} {len(vertical)} {len(level)} {kind} 2 0.1 0.1 0 1 1 10"
    rows = "\n".join(map(text, candela))
    return f"IESNA:LM-63-2002\nTILT=NONE\n{head}\n{text(vertical)}\n{text(level)}\n{rows}\n"


def test_a_file_of_lm_63_in_c_planes(tmp_path):
    path = tmp_path / "lamp.ies"
    path.write_text(
        ies(1, [0, 45, 90], [0, 90, 180, 270, 360], [[100, v, 0] for v in (50, 40, 30, 20, 50)])
    )
    lamp = read_ies(path)
    at = lambda left, up: lamp.intensity_cd * float(lamp.table.at(left, up))
    # C0 is to the right, C90 up; all values are scaled by the multiplier
    assert [at(0, 0), at(-45, 0), at(0, 45), at(45, 0), at(0, -45)] == pytest.approx(
        [200, 100, 80, 60, 40]
    )


def test_a_quarter_of_a_file_stands_for_all_of_it(tmp_path):
    path = tmp_path / "lamp.ies"
    path.write_text(ies(1, [0, 45, 90], [0, 90], [[100, 50, 0], [100, 40, 0]], 1.0))
    lamp = read_ies(path)
    at = lambda left, up: lamp.intensity_cd * float(lamp.table.at(left, up))
    assert [at(-45, 0), at(45, 0), at(0, 45), at(0, -45)] == pytest.approx([50, 50, 40, 40])


def test_planes_from_90_to_270_stand_for_both_halves(tmp_path):
    path = tmp_path / "lamp.ies"
    rows = [[100, v, 0] for v in (40, 35, 30, 25, 20)]
    path.write_text(ies(1, [0, 45, 90], [90, 135, 180, 225, 270], rows, 1.0))
    lamp = read_ies(path)
    at = lambda left, up: lamp.intensity_cd * float(lamp.table.at(left, up))
    # C90 is up, C270 down, and the plane of both is the plane of symmetry
    assert [at(0, 45), at(0, -45), at(45, 0), at(-45, 0)] == pytest.approx([40, 20, 30, 30])
    assert at(-30, 30) == pytest.approx(at(30, 30)) and at(30, 30) > at(30, -30) > 0


@pytest.mark.parametrize("kind", [2, 3])
def test_a_file_of_lm_63_in_level_angles(tmp_path, kind):
    path = tmp_path / "lamp.ies"
    candela = [[10, 20, 30], [40, 100, 60], [70, 80, 90]]  # by angle to the right, then up
    path.write_text(ies(kind, [-10, 0, 10], [-20, 0, 20], candela, 1.0))
    lamp = read_ies(path)
    at = lambda left, up: lamp.intensity_cd * float(lamp.table.at(left, up))
    assert at(0, 0) == 100
    # the first row is 20 degrees to the left: -20 to the right
    assert [at(20, 0), at(-20, 0), at(0, -10), at(0, 10)] == pytest.approx([20, 80, 40, 60])


def ldt(symmetry, planes, candela, angles=(0, 45, 90)):
    """Return the text of a EULUMDAT file of one lamp of 2,000 lm."""
    step = 360 / planes
    head = ["maker", 1, symmetry, planes, step, len(angles), 45, "n", "l", "l", "f", "d"]
    head += [0] * 12 + [0, 1]  # lines 13 to 26: sizes, ratios, factor, tilt, sets of lamps
    # line 24: factor of the intensities, with a comma
    head[22] = 100
    head[23] = "1,0"
    lamps = [1, "LED", 2000, "4000", "80", 20]
    c = [k * step for k in range(planes)]
    return "\n".join(map(str, [*head, *lamps, *[0] * 10, *c, *angles, *np.ravel(candela)]))


@pytest.mark.parametrize(
    "symmetry,given,expected",
    [
        (0, [50, 40, 30, 20], [50, 40, 30, 20]),
        (1, [50], [50, 50, 50, 50]),
        (2, [50, 40, 30], [50, 40, 30, 40]),
        (3, [40, 30, 20], [30, 20, 30, 40]),  # C270 over C0 to C90
        (4, [50, 40], [50, 40, 50, 40]),
    ],
)
def test_a_file_of_eulumdat(tmp_path, symmetry, given, expected):
    path = tmp_path / "lamp.ldt"
    path.write_text(ldt(symmetry, 4, [[100, v, 0] for v in given]))
    lamp = read_ldt(path)
    at = lambda left, up: lamp.intensity_cd * float(lamp.table.at(left, up))
    # values are per 1000 lm, and the lamp has 2000 lm; C0 is right, C90 up, C180 left, C270 down
    assert at(0, 0) == pytest.approx(200)
    assert [at(-45, 0), at(0, 45), at(45, 0), at(0, -45)] == pytest.approx(2 * np.array(expected))


@pytest.mark.parametrize(
    "name,text,message",
    [
        ("a.ies", "no tilt", "no line TILT="),
        ("a.ies", "IESNA\nTILT=NONE\n1 2 3\n", "ends early"),
        ("a.ies", ies(1, [0, 90], [0], [[0, 0]]), "a.ies has no light in front of the lamp"),
        ("a.ies", ies(1, [0, 90], [0], [[1, np.nan]]), "has 1 wrong intensities, such as nan cd"),
        (
            "a.ies",
            ies(1, [0, 90], [0], [[1, np.inf]]),
            "a.ies has 1 wrong intensities, such as inf",
        ),
        ("a.ies", ies(1, [0, 90], [0], [[-1, 1]]), "such as -2 cd; expected finite candela"),
        ("a.ies", ies(1, [0], [0], [[1]]), "one vertical angle alone, 0 degrees; expected two"),
        ("a.ies", ies(3, [0, 90], [-100, 0], [[1, 1]] * 2), "an angle 100 degrees off the axis"),
        ("a.ies", ies(2, [95, 99], [-9, 0], [[1, 1]] * 2), "expected -90 to 90 degrees in types A"),
        ("a.ies", ies(3, [0, 90], [5], [[1, 1]]), "one horizontal angle alone"),
        ("a.ldt", ldt(1, 4, [[1, 1, 1]]).replace("\n2000\n", "\n0\n"), "flux of 0 lm in line 29"),
        ("a.ies", ies(1, [0, 90, 45], [0], [[1, 1, 1]]), "do not rise"),
        ("a.ies", ies(1, [0, 90], [0, 120], [[1, 1]] * 2), "C planes from 0 to 120 degrees"),
        ("a.ies", ies(1, [0, 90], [0], [[1, 1]]).replace(" 2 1 1 ", " 2 1e999 1 "), "ends early"),
        ("a.ldt", "maker\n1\n", "ends early"),
        ("a.ldt", ldt(1, 4, [[1, 1, 1]]).replace("\n4\n90.0", "\ninf\n90.0"), "ends early"),
        ("a.txt", "", "a file ends in .ies or .ldt"),
    ],
)
def test_a_file_that_cannot_be_used_says_why(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(ConfigError, match=re.escape(message)):
        lamp_of(str(path))


def test_a_file_of_several_lamp_sets_is_refused_since_its_flux_is_not_known(tmp_path):
    path = tmp_path / "lamp.ldt"
    one = "1\nLED\n2000\n4000\n80\n20"
    text = ldt(1, 4, [[100, 50, 0]])
    path.write_text(text.replace(f"\n1\n{one}", f"\n2\n{one}\n{one.replace('2000', '3000')}"))
    with pytest.raises(ConfigError, match="2 sets of lamps .2000 lm, 3000 lm.*1 in line 26"):
        read_ldt(path)


def test_text_of_other_encodings_and_the_end_mark_of_dos_do_not_matter(tmp_path):
    path = tmp_path / "lamp.ldt"
    # \x85 is a letter in code page 850, and a part of one in UTF-8
    text = ldt(1, 4, [[100, 50, 0]]).replace("maker", "mak\x85r").replace("\n", "\r\n")
    path.write_bytes((text + "\r\n\x1a").encode("latin-1"))
    assert read_ldt(path).intensity_cd == pytest.approx(200)
    path = tmp_path / "lamp.ies"
    text = ies(1, [0, 45, 90], [0], [[100, 50, 0]])
    path.write_text(text.replace("TILT=NONE", "[TEST] at TILT=0\nTilt=None") + "\x1a\0\0")
    assert read_ies(path).intensity_cd == pytest.approx(200)


def test_blanks_between_rules_do_not_matter():
    assert lamp_of("driving", "r112_b_driving, r149_b_driving, ").rules == family("driving").rules


@pytest.mark.parametrize(("angles", "words"), [((0, 90, 45), "gamma 0, 90, 45"), ((0, 0, 0), "0")])
def test_angles_of_eulumdat_that_do_not_rise_are_one_error(tmp_path, angles, words):
    path = tmp_path / "lamp.ldt"
    path.write_text(ldt(1, 4, [[100, 50, 0]], angles))
    with pytest.raises(ConfigError, match=f"{words}.* degrees; expected two or more angles"):
        read_ldt(path)
    path.write_text(ldt(0, 4, [[100, 50, 0]] * 4).replace("\n90.0\n180", "\n190.0\n180"))
    with pytest.raises(ConfigError, match="C planes at 0, 190, 180, 270 degrees"):
        read_ldt(path)


@pytest.mark.parametrize(
    ("first", "factor"), [("IESNA91", 0.8), ("a maker", 0.8), ("IESNA:LM-63-1995", 1.0)]
)
def test_the_ballast_lamp_factor_counts_in_files_before_1995(tmp_path, first, factor):
    path = tmp_path / "lamp.ies"
    text = ies(1, [0, 45, 90], [0], [[100, 50, 0]], 1.0).replace("IESNA:LM-63-2002", first)
    path.write_text(text.replace(" 1 1 10\n", " 1 0.8 10\n"))
    assert read_ies(path).intensity_cd == pytest.approx(100 * factor)


C_DEG = [0, 90, 180, 270, 360]


@pytest.mark.parametrize(
    ("planes", "candela"),
    [
        (C_DEG, [[100, 50, 0]] * 6),  # a plane too many
        (C_DEG[:4], [[100, 50, 0]] * 5),  # a plane that the head does not count
        (C_DEG, [*[[100, 50, 0]] * 4, [100, 50]]),  # a value too few
    ],
)
def test_a_file_of_lm_63_with_other_counts_than_it_says_is_refused(tmp_path, planes, candela):
    path = tmp_path / "lamp.ies"
    path.write_text(ies(1, [0, 45, 90], planes, candela))
    there = sum(map(len, candela))
    wanted = f"has {there} values of candela after its angles; expected {len(planes)} planes of 3"
    with pytest.raises(ConfigError, match=wanted):
        read_ies(path)


def test_a_file_of_lm_63_that_counts_too_few_planes_is_refused(tmp_path):
    """Otherwise its last plane would be read as candela, and all later values at wrong angles."""
    path = tmp_path / "lamp.ies"
    text = ies(1, [0, 45, 90], C_DEG, [[100, 50, 0]] * 5)
    path.write_text(text.replace(" 3 5 1 2 ", " 3 4 1 2 "))
    with pytest.raises(ConfigError, match="has 16 values of candela"):
        read_ies(path)


@pytest.mark.parametrize("symmetry", [0, 1, 2, 3, 4])
def test_a_file_of_eulumdat_with_surplus_planes_is_refused(tmp_path, symmetry):
    path = tmp_path / "lamp.ldt"
    path.write_text(ldt(symmetry, 4, [[100, 50, 0]] * 5))
    with pytest.raises(ConfigError, match="has 15 values of candela after its angles; expected"):
        read_ldt(path)


def test_wrong_names_get_the_nearest_one():
    with pytest.raises(ConfigError, match="did you mean 'dipped_r149_c'"):
        lamp_of("dipped_r149")
    with pytest.raises(ConfigError, match="did you mean 'r112_b'"):
        lamp_of("driving", "r112")
    with pytest.raises(ConfigError, match="no file"):
        lamp_of("gone.ies")


def test_the_report_prints_what_is_broken_and_draws_the_plot(tmp_path, capsys):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "beam.png"
    assert report("dipped_r112_b", plot=str(picture))
    assert picture.stat().st_size > 10_000
    assert "16 of 16 rules are met" in capsys.readouterr().out
    assert not report("rear_position", "stop")
    assert "BROKEN" in capsys.readouterr().out


@pytest.mark.parametrize("peak_cd", [1000.0, 0.5])
def test_the_plot_of_a_lamp_without_rules_shows_its_whole_beam(peak_cd):
    pytest.importorskip("matplotlib")
    side = np.arange(-90.0, 91.0)
    value = np.maximum(np.cos(np.radians(side)), 0) * np.cos(np.radians(side[:, None]))
    table = IntensityTable(side, side, value)
    wide, high = isocandela._half_size_deg(table, [])
    assert min(wide, high) > 80  # a Lambertian lamp has a tenth of its intensity at 84 degrees
    inside = np.abs(side) <= min(wide, high)
    levels = isocandela._levels_cd(peak_cd * value[inside][:, inside])
    assert len(levels) >= 3


@pytest.mark.parametrize(
    "plot,error,message",
    [("b.xyz", ConfigError, "beam.png"), ("/dev/null/b.png", CatalogError, "cannot be written")],
)
def test_a_plot_that_cannot_be_written_is_refused_in_one_line(plot, error, message):
    pytest.importorskip("matplotlib")
    with pytest.raises(error, match=message):
        report("dipped_r112_b", plot=plot)


def test_a_scene_gets_the_beam_that_is_asked_for():
    model = builders._built(("own_headlamps", 2.0, 0.65, 0.65))
    lamps = lambda beam: [p.lamp for p in builders._with_beam(model, beam).parts if p.lamp]
    assert {lamp.intensity_cd for lamp in lamps("driving")} == {family("driving").intensity_cd}
    assert {lamp.intensity_cd for lamp in lamps("dipped_r112_b")} == {
        KINDS["low_beam"].intensity_cd
    }
