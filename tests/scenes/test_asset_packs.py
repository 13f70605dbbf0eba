"""Asset packs: the pack of the how-to is drawn, valid and lit; all mistakes of a broken pack are
reported in one error; a changed byte changes the name of a scene.
"""

from __future__ import annotations

import json
import re
import shutil
import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh
import yaml
from isethdr_scenes.coloured import material_of, name_of
from isethdr_scenes.contact_sheets.choice import chosen
from isethdr_scenes.geometry.mesh.piece import Piece
from isethdr_scenes.lamp_spectra import spectrum_of
from isethdr_scenes.lamps import lamp
from isethdr_scenes.materials import used
from isethdr_scenes.photometry.families import family
from isethdr_scenes.placing.plan import Layout, Standing
from isethdr_scenes.placing.site import Foot
from isethdr_scenes.roads.kinds import kind
from isethdr_scenes.street import Street
from isethdr_scenes.street_detail import levels
from isethdr_scenes.street_models import switched, things_of
from isethdr_scenes.things import build, rider_of
from isethdr_scenes.things.detail import extent_m
from isethdr_scenes.things.packs.asset import creased
from isethdr_scenes.things.packs.mesh_file import read_mesh
from isethdr_scenes.things.packs.pack import load_pack, stock_of
from isethdr_scenes.things.packs.soundness import open_edges
from isethdr_scenes.things.packs.surfaces import material_names
from isethdr_scenes.things.stock import BUNDLED
from PIL import Image

from isethdr_core.errors import ConfigError
from isethdr_core.physics.colour.colour_spaces import linear_srgb, srgb_encode
from isethdr_core.physics.photometry import luminance, xyz
from isethdr_core.runs.provenance import input_digests
from isethdr_core.scene import Model, Part

from ..house.source import ROOT

PAGE = (ROOT / "docs" / "how-to" / "asset_packs.md").read_text()


@pytest.fixture(scope="module")
def pack(tmp_path_factory):
    """Run the program of the how-to and return the folder of the pack that it writes."""
    folder = tmp_path_factory.mktemp("packs") / "my_pack"
    folder.mkdir()
    program = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL).group(1)
    for name in ("delivery.glb", "rock.ply"):
        program = program.replace(f'"{name}"', repr(str(folder / name)))
    exec(compile(program, "docs/how-to/asset_packs.md", "exec"), {})  # noqa: S102
    (folder / "pack.yaml").write_text(re.search(r"```yaml\n(.*?)```", PAGE, re.DOTALL).group(1))
    return folder


@pytest.fixture(scope="module")
def car(pack):
    return load_pack(str(pack)).things[0]


def test_the_pack_of_the_how_to_has_its_sizes_classes_and_lamps(pack, car):
    rock = load_pack(str(pack)).things[1]
    assert (car.category, car.group, car.family) == ("car", "car", "delivery_car")
    assert (rock.category, rock.group) == ("rock", "rock")
    assert car.asset.licence == "CC0-1.0"
    for thing in (car, rock):
        low, high = extent_m(build(thing, "near"))
        assert high - low == pytest.approx(thing.size_m, abs=1e-3)  # sizes are rounded to mm
        assert (low + high)[:2] == pytest.approx([0, 0], abs=1e-9) and low[2] == pytest.approx(0)
    assert rock.size_m == pytest.approx((1.0, 0.7, 0.5), abs=0.01)  # a ball of 320 faces
    lamps = {p.name: p for p in build(car, "near").parts if p.lamp}
    assert [p.lamp.kind for p in lamps.values()] == ["low_beam"] * 2 + ["tail"] * 2
    assert [p.lamp.intensity_cd for p in lamps.values()][2:] == [8, 8]
    assert [np.sign(p.vertices[:, 1].mean()) for p in lamps.values()] == [1, -1, 1, -1]
    assert [list(p.lamp.axis) for p in lamps.values()] == [[1, 0, 0]] * 2 + [[-1, 0, 0]] * 2


