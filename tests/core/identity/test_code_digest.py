"""The digest of a component's code changes if and only if the code of its results changes."""

from __future__ import annotations

import importlib.machinery
import sys
from pathlib import Path

import pytest

from isethdr_core.identity import code_cache, code_digest, core_modules, library_versions
from isethdr_core.identity.code_cache import CodeCache
from isethdr_core.identity.code_digest import CodeReader, reader
from isethdr_core.identity.code_facts import facts_of
from isethdr_core.identity.core_modules import Rules
from isethdr_core.identity.package_sources import Sources
from isethdr_core.plugins.registry import components

PLUGIN = {
    "acme/__init__.py": '"""A plugin."""\nfrom .lens import Lens\n',
    "acme/lens.py": """
import numpy as np
from dataclasses import dataclass
from pathlib import Path

from house.errors import ConfigError
from house.laws import falloff

from . import tables
from .glass import index as refractive_index


@dataclass(frozen=True)
class Lens:
    '''A lens.'''

    f_number: float = 2.0

    def __call__(self, light):
        '''Return the light.'''
        from .coating import loss

        if tables.kind() == "thin":
            light = light * loss()
        if self.f_number < 0:
            reason = f"f_number is {self.f_number}"
            raise ConfigError(reason + "; expected more than 0")
        return falloff(light) * refractive_index() * np.pi
""",
    "acme/tables.py": """
from pathlib import Path

TABLE = Path(__file__).with_name("glass.csv")


def kind():
    return TABLE.read_text().partition(",")[0]
""",
    "acme/glass.csv": "thin,1.5\n",
    "acme/glass.py": "def index():\n    return 1.5\n",
    "acme/coating.py": "def loss():\n    return 0.9\n\n\ndef index():\n    return 1.5\n",
    "acme/unused.py": "def loss():\n    return 0.1\n",
    "acme/unused.csv": "1\n",
    "house/__init__.py": "",
    "house/errors.py": "class ConfigError(Exception):\n    pass\n",
    "house/laws.py": "from .frame import size\n\n\ndef falloff(light):\n    return light / 4\n",
    "house/frame.py": "from . import cli\n\n\ndef size():\n    return 3\n",
    "house/cli.py": "WIDTH = 80\n",
}
RULES = Rules("house", ("house.laws",), ("house.errors", "house.cli"))


