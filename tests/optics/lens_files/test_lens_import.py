"""Import of lens files: figures of the lens against closed forms and independent traces."""

from __future__ import annotations

import shlex

import numpy as np
import pytest
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from isethdr_optics.lens_files.importing import figures, imported, run
from isethdr_optics.prescription import prescription
from isethdr_optics.prescription.figures import spot

import isethdr_core as hdr
from isethdr_core.errors import CatalogError, ConfigError, IsetHdrError
from isethdr_core.physics.optics import glass

WITHIN = 1e-3  # relative error of focal length, back focus and spots that the import promises

SINGLET = """
RDM; LEN
TITLE 'equi-convex singlet'
EPD 25
DIM M
WL 656.27 587.56 486.13
REF 2
YAN 0 5
SO 0 1e13
S 0 0 ! the stop
STO
S 102.5 5 {glass}
{more}
S -102.5 98.3
SI 0 0
"""

# the 50 mm f/5 triplet that is shipped as `cooke_triplet`; here its stop is a surface of glass
TRIPLET = """VERS 140124
NAME triplet
UNIT {unit} X W X CM MR CPMM
ENPD {pupil}
FTYP 0 0 2 1 0 0 0
YFLN 0 {field}
WAVM 1 0.58756 1
PWAV 1
SURF 0
  TYPE STANDARD
  CURV 0
  DISZ INFINITY
{surfaces}
SURF 7
  TYPE STANDARD
  CURV 0
  DISZ 0
"""
# (radius in mm, distance in mm, glass) of the triplet, a common example of lens design programs
ROWS = [
    (22.01359, 3.25896, "SK16"),
    (-435.76044, 6.00755, ""),
    (-22.21328, 0.99997, "F2"),
    (20.29192, 4.75041, ""),
    (79.6836, 2.95208, "SK16"),
    (-18.39533, 42.20778, ""),
]


def zmx(path, scale=1.0, unit="MM", more="", stop=4, field=20):
    """Write the triplet as a Zemax file; lengths divided by `scale`."""
    blocks = []
    for number, (radius, distance, name) in enumerate(ROWS, 1):
        lines = [f"SURF {number}"] + ["  STOP"] * (number == stop) + ["  TYPE STANDARD"]
        lines += [f"  CURV {scale / radius:.15g} 0 0 0 0", f"  DISZ {distance / scale:.15g}"]
        lines += [f"  GLAS {name} 0 0 1.5 40 0 0"] * bool(name)
        blocks.append("\n".join(lines + [more] * (number == 3)))
    text = TRIPLET.format(unit=unit, pupil=10 / scale, surfaces="\n".join(blocks), field=field)
    path.write_bytes(text.encode("utf-16"))
    return path


def seq(path, name="NBK7_SCHOTT", more=""):
    path.write_text(SINGLET.format(glass=name, more=more))
    return path


def edited(folder, old, new):
    """Write the singlet of NBK7 with one command changed."""
    path = folder / "a.seq"
    path.write_text(SINGLET.format(glass="NBK7", more="").replace(old, new))
    return path


def primary(folder, number):
    """Write the triplet with another number of the primary wavelength."""
    path = zmx(folder / "a.zmx")
    text = path.read_bytes().decode("utf-16")
    path.write_bytes(text.replace("PWAV 1", f"PWAV {number}").encode("utf-16"))
    return path


GLASS = ["SK16=1.62041/60.32", "F2=1.62004/36.37"]


def meridional(rows, heights_mm):
    """Return the heights, mm, on the sensor of rays parallel to the axis, by angles and sines
    alone.

    Source: Welford (1986), Aberrations of Optical Systems, 4.3. Each surface has the perpendicular
    Q from its vertex to the ray, the angle U of the ray with the axis and the angles of incidence
    and refraction.


    Parameters
    ----------
    rows : (radius in mm, thickness in mm, index behind) of each surface from front to sensor.
    heights_mm : heights of the rays above the axis in front of the lens.
    """
    angle = 0.0 * heights_mm
    q = 1.0 * heights_mm
    index = 1.0
    for radius, distance, behind in rows:
        incidence = np.arcsin(q / radius + np.sin(angle))
        refracted = np.arcsin(index / behind * np.sin(incidence))
        angle = angle + refracted - incidence
        index = behind
        q = radius * (np.sin(refracted) - np.sin(angle)) + distance * np.sin(angle)
    return q / np.cos(angle)