def test_coarser_levels_keep_extent_and_lamps_and_cost_what_they_state(car):
    counts = car.asset.triangles()
    assert list(counts) == sorted(counts, reverse=True)
    for count, level in zip(counts, ("near", "middle", "far", "distant"), strict=True):
        model = car.asset.build(level)
        assert sum(len(p.faces) for p in model.parts) == count
        low, high = extent_m(model)
        assert high - low == pytest.approx(car.size_m, abs=1e-3)
        assert sum(p.lamp is not None for p in model.parts) == 4


def test_things_of_packs_have_their_share_of_the_draws_and_without_packs_nothing_changes(pack):
    stock = stock_of((str(pack),))
    rng = np.random.default_rng(1)
    own = [stock.draw("car", rng).family == "delivery_car" for _ in range(400)]
    # three standard deviations of 400 draws at 0.5
    assert np.mean(own) == pytest.approx(0.5, abs=0.075)
    assert stock.draw("car", rng, "delivery_car") == load_pack(str(pack)).things[0]
    assert stock.draw("car", rng, "sedan").family == "sedan"
    assert set(stock.names("car")) == {*BUNDLED.names("car"), "delivery_car"}
    for group in ("truck", "person"):
        draws = [s.draw(group, np.random.default_rng(3)) for s in (stock, BUNDLED)]
        assert draws[0] == draws[1]
    with pytest.raises(ValueError, match="no family 'tram'"):
        stock.draw("car", rng, "tram")


def test_a_street_places_labels_and_lights_what_a_pack_adds(pack, car):
    street = Street(seed=3, road="country_crest", vehicles_per_km=30.0, assets=(str(pack),))
    standing = [s for s in street.plan().standing if s.foot.thing == car]
    assert standing and "low_beam" in standing[0].foot.lamps
    eye = street.eye()
    assert set(levels(standing, eye.position_m)) == {car}
    spectra = {"headlights": "led_white"}
    models, objects = things_of(street.plan(), standing[:1], eye, spectra, "dipped_r149_c")
    own = next(o for o in objects if o.name == standing[0].name)
    assert own.category == "car"
    lit = {p.lamp.kind: p.lamp for p in models[own.model].parts if p.lamp}
    assert lit["low_beam"].table is family("dipped_r149_c").table
    assert lit["tail"].intensity_cd == 8
    materials = used({own.model: models[own.model]})
    assert {p.material for p in models[own.model].parts} == set(materials)


