"""OpenStreetMap by netconvert: files that are no map, and results of a stand-in for netconvert, so
that SUMO is not needed.
"""

from __future__ import annotations

import sys

import pytest
from isethdr_scenes.roads.kinds import kind
from isethdr_scenes.roads.opendrive import openstreetmap
from isethdr_scenes.roads.opendrive.openstreetmap import TOOL, convert
from isethdr_scenes.roads.opendrive.road_file import RoadFile, read, write

from isethdr_core.errors import CatalogError, ConfigError

WAY = '<osm><way id="1"><nd ref="1"/><tag k="highway" v="{}"/></way></osm>'
STREET = WAY.format("residential")


def mapped(folder, text=STREET):
    path = folder / "town.osm"
    path.write_text(text)
    return path


@pytest.fixture
def only_here(tmp_path, monkeypatch):
    """Restrict PATH to one folder, hide the wheel of SUMO, and return the folder."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    monkeypatch.setattr(sys, "executable", str(folder / "python"))
    monkeypatch.setattr(openstreetmap, "of_wheel", lambda name: None)
    return folder


def tool(folder, body):
    """Write a Python script to a folder as a stand-in for the converter."""
    path = folder / TOOL
    path.write_text(f"#!{sys.base_prefix}/bin/python3\nimport sys\n{body}")
    path.chmod(0o755)


@pytest.mark.parametrize(
    "text, words",
    [
        (WAY.format("footway"), "of its 1 ways none has a tag highway for cars"),
        ("<osm/>", "holds no roads: of its 0 ways"),
        ("<OpenDRIVE/>", "root element <OpenDRIVE>; expected <osm>"),
        ("no map", "not well-formed XML"),
    ],
)
def test_a_map_without_roads_is_one_error(text, words, tmp_path):
    with pytest.raises(CatalogError, match=words):
        convert(mapped(tmp_path, text), tmp_path / "out.xodr")


def test_a_missing_converter_names_the_extra(tmp_path, only_here):
    with pytest.raises(ConfigError, match=r"netconvert, .* pip install 'isethdr\[traffic\]'"):
        convert(mapped(tmp_path), tmp_path / "out.xodr")


def test_the_converter_of_a_wheel_without_scripts_is_found(tmp_path, only_here, monkeypatch):
    folder = tmp_path / "sumo" / "bin"
    folder.mkdir(parents=True)
    (tmp_path / "sumo" / "data").mkdir()
    tool(folder, "import os; sys.stderr.write('Error: ' + os.environ['SUMO_HOME']); sys.exit(1)")
    monkeypatch.setattr(openstreetmap, "of_wheel", lambda name: folder / name)
    with pytest.raises(CatalogError, match=f"ended with 1: Error: {folder.parent}$"):
        convert(mapped(tmp_path), tmp_path / "out.xodr")


def test_what_the_converter_says_is_the_error(tmp_path, only_here):
    tool(only_here, "sys.stderr.write('Error: no nodes.\\nQuitting\\n'); sys.exit(1)")
    with pytest.raises(CatalogError, match="netconvert ended with 1: Error: no nodes.$"):
        convert(mapped(tmp_path), tmp_path / "out.xodr")


def test_links_to_junctions_that_the_converter_left_out_are_removed(tmp_path, only_here):
    network = kind("country_straight", 1).network
    made = tmp_path / "made.xodr"
    write(RoadFile(network), made)
    dead = '<link><successor elementType="junction" elementId="9" /></link>'
    made.write_text(made.read_text().replace("<link />", dead, 1))
    with pytest.raises(CatalogError, match="junction 9"):
        read(made)
    tool(only_here, f"open(sys.argv[4], 'w').write(open({str(made)!r}).read())")
    out = tmp_path / "out.xodr"
    found = convert(mapped(tmp_path), out)
    assert len(found.network.roads) == len(read(out).network.roads) == 1
    assert found.network.roads[0].successor is None