def test_a_singlet_has_the_figures_of_the_thick_lens_formula(tmp_path):
    lens = imported(seq(tmp_path / "a.seq")).lens
    found = figures(lens)
    n = float(glass.index("N-BK7", 587.56))
    r = 102.5
    d = 5.0
    power = (n - 1) * (2 / r - (n - 1) * d / (n * r * r))  # lensmaker's equation
    assert found.focal_length_mm == pytest.approx(1 / power, rel=1e-9)
    assert found.back_focus_mm == pytest.approx((1 - (n - 1) * d / (n * r)) / power, rel=1e-9)
    assert found.f_number == pytest.approx(1 / power / 25, rel=1e-9)
    assert lens.half_field_deg == 5.0


def test_spots_on_the_axis_agree_with_a_trace_by_other_formulas(tmp_path):
    lens = imported(seq(tmp_path / "a.seq")).lens
    n = float(glass.index("N-BK7", 587.56))
    rho = (np.arange(2000) + 0.5) / 2000
    # the stop lies at the front vertex, so the heights of the rays are those in the stop
    y = meridional([(102.5, 5.0, n), (-102.5, 98.3, 1.0)], 12.5 * rho)
    wanted = 1e3 * np.sqrt(np.mean(y**2 * 2 * rho))
    assert figures(lens).spots[0][1] == pytest.approx(wanted, rel=WITHIN)


def test_three_formats_and_units_give_one_lens(tmp_path):
    own = prescription.load("cooke_triplet")
    lens = imported(zmx(tmp_path / "a.zmx"), ["SK16=1.62041/60.32", "F2=F2"]).lens
    assert len(lens.surfaces) == len(own.surfaces)
    found = figures(lens)
    assert found.f_number == pytest.approx(found.focal_length_mm / 10, rel=1e-9)
    # 1e-4: nd/Vd of SK16 against the formula of N-SK16
    assert found.focal_length_mm == pytest.approx(own.focal_length_mm(587.56), rel=1e-4)
    inches = imported(zmx(tmp_path / "b.zmx", 25.4, "IN"), ["SK16=1.62041/60.32", "F2=F2"]).lens
    for one, other in zip(inches.surfaces, lens.surfaces, strict=True):
        assert one.z_mm == pytest.approx(other.z_mm, abs=1e-9)
        assert one.semi_diameter_mm == pytest.approx(other.semi_diameter_mm, rel=1e-9)
    n = [glass.index(v, 587.56) for v in ("1.62041/60.32", "F2", "1.62041/60.32")]
    indices = iter(n)
    table = [f"{r} {d} {next(indices) if name else 1.0} 20 # {name}" for r, d, name in ROWS[:3]] + [
        "20.29192 0 1 20",
        "0 4.75041 1 8.2",
    ]
    table += [f"{r} {d} {next(indices) if name else 0.0} 20" for r, d, name in ROWS[4:]]
    (tmp_path / "c.dat").write_text("# a comment\n" + "\n".join(table))
    film = figures(imported(tmp_path / "c.dat").lens)
    assert film.focal_length_mm == pytest.approx(found.focal_length_mm, rel=1e-7)
    assert film.back_focus_mm == pytest.approx(found.back_focus_mm, rel=1e-7)