def test_the_bytes_of_a_pack_are_part_of_the_names_of_results(pack, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(pack, folder)
    scene = Street(assets=(str(folder),))
    before = input_digests(scene)
    assert {name.rpartition("/")[2] for name in before} == {"pack.yaml", "delivery.glb", "rock.ply"}
    first = load_pack(str(folder)).things[1]
    again = load_pack(str(folder)).things[1]
    assert first is again
    mesh = trimesh.creation.icosphere(subdivisions=1, radius=0.4)
    mesh.export(folder / "rock.ply")
    after = input_digests(scene)
    assert [name for name in before if before[name] != after[name]] == [str(folder / "rock.ply")]
    other = load_pack(str(folder)).things[1]
    assert other != first and other.size_m != first.size_m
    assert input_digests(Street()) == {}


def broken(folder):
    """Write the files of a pack, and return a manifest in which every thing has another mistake."""
    box = trimesh.creation.box((4.0, 1.8, 1.5))
    box.export(folder / "box.ply")
    trimesh.Trimesh(box.vertices, box.faces[2:], process=False).export(folder / "holes.ply")
    trimesh.Trimesh(box.vertices, box.faces[:, ::-1], process=False).export(folder / "inside.ply")
    flat = np.concatenate([box.faces, [[0, 0, 1], [0, 1, 1]]])
    trimesh.Trimesh(box.vertices, flat, process=False).export(folder / "flat.ply")
    vertices = box.vertices.copy()
    vertices[3] = np.nan
    trimesh.Trimesh(vertices, box.faces, process=False).export(folder / "nan.ply")
    (folder / "cut.glb").write_bytes(b"glTF" + bytes(40))
    good = {"file": "box.ply", "group": "car", "materials": {"default": "paint_red"}}
    lamp = {"kind": "tail", "axis": [-1, 0, 0], "box_m": [[-3, -1, 0.1], [0, 1, 2]]}
    return {
        "things": {
            "missing": good | {"file": "bax.ply", "licence": "MIT"},
            "holes": good | {"file": "holes.ply", "licence": "MIT"},
            "inside": good | {"file": "inside.ply", "licence": "MIT"},
            "flat": good | {"file": "flat.ply", "licence": "MIT"},
            "nan": good | {"file": "nan.ply", "licence": "MIT"},
            "cut": good | {"file": "cut.glb", "licence": "MIT"},
            "huge": good | {"scale": 10, "licence": "MIT"},
            "ship": good | {"group": "ship", "licence": "MIT"},
            "axisless": good | {"lamps": [{"kind": "tail", "part": "x"}], "licence": "MIT"},
            "unlit": good | {"lamps": [lamp | {"axis": [0.1, 0, -1]}], "licence": "MIT"},
            "steep": good | {"lamps": [lamp | {"axis": [0, 0, -2]}], "licence": "MIT"},
            "nameless": good | {"lamps": [lamp | {"kind": "tial"}], "licence": "MIT"},
            "free": good,
            "typo": good | {"matrials": {}, "licence": "MIT"},
            "bare": {"file": "box.ply", "group": "car", "licence": "MIT", "materials": {}},
            "paintless": good | {"materials": {"default": "paint_rde"}, "licence": "MIT"},
            "moped": good | {"group": "motorcycle", "licence": "MIT"},
            "dark": good | {"lamps": [lamp | {"beam": "no.ies"}], "licence": "MIT"},
        }
    }


MISTAKES = {
    "missing": r"there is no file bax\.ply in the pack; did you mean 'box\.ply'",
    "holes": r"the mesh has holes: 4 edges without a second face; .*open: true",
    "inside": r"its faces look inwards \(volume -10\.8 m3\)",
    "flat": r"2 of 14 triangles have no area",
    "nan": r"1 of 8 vertices are NaN",
    "cut": r"cannot be read \(",
    "huge": r"its length is 40 m; expected 2\.2 to 7\.5 m for the group car; check scale",
    "ship": r"group is 'ship'; expected another one .*person",
    "axisless": r"lamps\.0\.axis is missing; expected where the lamp shines",
    "unlit": r"lamps\[0\] \(tail\): no face of its box looks along the axis",
    "steep": r"axis is \[0\.0, 0\.0, -2\.0\], straight up or down, .* axis: \[0\.01, 0, -1\]",
    "nameless": r"lamps\[0\]: kind is 'tial'; expected another one; did you mean 'tail'",
    "free": r"states no licence; type licence: ",
    "typo": r"matrials is no field; did you mean 'materials'",
    "bare": r"no material is stated for the part box\.ply",
    "paintless": r"there is no material 'paint_rde'; did you mean 'paint_red'",
    "moped": r"the group motorcycle have a rider, but riding is missing; type riding:",
    "dark": r"beam: there is no file no\.ies",
}


def test_all_mistakes_of_a_pack_are_told_at_once(tmp_path):
    (tmp_path / "pack.yaml").write_text(yaml.safe_dump(broken(tmp_path)))
    with pytest.raises(ConfigError) as told:
        load_pack(str(tmp_path))
    lines = str(told.value).splitlines()
    assert f"has {len(lines) - 1} mistakes" in lines[0]
    for name, words in MISTAKES.items():
        own = [line for line in lines[1:] if re.match(rf"  - {name}[ :]", line)]
        assert any(re.search(words, line) for line in own), (name, own)
    assert len(lines) - 1 <= len(MISTAKES) + 3  # also sizes in two more directions, and riding


def test_open_meshes_may_have_holes_and_shares_end_at_1(tmp_path):
    made = broken(tmp_path)["things"]
    fine = {"leaf": made["holes"] | {"open": True, "share": 0.6}}
    (tmp_path / "pack.yaml").write_text(yaml.safe_dump({"licence": "MIT", "things": fine}))
    assert load_pack(str(tmp_path)).things[0].size_m == (4.0, 1.8, 1.5)
    with pytest.raises(ConfigError, match="shares of the group car add up to 1.2"):
        stock_of((str(tmp_path), str(tmp_path)))


def test_a_folder_or_a_manifest_that_is_not_there_says_what_to_type(tmp_path):
    with pytest.raises(ConfigError, match="no folder '.*nowhere'; expected an asset pack"):
        load_pack(str(tmp_path / "nowhere"))
    with pytest.raises(ConfigError, match="has no pack.yaml"):
        Street(assets=(str(tmp_path),)).check_files()
    (tmp_path / "pack.yaml").write_text("things: [")
    with pytest.raises(ConfigError, match="cannot be read as YAML"):
        load_pack(str(tmp_path))


def test_a_triangle_of_a_vertex_that_is_missing_is_one_line(tmp_path):
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    faces = "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    path = tmp_path / "rock.ply"
    path.write_text(f"{header}{faces}0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n")
    with pytest.raises(ConfigError, match="names the vertex 7, but the part has 3 vertices"):
        read_mesh(path)
    path.write_text(path.read_text().replace("0 1 7", "0 1 2"))
    assert read_mesh(path)[0].faces.tolist() == [[0, 1, 2]]


def test_axes_scale_obj_colours_and_beams(tmp_path):
    """Import a wedge in cm with y up and -z forward: its low end must lie ahead, along +x."""
    wedge = trimesh.convex.convex_hull(
        [(x, y, z) for x in (-90, 90) for y, z in ((0, 200), (150, 200), (0, -200), (40, -200))]
    )
    material = trimesh.visual.material.SimpleMaterial(diffuse=[255, 0, 0, 255], name="red")
    wedge.visual = trimesh.visual.TextureVisuals(material=material)
    wedge.export(tmp_path / "wedge.obj", mtl_name="wedge.mtl")
    ies = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 10\n0 45 90\n0\n700 350 0\n"
    (tmp_path / "lamp.ies").write_text(ies)
    lamp = {"part": "red", "axis": [1, 0, 0]}
    entry = {
        "file": "wedge.obj",
        "group": "motorcycle",
        "scale": 0.005,
        "axes": {"forward": "-z", "up": "y"},
        "lamps": [
            lamp | {"kind": "low_beam", "beam": "lamp.ies", "box_m": [[0, 0, 0], [2, 1, 1]]},
            lamp | {"kind": "tail", "axis": [-1, 0, 0], "cd_m2": 1000},
        ],
        "riding": {"saddle": [-0.2, 0, 0.7], "grip": [0.3, 0.3, 0.9], "foot": [0.1, 0.2, 0.3]},
    }
    whole = {"licence": "MIT", "things": {"wedge": entry}}
    (tmp_path / "pack.yaml").write_text(yaml.safe_dump(whole))
    thing = load_pack(str(tmp_path)).things[0]
    assert thing.size_m == pytest.approx((2.0, 0.9, 0.75), abs=1e-9)
    model = build(thing, "near")
    ahead = np.concatenate([p.vertices for p in model.parts])
    assert ahead[ahead[:, 0] > 0.99, 2].max() == pytest.approx(0.2)
    beam, tail = (p.lamp for p in model.parts if p.lamp)
    assert beam.intensity_cd == pytest.approx(700)
    assert tail.intensity_cd == pytest.approx(1000 * 0.9 * 0.75)  # whole rear face
    part = replace(model.model().parts[-1], lamp=beam)
    kept = switched(replace(model.model(), parts=(part,)), ("low_beam",), {}, "driving")
    assert kept.parts[0].lamp.table is beam.table
    assert {p.material for p in model.parts} == {name_of("#ff0000", "satin")}
    rider = rider_of(thing, np.random.default_rng(0))
    assert rider.vehicle == thing and 1.0 < rider.size_m[2] + 0.3 < 2.3


def test_colours_of_a_glb_are_linear(tmp_path):
    """Compare with IEC 61966-2-1: linear 128 of 255 is code 188, and code 188 is linear 0.503."""
    ball = trimesh.creation.box()
    pbr = trimesh.visual.material.PBRMaterial
    texture = Image.new("RGB", (2, 2), (188, 188, 188))
    materials = {
        "factor": pbr(name="factor", baseColorFactor=[128, 255, 0, 255]),
        "plain": pbr(name="plain"),
        "texture": pbr(
            name="texture", baseColorFactor=[128, 255, 0, 255], baseColorTexture=texture
        ),
    }
    found = {}
    for name, material in materials.items():
        uv = np.full((len(ball.vertices), 2), 0.5)
        ball.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        ball.export(tmp_path / f"{name}.glb")
        found[name] = read_mesh(tmp_path / f"{name}.glb")[0].colours[0].tolist()
    assert found["factor"] == [188, 255, 0, 255]
    assert found["plain"] == [255, 255, 255, 255]
    # 0.503 x 0.502 is code 138; colours of textures are rounded to steps of 8
    assert found["texture"] == [136, 192, 0, 255]
    ball.visual = trimesh.visual.ColorVisuals(vertex_colors=np.tile([128, 255, 0, 255], (8, 1)))
    for name, code in (("v.glb", 188), ("v.ply", 128)):
        ball.export(tmp_path / name)
        assert read_mesh(tmp_path / name)[0].colours[0].tolist() == [code, 255, 0, 255]


def glb(content: dict, arrays: list[np.ndarray]) -> bytes:
    """Return a GLB file whose accessors are `arrays`: float32 (n, 3) or uint32 (n,)."""
    blob = b"".join(array.tobytes() for array in arrays)
    starts = np.cumsum([0] + [array.nbytes for array in arrays]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes}
        for start, array in zip(starts, arrays)
    ]
    kinds = {"float32": (5126, "VEC3"), "uint32": (5125, "SCALAR")}
    accessors = [
        {"bufferView": k, "count": len(array)}
        | dict(zip(("componentType", "type"), kinds[str(array.dtype)]))
        for k, array in enumerate(arrays)
    ]
    head = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(blob)}]}
    text = json.dumps(head | content | {"bufferViews": views, "accessors": accessors}).encode()
    text += b" " * (-len(text) % 4)
    whole = struct.pack("<II", len(text), 0x4E4F534A) + text
    whole += struct.pack("<II", len(blob), 0x004E4942) + blob
    return struct.pack("<III", 0x46546C67, 2, 12 + len(whole)) + whole


