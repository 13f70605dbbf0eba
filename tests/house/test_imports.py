"""Which libraries physics may import, and what may not be imported before it is needed.

Who may import whom is checked by import-linter (`make lint`).
"""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib

from .source import PACKAGES, PRODUCT, ROOT, imports, name_of

STANDARD = set(sys.stdlib_module_names)
SLOW = (
    "xarray",
    "scipy",
    "colour",
    "mitsuba",
    "drjit",
    "zarr",
    "matplotlib",
    "skimage",
    "pandas",
    "duckdb",
    "numpy",
    "hydra",
    "omegaconf",
    "pydantic",
)


def roots(file, **options):
    return {name.split(".")[0] for name in imports(file, **options)}


def test_physics_imports_libraries_of_numbers_only():
    files = [f for f in PRODUCT if PACKAGES["isethdr_core"] / "physics" in f.parents]
    assert len(files) > 5
    wrong = []
    for file in files:
        wrong += [
            f"{name_of(file)} imports {name}"
            for name in (
                roots(file)
                - STANDARD
                - {"numpy", "scipy", "array_api_compat", "ducc0", "isethdr_core"}
            )
        ]
    assert not wrong, "\n".join(wrong)


def test_the_import_contracts_name_every_package():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    assert set(settings["root_packages"]) == set(PACKAGES)
    layers, core = (contract["layers"] for contract in settings["contracts"])
    assert {name for row in layers for name in row.split(" | ")} == set(PACKAGES)
    modules = {path.stem for path in PACKAGES["isethdr_core"].iterdir() if path.suffix == ".py"}
    modules |= {path.parent.name for path in PACKAGES["isethdr_core"].glob("*/__init__.py")}
    assert {name for row in core for name in row.split(" : ")} == modules - {"__init__"}


def test_what_a_plugin_author_imports_is_light():
    """`isethdr --help`, and every plugin's hooks, run without the libraries that take seconds to
    import.
    """
    code = (
        "import json, sys\nfrom isethdr_core.plugins.registry import components;"
        " components()\nsys.argv = ['isethdr', '--help']\nfrom isethdr_core.cli.commands import"
        " main\ntry:\n    main()\nexcept SystemExit as end:\n    print(json.dumps([end.code,"
        " sorted({m.split('.')[0] for m in sys.modules})]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    exit_code, modules = json.loads(done.stdout.splitlines()[-1])
    assert exit_code == 0
    assert not set(SLOW) & set(modules), (
        f"imported before they are needed: {sorted(set(SLOW) & set(modules))}"
    )


def test_the_layer_rule_sees_what_it_must():
    """The walk finds imports inside functions and relative ones, and leaves out those for
    annotations only.
    """
    from . import source

    file = source.PACKAGES["isethdr_core"] / "lighting" / "mix.py"
    assert {"isethdr_core.uncertainty.ledger", "isethdr_core.physics.photometry"} <= imports(file)
    store = source.PACKAGES["isethdr_core"] / "storage" / "store.py"
    assert "zarr" not in roots(store, top_level_only=True)
    assert "zarr" in roots(store)