def hyperbolic(path, shape, n=1.5, radius=20.0):
    """Write a plano-hyperbolic lens, which focuses collimated light to a perfect point."""
    path.write_text(
        f"RDM; LEN; EPD 16; DIM M; WL 587.56; SO 0 1e13\nS 0 4 {n - 1:.3f}000.999000\nSTO\n"
        f"S {-radius} {radius / (n - 1)}\n{shape}\nSI 0 0\n"
    )
    return path


def test_a_hyperboloid_focuses_to_a_point(tmp_path):
    # Descartes: the conic constant is -n^2. Glass code 500000.999000 is n = 1.5 at the d line with
    # almost no dispersion
    [conic] = [f"CON; K {-(1.5**2)}"]
    lens = imported(hyperbolic(tmp_path / "a.seq", conic), ["500000.999000=1.5"]).lens
    assert figures(lens).spots[0][1] < 1e-6  # um; a sphere has 100
    sphere = imported(hyperbolic(tmp_path / "b.seq", ""), ["500000.999000=1.5"]).lens
    assert figures(sphere).spots[0][1] > 50
    # an even asphere with the difference between hyperboloid and sphere as powers of r has the same
    # focus
    c = -1 / 20
    x = np.linspace(0, 1.2, 60)

    def sag(k):
        return c * (8 * x) ** 2 / (1 + np.sqrt(1 - (1 + k) * c**2 * (8 * x) ** 2))

    powers = range(4, 21, 2)
    fit = np.linalg.lstsq(np.stack([x**p for p in powers], 1), sag(-2.25) - sag(0), rcond=None)[0]
    terms = "; ".join(
        f"{letter} {a / 8.0**p:.17g}" for letter, a, p in zip("ABCDEFGHJ", fit, powers)
    )
    even = imported(hyperbolic(tmp_path / "c.seq", "ASP; " + terms), ["500000.999000=1.5"]).lens
    assert figures(even).spots[0][1] < 1e-2  # um; the residual of the fit, out of 100


def test_an_odd_asphere_bends_rays_as_snells_law_says(tmp_path):
    odd = "  TYPE ODDASPHE\n  PARM 3 {}\n  PARM 5 {}"
    text = TRIPLET.format(unit="MM", pupil=10, field=0, surfaces="{}")
    a3 = -2e-4
    a5 = 1e-7
    n = 1.5
    blocks = [
        "SURF 1\n  STOP\n  CURV 0\n  DISZ 5",
        "SURF 2\n  CURV 0\n  DISZ 4\n  GLAS A 0 0 1.5 40",
        f"SURF 3\n{odd.format(a3, a5)}\n  CURV -0.02\n  DISZ 60",
    ]
    (tmp_path / "a.zmx").write_text(text.format("\n".join(blocks)))
    lens = imported(tmp_path / "a.zmx", ["A=1.5"]).lens
    assert lens.surfaces[2].odd == (a3, a5)
    rho = (np.arange(4000) + 0.5) / 4000
    r = 5 * rho
    z = -0.02 * r**2 / (1 + np.sqrt(1 - 0.0004 * r**2)) + a3 * r**3 + a5 * r**5
    slope = -0.02 * r / np.sqrt(1 - 0.0004 * r**2) + 3 * a3 * r**2 + 5 * a5 * r**4
    tilt = np.arctan(slope)  # angle of the normal; light in the glass is parallel to the axis
    out = np.arcsin(n * np.sin(tilt)) - tilt
    y = r + (60 - z) * np.tan(out)
    assert figures(lens).spots[0][1] == pytest.approx(
        1e3 * np.sqrt(np.mean(y**2 * 2 * rho)), rel=WITHIN
    )
    bigger = lens.scaled(2 * lens.focal_length_mm())
    assert spot(bigger, 0.0).radius_mm == pytest.approx(2 * spot(lens, 0.0).radius_mm, rel=1e-9)