def test_a_mesh_of_several_materials_keeps_its_names_and_its_order(tmp_path):
    ball = trimesh.creation.box()
    vertices = ball.vertices.astype(np.float32)
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 2}, "indices": 1}
    content = {
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": "root", "children": [2, 1], "rotation": [0, 0.7071068, 0, 0.7071068]},
            {"name": "left", "mesh": 0, "translation": [1, 0, 0], "scale": [-1, 2, 1]},
            {"name": "right", "mesh": 0, "translation": [-1, 0, 0]},
        ],
        "meshes": [{"name": "Car", "primitives": [primitive | {"material": k} for k in (1, 0)]}],
        "materials": [{"name": "tyre"}, {"name": "body"}],
    }
    colours = np.tile(np.array([0.5, 1.0, 0.0], np.float32), (8, 1))
    faces = ball.faces.astype(np.uint32).ravel()
    (tmp_path / "car.glb").write_bytes(glb(content, [vertices, faces, colours]))
    parts = read_mesh(tmp_path / "car.glb")
    assert [part.names for part in parts] == [
        ("body", "Car", "left"),
        ("tyre", "Car_1", "Car", "left"),
        ("body", "Car", "right"),
        ("tyre", "Car_1", "Car", "right"),
    ]
    # x turns to -z, and a negative scale leaves the faces outwards
    assert parts[0].vertices.mean(0) == pytest.approx([0, 0, -1], abs=1e-6)
    volume = trimesh.Trimesh(parts[0].vertices, parts[0].faces, process=False).volume
    assert volume == pytest.approx(2.0, rel=1e-6)
    assert parts[0].colours[0].tolist() == [188, 255, 0, 255]  # colours of vertices are linear
    names, materials = material_names(parts[1], {"Car": "tyre"})
    assert materials == ["tyre"] and not names.any()