def written(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def reading(folder: Path) -> CodeReader:
    return CodeReader(Sources([folder], CodeCache(None)), RULES)


def digest(folder: Path, module: str = "acme.lens", name: str = "Lens") -> str:
    return reading(folder).code(module, name).digest


@pytest.fixture
def changed(tmp_path):
    """Return a function that says whether an edit of the plugin changes the lens's digest."""

    def is_changed(name: str, old: str, new: str, module: str = "acme.lens") -> bool:
        before = digest(written(tmp_path / "before", PLUGIN))
        assert old in PLUGIN[name], f"{name} does not hold {old!r}"
        files = PLUGIN | {name: PLUGIN[name].replace(old, new)}
        return digest(written(tmp_path / "after", files), module) != before

    return is_changed


SAME = {
    "format": ("acme/lens.py", "light * loss()", "(light\n                *  loss( ))"),
    "comment": ("acme/lens.py", "import numpy", "# of arrays\nimport numpy"),
    "docstring": ("acme/lens.py", "'''Return the light.'''", "'''Return what is left of it.'''"),
    "alias": ("acme/lens.py", "import numpy as np\n", "import numpy as np, numpy as other\n"),
    "relative import": ("acme/lens.py", "from . import tables", "import acme.tables as tables"),
    "message": ("acme/lens.py", "; expected more than 0", "; it must be positive"),
    "message in a variable": ("acme/lens.py", "f_number is {", "the f-number {"),
    "annotation": ("acme/lens.py", "def __call__(self, light)", "def __call__(self, light: int)"),
    "module that nothing reaches": ("acme/unused.py", "0.1", "0.2"),
    "data that nothing reaches": ("acme/unused.csv", "1", "2"),
    "frame": ("house/frame.py", "3", "4"),
    "public names": ("acme/glass.py", "def index", "__all__ = ['index']\n\n\ndef index"),
}
OTHER = {
    "number": ("acme/glass.py", "1.5", "1.6"),
    "module imported in a function": ("acme/coating.py", "0.9", "0.8"),
    "data": ("acme/glass.csv", "1.5", "1.6"),
    "law of the core": ("house/laws.py", "/ 4", "/ 5"),
    "string that decides": ("acme/lens.py", '"thin"', '"thick"'),
    "name of data": ("acme/tables.py", "glass.csv", "unused.csv"),
    "default": ("acme/lens.py", "= 2.0", "= 2.5"),
    "type of a field": ("acme/lens.py", "f_number: float", "f_number: int"),
    "same name from elsewhere": (
        "acme/lens.py",
        "from .glass import index",
        "from .coating import index",
    ),
    "type of error": ("acme/lens.py", "raise ConfigError", "raise ValueError"),
    "whether an error is raised": ("acme/lens.py", "self.f_number < 0", "self.f_number < 1"),
}


@pytest.mark.parametrize("edit", SAME)
def test_what_changes_no_result_keeps_the_digest(changed, edit):
    assert not changed(*SAME[edit])


@pytest.mark.parametrize("edit", OTHER)
def test_what_may_change_a_result_changes_the_digest(changed, edit):
    assert changed(*OTHER[edit])


def test_moved_and_renamed_modules_keep_the_digest(tmp_path):
    moved = {
        "acme/__init__.py": PLUGIN["acme/__init__.py"].replace(".lens", ".lenses"),
        "acme/lenses/__init__.py": "from .thin import Lens as Lens\n",
        "acme/lenses/thin.py": PLUGIN["acme/lens.py"]
        .replace("from . import tables\n", "")
        .replace("from .glass import index as", "from ..materials.glasses import index as")
        .replace("        from .coating import loss\n", "")
        .replace("import numpy as np\n", "import numpy\nfrom ..surfaces import coating\n")
        .replace("loss()", "coating.loss()")
        .replace("np.pi", "numpy.pi")
        .replace("from house.laws", "from acme.materials import data as tables\nfrom house"),
        "acme/materials/__init__.py": "",
        "acme/materials/data.py": PLUGIN["acme/tables.py"],
        "acme/materials/glass.csv": PLUGIN["acme/glass.csv"],
        "acme/materials/glasses.py": PLUGIN["acme/glass.py"],
        "acme/surfaces/__init__.py": '"""Surfaces."""\n\n__all__ = ["coating"]\n',
        "acme/surfaces/coating.py": PLUGIN["acme/coating.py"],
        "house/__init__.py": "from .laws import falloff\n",
        "house/errors.py": PLUGIN["house/errors.py"],
        "house/laws.py": "from .physics.light import falloff\n",
        "house/physics/light.py": PLUGIN["house/laws.py"].replace(".frame", "..parts"),
        "house/parts.py": PLUGIN["house/frame.py"],
        "house/cli.py": PLUGIN["house/cli.py"],
    }
    before = digest(written(tmp_path / "before", PLUGIN))
    rules = Rules("house", ("house.physics", "house.laws"), ("house.errors", "house.cli"))
    sources = Sources([written(tmp_path / "after", moved)], CodeCache(None))
    after = CodeReader(sources, rules)
    assert after.code("acme.lenses.thin", "Lens").digest == before


def test_a_number_in_a_table_renames_all_that_read_it_and_nothing_else(tmp_path):
    files = PLUGIN | {"acme/other.py": "from .glass import index\n\n\nclass Other:\n    pass\n"}
    files |= {"acme/second.py": "from .tables import kind\n\n\nclass Second:\n    n = kind\n"}
    edited = files | {"acme/glass.csv": "thin,1.7\n"}
    before = written(tmp_path / "before", files)
    after = written(tmp_path / "after", edited)
    for module, name, differs in (
        ("lens", "Lens", 1),
        ("second", "Second", 1),
        ("other", "Other", 0),
    ):
        pair = [digest(folder, f"acme.{module}", name) for folder in (before, after)]
        assert (pair[0] != pair[1]) == bool(differs), module


@pytest.mark.parametrize(
    "how",
    [
        'Path(__file__).parent / "tables" / f"{name}.txt"',
        'Path(__file__).parent.joinpath(*("tables", name))',
        'files(__package__) / f"{name}.txt"',
        'sorted(Path(__file__).parent.rglob("*.txt"))[0]',
        'Path(__file__).parents[1] / "tables/crown.txt"',
        'str(Path(__file__).parent) + "/tables/crown.txt"',
        'sorted(Path(__file__).parent.rglob("cr*n.txt"))[0]',
        'sorted(Path(__file__).parent.rglob("cr[n-p]w?.txt"))[0]',
        'Path(__file__).parents[1] / "acme" / "{}.txt".format(name)',
        'Path(__file__).parents[1] / "acme" / ("%s.txt" % name)',
        'Path(__file__).parents[1] / "acme" / (name + "_v2.txt")',
        'Path(__file__).parents[1] / "acme" / (name + "wn.txt")',
        'Path(__file__).parents[1] / "acme" / ".".join([name, "txt"])',
        'files("acme.tables") / name',
    ],
)
@pytest.mark.parametrize("importable", [False, True])
def test_data_named_by_folder_or_pattern_counts(tmp_path, how, importable):
    files = {
        "acme/__init__.py": "",
        "acme/lens.py": f"from importlib.resources import files\nfrom pathlib import Path\n\n\n"
        f"class Lens:\n    def path(self, name):\n        return {how}\n",
        "acme/tables/crown.txt": "1.5",
        "acme/conf/lens/preset.txt": "f_number: 2",
    }
    files |= {"acme/tables/__init__.py": ""} if importable else {}
    before = digest(written(tmp_path / "before", files))
    assert digest(written(tmp_path / "data", files | {"acme/tables/crown.txt": "1.6"})) != before
    preset = files | {"acme/conf/lens/preset.txt": "f_number: 3"}
    assert digest(written(tmp_path / "preset", preset)) == before  # the config holds its values


def test_the_place_of_a_package_does_not_count(tmp_path):
    files = {
        "acme/__init__.py": "",
        "acme/lens.py": "class Lens:\n    kind = '.'.join(['crown', 'txt'])\n",
        "acme/tables/crown.txt": "1.5",
    }
    both = [digest(written(tmp_path / place, files)) for place in ("plugins", "txt")]
    assert both[0] == both[1]


@pytest.mark.parametrize("code", ["acme/lenses/glass.py", "acme/lenses/thin/glass.py"])
def test_the_name_of_a_folder_of_code_counts_no_data(tmp_path, code):
    files = {
        "acme/__init__.py": "",
        "acme/lens.py": "class Lens:\n    kind = 'lenses'\n",
        "acme/lenses/__init__.py": "",
        "acme/lenses/crown.txt": "1.5",
        code: "",
    }
    before = digest(written(tmp_path / "before", files))
    edited = files | {"acme/lenses/crown.txt": "1.6"}
    assert digest(written(tmp_path / "after", edited)) == before


def test_a_data_file_counts_whatever_characters_its_name_has(tmp_path):
    lens = """
from pathlib import Path

UNIT = "1 (relative)"


class Lens:
    def path(self):
        return Path(__file__).with_name("crown glass (n=1.5).csv")
"""
    files = {"acme/__init__.py": "", "acme/lens.py": lens, "acme/crown glass (n=1.5).csv": "1.5"}
    before = digest(written(tmp_path / "before", files))
    edited = files | {"acme/crown glass (n=1.5).csv": "1.6"}
    assert digest(written(tmp_path / "after", edited)) != before
    other = files | {"acme/flint glass (n=1.7).csv": "1.7"}
    assert digest(written(tmp_path / "other", other)) == before


def test_a_compiled_module_counts_by_its_bytes(tmp_path):
    compiled = f"acme/fast{importlib.machinery.EXTENSION_SUFFIXES[0]}"
    files = {
        "acme/__init__.py": "",
        "acme/lens.py": "from .fast import trace\n\n\nclass Lens:\n    trace = trace\n",
        compiled: "machine code",
        "acme/lonely.so": "other machine code",
    }
    before = digest(written(tmp_path / "before", files))
    assert digest(written(tmp_path / "after", files | {compiled: "other"})) != before


@pytest.mark.parametrize(
    ("line", "counts"),
    [
        ("importlib.import_module(name)", True),
        ("__import__(name)", True),
        ("exec(name)", True),
        ('importlib.import_module(".glass", __package__)', False),
        ('importlib.import_module("numpy")', False),
    ],
)
def test_an_import_that_its_text_does_not_tell_counts_the_whole_package(tmp_path, line, counts):
    files = PLUGIN | {"acme/glass.py": f"import importlib\n\n\ndef index(name=''):\n    {line}\n"}
    edits = {"acme/unused.py": "def loss():\n    return 0.3\n", "acme/unused.csv": "7"}
    before = digest(written(tmp_path / "before", files))
    for name, text in edits.items():
        edited = written(tmp_path / name.rpartition(".")[2], files | {name: text})
        assert (digest(edited) != before) is counts


def test_a_module_imported_by_its_name_in_plain_text_counts(tmp_path):
    line = 'importlib.import_module(".unused", __package__)'
    files = PLUGIN | {"acme/glass.py": f"import importlib\n\n\ndef index():\n    {line}\n"}
    before = digest(written(tmp_path / "before", files))
    edited = files | {"acme/unused.py": "def loss():\n    return 0.3\n"}
    assert digest(written(tmp_path / "after", edited)) != before


@pytest.mark.parametrize(
    "use",
    [
        "hdr.build('lens', 'ideal')",
        pytest.param("build('lens', 'ideal', f_number=2)", marks=pytest.mark.slow),
    ],
)
def test_a_component_that_is_built_by_name_counts(tmp_path, use):
    text = "import isethdr_core as hdr\nfrom isethdr_core.plugins.registry import build\n\n\n"
    text += f"class Lens:\n    def inner(self):\n        return {use}\n"
    written(tmp_path, {"acme/__init__.py": "", "acme/lens.py": text})
    sources = Sources([tmp_path, *map(Path, sys.path)], CodeCache(None))
    inner = components()["lens", "ideal"].cls.__module__
    assert inner in CodeReader(sources).code("acme.lens", "Lens").modules


def test_a_name_that_a_package_looks_up_itself_is_found_in_its_table(tmp_path):
    lazy = (
        '_NAMES = {"index": "glass"}\n\n\ndef __getattr__(name):\n    return load(_NAMES[name])\n'
    )
    use = "from acme import index\n\n\nclass Lens:\n    index = index\n"
    files = PLUGIN | {"acme/__init__.py": lazy, "acme/lens.py": use}
    before = digest(written(tmp_path / "before", files))
    edited = files | {"acme/glass.py": "def index():\n    return 2\n"}
    assert digest(written(tmp_path / "after", edited)) != before
    unrelated = files | {"acme/unused.py": "def loss():\n    return 2\n"}
    assert digest(written(tmp_path / "unrelated", unrelated)) == before


def test_a_package_may_import_its_own_modules_and_be_asked_for_them(tmp_path):
    use = "import acme\n\n\nclass Lens:\n    index = acme.glass.index\n"
    files = PLUGIN | {"acme/__init__.py": "from . import glass\n", "acme/lens.py": use}
    before = digest(written(tmp_path / "before", files))
    edited = files | {"acme/glass.py": "def index():\n    return 2\n"}
    assert digest(written(tmp_path / "after", edited)) != before


def test_a_package_that_does_something_when_imported_counts(tmp_path):
    files = PLUGIN | {"acme/__init__.py": "import numpy\n\nnumpy.seterr(all='raise')\n"}
    assert digest(written(tmp_path / "a", files)) != digest(written(tmp_path / "b", PLUGIN))


def test_libraries_are_those_that_the_reached_modules_import(tmp_path):
    files = PLUGIN | {"acme/unused.py": "import scipy\n", "acme/coating.py": "import not_there\n"}
    found = reading(written(tmp_path, files)).code("acme.lens", "Lens").libraries
    assert set(found) == {"numpy", "not_there"} and found["not_there"] == library_versions.ABSENT


TEXTS = """
import logging
import warnings

from house import ledger
from house.ledger import ErrorTerm, left_out

log = logging.getLogger(__name__)


def work(mode, n):
    log.info("working on %s", mode)
    logging.debug(f"{n} rows")
    warnings.warn("slow", RuntimeWarning)
    print("done")
    ledger.error(0.1, "relative", "bound", "label of a row")
    left_out("wings", "below the noise", 0.0, "relative")
    term = ErrorTerm("lens/x", "irradiance", None, 1.0, "e", "bound", label="what it is")
    err = ValueError("bad " + mode + " value")
    err.add_note(f"in {mode}")
    if mode == "quick":
        raise KeyError("no such mode")
    assert n > 0, "rows"
    return TABLE["quick"], term
"""


@pytest.mark.parametrize(
    "text",
    [
        "working on %s",
        " rows",
        '"slow"',
        '"done"',
        "label of a row",
        '"wings"',
        "below the noise",
        "what it is",
        "bad ",
        "in {",
        "no such mode",
        '"rows"',
    ],
)
def test_texts_for_people_do_not_enter(text):
    assert text in TEXTS
    reworded = text.replace('"', "").strip()
    edited = TEXTS.replace(text, text.replace(reworded, f"other words for {reworded}"))
    assert edited != TEXTS and facts_of(edited.encode()).tree == facts_of(TEXTS.encode()).tree


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('0.1, "relative"', '0.1, "electrons"'),
        ('"bound", "label', '"measured", "label'),
        ('"lens/x"', '"lens/y"'),
        ('"irradiance"', '"electrons"'),
        ('== "quick"', '== "slow"'),
        ('["quick"]', '["slow"]'),
        ("RuntimeWarning", "UserWarning"),
    ],
)
def test_strings_that_decide_enter(old, new):
    assert old in TEXTS
    before = facts_of(TEXTS.encode())
    after = facts_of(TEXTS.replace(old, new).encode())
    assert (before.tree, before.strings) != (after.tree, after.strings)