CATALOGUE = """! a comment
NM MY-BK7 2 0 1.5168 64.17 0 1
CD 1.03961212 6.00069867E-3 2.31792344E-1 2.00179144E-2 1.01046945 1.03560653E+2
LD 0.3 2.5
NM OLD 1 0 1.5168 64.17 0 1
CD 2.2718929 -1.0108077E-2 1.0592509E-2 2.0816965E-4 -7.6472538E-6 4.9240991E-7
LD 0.365 1.014
NM HERZ 3 0 1.5 60 0 1
CD 1 2 3
LD 0.3 2.5
"""


def test_glasses_come_from_a_catalogue_file(tmp_path):
    (tmp_path / "own.agf").write_text(CATALOGUE)
    lens = imported(seq(tmp_path / "a.seq", "MYBK7_OWN"), [str(tmp_path / "own.agf")]).lens
    bk7 = glass.index("N-BK7", [450.0, 650.0])
    np.testing.assert_allclose(lens.indices([450.0, 650.0])[2], bk7, rtol=1e-12)
    old = imported(seq(tmp_path / "a.seq", "OLD"), [str(tmp_path / "own.agf")]).lens
    # 2e-5: Schott's formula of BK7 against that of N-BK7, a remake of the glass
    np.testing.assert_allclose(old.indices([450.0, 650.0])[2], bk7, atol=2e-5)
    code = imported(seq(tmp_path / "a.seq", "516800.641700")).lens
    assert code.media[2] == "1.5168/64.17"
    with pytest.raises(ConfigError, match="glass 'HERZ' is unknown"):
        imported(seq(tmp_path / "a.seq", "HERZ"), [str(tmp_path / "own.agf")])


BAD = [
    (lambda p: seq(p / "a.seq", "LAK99"), "surface 2: glass 'LAK99' is unknown"),
    (lambda p: seq(p / "a.seq", more="ADE 3"), "surface 2: ADE 3 .tilted or decentred"),
    (lambda p: seq(p / "a.seq", "REFL"), "surface 2: a mirror"),
    (lambda p: seq(p / "a.seq", more="SPS XYP"), "surface 2: shape SPS XYP"),
    (lambda p: seq(p / "a.seq", more="STO"), "the file names 2 stops"),
    (lambda p: zmx(p / "a.zmx", more="  TYPE COORDBRK"), "surface 3: a coordinate break"),
    (lambda p: zmx(p / "a.zmx", more="  TYPE BICONICX"), "surface 3: type BICONICX"),
    (lambda p: zmx(p / "a.zmx", more="  TYPE EVENASPH\n  PARM 1 0.1"), "a term in r.2 "),
    (lambda p: zmx(p / "a.zmx", more="  DISZ -4"), "surface 3: a thickness of -4 mm"),
    (lambda p: zmx(p / "a.zmx", stop=9), "the file names 0 stops"),
    (lambda p: zmx(p / "a.zmx", more="  CURV x"), "has 'x'; expected a number"),
    (lambda p: edited(p, "REF 2", "REF inf"), "REF inf' has 'inf'; expected a whole number"),
    (lambda p: edited(p, "REF 2", "REF -1"), "reference wavelength -1, .* expected 1 to 3 in its"),
    (lambda p: edited(p, "REF 2", "REF 4"), "has 3 wavelengths; expected 1 to 3 in its line REF"),
    (lambda p: edited(p, "DIM M", "DIM X"), "has the unit 'X'; expected one of M, C, I; save"),
    (lambda p: edited(p, "SI 0 0", "STO S4"), "STO S4' names S4; expected one of the 3 surfaces"),
    (lambda p: zmx(p / "a.zmx", unit="FT"), "UNIT has the unit 'FT'; expected one of MM, CM"),
    (lambda p: zmx(p / "a.zmx", more="  PARM inf 1"), "PARM has 'inf'; expected a whole number"),
    (lambda p: zmx(p / "a.zmx", more="SURF 0\n  GLAS ___BLANK 1 0 1.5 a"), "GLAS has 'a'"),
    (lambda p: primary(p, "inf"), "PWAV has 'inf'; expected a whole number"),
    (lambda p: primary(p, "9"), "primary wavelength 9, and has the wavelengths 1; expected"),
    (lambda p: p / "none.zmx", "none.zmx is not a file"),
    (lambda p: p / "lens.len", "lens.len ends in '.len'"),
]