def test_objects_and_opacities_of_an_obj_are_read(tmp_path):
    ball = trimesh.creation.box()
    text = ["mtllib m.mtl"]
    for k, (name, material) in enumerate((("body", "red"), ("wheel", "red"), ("pane", "grey"))):
        corners = [f"v {x + 3 * k} {y} {z}" for x, y, z in ball.vertices.tolist()]
        faces = [f"f {a} {b} {c}" for a, b, c in (ball.faces + 1 + 8 * k).tolist()]
        text += [f"o {name}", *corners, f"usemtl {material}", *faces]
    (tmp_path / "car.obj").write_text("\n".join(text))
    (tmp_path / "m.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl grey\nKd 0.5 0.5 0.5\nd 0.25\n")
    parts = {part.names[-1]: part for part in read_mesh(tmp_path / "car.obj")}
    assert {name: part.names[1] for name, part in parts.items()} == {
        "body": "red",
        "wheel": "red",
        "pane": "grey",
    }
    assert parts["wheel"].vertices[:, 0].mean() == pytest.approx(3.0)
    assert parts["pane"].colours[0].tolist() == [128, 128, 128, 64]


def test_a_low_beam_of_a_pack_keeps_the_intensity_that_its_manifest_states():
    beam = lamp("low_beam", (1.0, 0.0, 0.0))
    part = Part("lens", np.eye(3), np.array([[0, 1, 2]]), "lamp_white", None, beam)
    own = replace(part, lamp=replace(beam, intensity_cd=5000.0))
    driving = family("driving")
    for name in ("dipped_r112_b", "driving"):
        model = switched(Model("m", (part, own)), ("low_beam",), {}, name)
        usual, kept = (one.lamp for one in model.parts)
        assert usual.intensity_cd == family(name).intensity_cd
        assert kept.intensity_cd == 5000.0
    assert kept.table is driving.table