def test_a_local_name_is_not_taken_for_an_import_of_the_same_name():
    source = "from .a import noise\n\n\ndef f({}):\n    return noise\n"
    own = facts_of(source.format("noise").encode())
    imported = facts_of(source.format("").encode())
    assert not own.references and len(imported.references) == 1


def test_a_name_bound_by_an_import_or_otherwise_keeps_both():
    source = b"try:\n    import fast\nexcept ImportError:\n    fast = None\n\nx = fast\n"
    assert facts_of(source).references[0].module == "fast"


def test_a_file_that_python_cannot_read_counts_by_its_bytes():
    assert facts_of(b"def f(:").dynamic and facts_of(b"def f(:").tree != facts_of(b"def g(:").tree


@pytest.mark.parametrize("key", sorted(components()), ids="/".join)
def test_every_component_has_a_digest_that_says_what_it_read(key):
    code = code_digest.code_of_class(components()[key].cls)
    assert code.has_source and len(code.digest) == 16 and code.modules
    plugin = {name.partition(".")[0] for name in code.modules} - {"isethdr_core"}
    assert len(plugin) <= 1, "a plugin imports no other plugin"


def test_a_class_without_source_has_a_digest_of_this_process_alone():
    scope: dict = {"__name__": "nowhere"}
    exec("class A: pass\nclass B: pass", scope)  # noqa: S102 - as typed at a prompt
    codes = [code_digest.code_of_class(scope[name]) for name in "AB"]
    assert not any(code.has_source for code in codes) and codes[0] != codes[1]