@pytest.mark.parametrize("write, message", BAD)
def test_what_cannot_be_imported_is_named(tmp_path, write, message):
    with pytest.raises(IsetHdrError, match=message) as caught:
        imported(write(tmp_path), GLASS)
    assert "\n" not in str(caught.value)


def test_every_unsupported_surface_is_named_in_one_error(tmp_path):
    path = zmx(tmp_path / "a.zmx", more="  TYPE TOROIDAL")
    with pytest.raises(ConfigError, match="surface 3: type TOR.*surface 1: glass.*surface 5: gl"):
        imported(path)
    for name in ("a.seq", "b.dat", "c.zmx"):
        (tmp_path / name).write_text("1 2\n")
        with pytest.raises(CatalogError, match=name):
            imported(tmp_path / name)


def test_the_written_prescription_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run(str(zmx(tmp_path / "own.zmx")), GLASS, "")
    text = capsys.readouterr().out
    assert "effective focal length  50.0" in text and "note: the stop is a plane" in text
    typed = dict(word.split("=") for word in text.splitlines()[-1].split()[3:])
    lens = hdr.build(
        "lens",
        "prescription",
        prescription="own.yaml",
        focal_length_mm=float(typed["lens.focal_length_mm"]),
        f_number=float(typed["lens.f_number"]),
    )
    assert lens.real().stop == 4  # behind the glass of surface 3
    assert lens.wavefront_at(0.1)