def test_a_material_has_the_colour_it_states():
    """In daylight, the reflectance computed from a colour has that colour.

    The reflectance has bands of 20 nm, and interpolation between them errs by up to 2 codes of 255.
    """
    nm = np.arange(400.0, 701.0, 10.0)
    light = spectrum_of("daylight").at(nm)
    white = linear_srgb(xyz(light / luminance(light, nm), nm))
    for colour in ("#c04020", "#80786c", "#2040a0"):
        material = material_of(name_of(colour, "matt"))
        seen = linear_srgb(xyz(light * material.reflectance.at(nm) / luminance(light, nm), nm))
        code = 255 * srgb_encode(np.clip(seen / white, 0, 1))
        wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
        assert code == pytest.approx(wanted, abs=2.5)


def test_normals_are_smooth_on_a_ball_and_sharp_on_a_box(pack):
    box = trimesh.creation.box((1, 1, 1))
    assert open_edges(box.vertices, box.faces) == 0
    sharp = creased(Piece("box", box.vertices, box.faces, "steel"))
    assert np.sort(np.abs(sharp.normals), 1)[:, 2] == pytest.approx(1)
    ball = trimesh.creation.icosphere(subdivisions=3)
    smooth = creased(Piece("ball", ball.vertices, ball.faces, "steel"))
    away = (smooth.normals * smooth.vertices).sum(1)
    assert away.min() > np.cos(np.radians(2))  # each face spans 5 degrees


def test_a_sheet_shows_the_things_of_a_pack(pack):
    assert chosen(str(pack), 5, 0, False) == list(load_pack(str(pack)).things)


def test_nothing_of_a_pack_is_placed_where_its_box_does_not_fit(pack, car):
    foot = Foot("car 1", car, 0.0, 0.0, 0.0, "driving")
    layout = Layout(kind("country_crest", 1), (Standing(foot, np.eye(4)),), ())
    assert layout.standing[0].foot.boxes()[0, 2:4] == pytest.approx(np.array(car.size_m)[:2] / 2)