def test_the_lists_of_modules_of_the_core_name_modules_that_exist():
    names = [*core_modules.FOLLOWED, *core_modules.WITHOUT_RESULT]
    assert [name for name in names if reader().sources.locate(name) is None] == []


def test_what_components_compute_with_imports_nothing_unknown_but_array_libraries():
    sources = reader().sources
    unknown = [
        name
        for name in sources.all_modules("isethdr_core")
        if name.startswith(tuple(f"{above}." for above in core_modules.FOLLOWED))
        and sources.cache.facts(sources.locate(name).path).dynamic
    ]
    assert unknown == ["isethdr_core.physics.arrays"]  # users choose it; only rounding differs


def test_the_second_spelling_of_the_core_is_the_core(tmp_path):
    text = "import {0} as hdr\nfrom {0} import Score\n\n\nclass Lens:\n    s = Score, hdr.Score\n"
    digests = set()
    for spelling in ("isethdr", "isethdr_core"):
        folder = tmp_path / spelling
        written(folder, {"acme/__init__.py": "", "acme/lens.py": text.format(spelling)})
        code = CodeReader(Sources([folder, *map(Path, sys.path)], CodeCache(None)))
        found = code.code("acme.lens", "Lens")
        assert "isethdr_core.data.scores" in found.modules
        digests.add(found.digest)
    assert len(digests) == 1