def test_a_name_with_special_characters_is_typed_so_that_it_is_read(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my lens (2).dat").write_text("50 5 1.5 20\n0 2 1 10\n-50 40 1 20\n")
    run("my lens (2).dat", [], "")
    words = shlex.split(capsys.readouterr().out.splitlines()[-1])
    overrides = OverridesParser.create().parse_overrides(words[2:])
    values = {override.key_or_group: override.value() for override in overrides}
    assert values["lens.prescription"] == "my lens (2).yaml"
    assert (tmp_path / "my lens (2).yaml").is_file()


def test_the_design_field_pairs_the_angles_along_x_and_y(tmp_path):
    path = tmp_path / "a.seq"
    path.write_text("EPD 5; XAN 0 10; YAN 0 -5; SO 0 1e13\nS 50 5 NBK7\nSTO\nS -50 48\nSI\n")
    # the first and second field points lie 5 and 10 degrees off the axis in other directions
    assert imported(path).lens.half_field_deg == pytest.approx(
        np.degrees(np.arctan(np.hypot(np.tan(np.radians(10)), np.tan(np.radians(5)))))
    )


@pytest.mark.parametrize("aperture", ["EPD 0", "FNO 0"])
def test_a_file_without_an_aperture_is_refused(tmp_path, aperture):
    (tmp_path / "a.seq").write_text(SINGLET.format(glass=1.5, more="").replace("EPD 25", aperture))
    with pytest.raises(ConfigError, match="entrance pupil of .* expected a diameter above 0"):
        imported(tmp_path / "a.seq", ["1.5=1.5"])


def test_a_field_wider_than_tangents_is_cut_and_said(tmp_path):
    text = SINGLET.format(glass=1.5, more="").replace("YAN 0 5", "YAN 0 95")
    (tmp_path / "a.seq").write_text(text)
    found = imported(tmp_path / "a.seq", ["1.5=1.5"])
    assert found.lens.half_field_deg == 75.0
    assert "the field of the file reaches 95 degrees off the axis" in found.notes[0]


def test_a_file_without_field_angles_gets_a_half_field_with_a_note(tmp_path):
    text = SINGLET.format(glass=1.5, more="").replace("YAN 0 5", "")
    (tmp_path / "a.seq").write_text(text)
    found = imported(tmp_path / "a.seq", ["1.5=1.5"])
    assert found.lens.half_field_deg == 20.0
    assert "a half field of 20 degrees is assumed" in found.notes[0]


BLOCKED = ["CIR 0.001", "K 1e9", "K inf", "A 1e6"]


@pytest.mark.parametrize("more", BLOCKED)
def test_a_surface_that_no_ray_passes_is_named(tmp_path, more):
    path = tmp_path / "a.seq"
    path.write_text(SINGLET.format(glass="NBK7", more="").replace("SI 0 0", f"{more}; SI"))
    with pytest.raises(ConfigError, match=r"axis passes surface 3 .radius -102.5.* correct its"):
        imported(path)


def test_a_field_angle_without_light_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = SINGLET.format(glass="NBK7", more="").replace("S 0 0 !", "S 0 60 !")
    text = text.replace("SI 0 0", "CIR 14; SI").replace("YAN 0 5", "YAN 0 60")
    (tmp_path / "a.seq").write_text(text)
    run("a.seq", [], "")
    printed = capsys.readouterr().out
    assert "no light passes at 60 degrees" in printed and "nan" not in printed


def test_code_v_commands_act_on_the_surfaces_that_they_name(tmp_path):
    plain = imported(edited(tmp_path, "DIM M", "DIM M")).table["surfaces"]
    text = SINGLET.format(glass="AIR", more="").replace("STO\n", "").replace("98.3", "1")
    addressed = "K S3 -1; CIR S2..3 14; THI S3 98.3; GLA S2 NBK7; STO S1"
    for commands in (f"{addressed}; SI 0 0; THI SI 0.1", f"SI 0 0; THI S0 1e13; {addressed}"):
        (tmp_path / "b.seq").write_text(text.replace("SI 0 0", commands))
        found = imported(tmp_path / "b.seq").table["surfaces"]
        assert found[2].pop("conic") == -1.0
        assert [row.pop("semi_diameter_mm") for row in found[1:]] == [14.0, 14.0]
        assert found == plain


def test_code_v_radii_and_curvatures_may_follow_their_surface(tmp_path):
    text = "EPD 5; YAN 0 5; SO 0 1e13\n{surfaces}\nSI\n"
    (tmp_path / "a.seq").write_text(text.format(surfaces="S 32 4 NBK7\nSTO\nS -32 48"))
    wanted = imported(tmp_path / "a.seq").table["surfaces"]
    for surfaces in (
        "S 1 4 NBK7; RDY 32\nSTO\nS 1 48; CUY -0.03125",
        "S 1 4 NBK7\nSTO\nS 1 48\nCUY S1 0.03125; RDY S2 -32",
    ):
        (tmp_path / "b.seq").write_text(text.format(surfaces=surfaces))
        assert imported(tmp_path / "b.seq").table["surfaces"] == wanted


@pytest.mark.parametrize(
    ("solve", "kept"),
    [
        ("CUY UMY -0.1", "curvature"),
        ("CUY S2 UMY -0.1", "curvature"),
        ("CUY PIK S1", "curvature"),
        ("RDY SA 0", "radius"),
        ("THI PIM", "thickness"),
    ],
)
def test_a_solve_of_code_v_keeps_the_value_of_its_surface_and_is_said(tmp_path, solve, kept):
    text = "EPD 5; YAN 0 5; SO 0 1e13; THI SO RED 0\nS 32 4 NBK7\nSTO\nS -32 48\n{more}\nSI\n"
    (tmp_path / "a.seq").write_text(text.format(more=""))
    plain = imported(tmp_path / "a.seq")
    (tmp_path / "b.seq").write_text(text.format(more=solve))
    found = imported(tmp_path / "b.seq")
    assert found.table["surfaces"] == plain.table["surfaces"]
    [note] = set(found.notes) - set(plain.notes)
    told = solve.replace("S2 ", "")
    assert note == f"surface 2 has the solve {told!r}; here it keeps the {kept} of its line S"
    assert "the object surface has the solve 'THI RED 0'; here it keeps" in " ".join(plain.notes)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("RDY INFINITE", r"'INFINITE'; expected a number or a solve .APL, .*; type RDY 0 for a pl"),
        ("CUY S2 flat", "'flat'; expected a number or a solve .*; type CUY 0 for a plane, or the"),
        ("THI thirty", "'thirty'; expected a number or a solve .*; type the number; or delete the"),
        ("THI I PIM", "'I'; expected a number or a solve"),
        ("THI SO far", "'far'; expected a number or a solve"),
    ],
)
def test_other_words_of_code_v_are_no_solves(tmp_path, command, said):
    """A plane, or a misspelt number, would keep the radius of the line S."""
    text = "EPD 5; YAN 0 5; SO 0 1e13\nS 32 4 NBK7\nSTO\nS -32 48\n{}\nSI\n"
    (tmp_path / "a.seq").write_text(text.format(command))
    with pytest.raises(ConfigError, match=said):
        imported(tmp_path / "a.seq")
    for advice in ("S 0 48; RDY 0", "S 0 48; CUY 0", "S 0 48; RDY INFINITY"):
        (tmp_path / "a.seq").write_text(text.replace("S -32 48", advice).format(""))
        assert imported(tmp_path / "a.seq").table["surfaces"][-1]["radius_mm"] == np.inf


@pytest.mark.parametrize("command", ["CUY 0.O3", "RDY 3O", "THI nan", "S2 4x"])
def test_a_misspelt_number_of_code_v_is_no_solve(tmp_path, command):
    text = f"EPD 5; YAN 0 5; SO 0 1e13\nS 32 4 NBK7\nSTO\nS -32 48\n{command}\nSI\n"
    (tmp_path / "a.seq").write_text(text)
    with pytest.raises(ConfigError, match="expected a number"):
        imported(tmp_path / "a.seq")


def test_a_mirror_of_code_v_is_refused(tmp_path):
    text = "EPD 5; YAN 0 5; SO 0 1e13\nS 32 4 NBK7\nSTO\nS -32 48; RMD REFL\nSI\n"
    (tmp_path / "a.seq").write_text(text)
    with pytest.raises(ConfigError, match="surface 2: a mirror"):
        imported(tmp_path / "a.seq")


def test_a_glass_may_be_called_as_the_image_surface(tmp_path):
    focal_mm = []
    for name in ("SX", "SI"):
        text = f"EPD 5; YAN 0 5; SO 0 1e13\nS 30 4; GLA {name}\nSTO\nS -30 48\nSI\n"
        (tmp_path / f"{name}.seq").write_text(text)
        found = imported(tmp_path / f"{name}.seq", ["SI=2.4/40", "SX=2.4/40"])
        focal_mm.append(found.lens.focal_length_mm())
    assert focal_mm[0] == focal_mm[1]


def test_a_damaged_catalogue_is_refused_in_one_line(tmp_path):
    path = tmp_path / "own.agf"
    path.write_bytes("CC own".encode("utf-16") + b"x")
    with pytest.raises(CatalogError, match="own.agf holds no glass"):
        imported(seq(tmp_path / "a.seq"), [str(path)])
    path.write_text("NM OLD inf 0 1.5 60\n")
    with pytest.raises(CatalogError, match="glass 'OLD' has a line that is no list of numbers"):
        imported(seq(tmp_path / "a.seq"), [str(path)])


def test_a_prescription_that_passes_no_light_is_refused(tmp_path):
    """Otherwise relative illumination would be 0 / 0."""
    lens = imported(seq(tmp_path / "a.seq"))
    lens.table["surfaces"][2]["semi_diameter_mm"] = 1e-3
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(lens.table))
    with pytest.raises(ConfigError, match="passes no light along its axis at f/8; expected"):
        hdr.build("lens", "prescription", prescription=str(tmp_path / "own.yaml"), f_number=8)