@pytest.mark.slow
def test_a_second_process_parses_nothing(tmp_path, monkeypatch):
    cls = components()["lens", "wavefront"].cls
    first = CodeReader(Sources(cache=CodeCache(tmp_path)))
    want = first.code(cls.__module__, cls.__qualname__), first.frame()
    first.sources.cache.save()
    monkeypatch.setattr(code_cache, "facts_of", lambda source: pytest.fail("parsed again"))
    again = CodeReader(Sources(cache=CodeCache(tmp_path)))
    assert (again.code(cls.__module__, cls.__qualname__), again.frame()) == want


def test_what_is_kept_is_made_again_when_a_file_changes_or_is_added(tmp_path):
    folder = written(tmp_path / "plugin", PLUGIN)

    def found():
        read = CodeReader(Sources([folder], CodeCache(tmp_path / "cache")), RULES)
        code = read.code("acme.lens", "Lens")
        read.sources.cache.save()
        return code.digest

    first = found()
    assert found() == first
    (folder / "acme/glass.py").write_text("def index():\n    return 1.75\n")
    second = found()
    (folder / "acme/more").mkdir()
    (folder / "acme/more/glass.csv").write_text("thin,1.9\n")  # the name may now mean this file
    assert len({first, second, found()}) == 3


def test_a_damaged_cache_is_no_obstacle(tmp_path):
    for content in ("", "[]", "{"):
        for name in ("code_facts", "code_digests"):
            for path in tmp_path.glob(f"{name}*"):
                path.write_text(content)
        read = CodeReader(Sources([written(tmp_path / "p", PLUGIN)], CodeCache(tmp_path)), RULES)
        assert read.code("acme.lens", "Lens").digest
        read.sources.cache.save()
