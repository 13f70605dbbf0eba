"""Where Hydra meets a run: single runs, sweeps (`-m`) and launchers."""

from __future__ import annotations

import sys

from .compose import CONFIG_MODULE, register_with_hydra


def run_with_hydra(arguments: list[str]) -> None:
    """Run once, or sweep with `-m`; Hydra reads the arguments as if they were the command line."""
    import hydra

    register_with_hydra()
    sys.argv = ["isethdr run", *arguments]
    hydra.main(version_base="1.3", config_path=f"pkg://{CONFIG_MODULE}", config_name="config")(task)()


def task(config) -> None:
    """Compute one run of a composed config and print its summary; a user's mistake is one line."""
    from hydra.errors import CompactHydraException

    from .errors import IsetHdrError
    from .runs import run
    from .summary import print_result

    try:
        print_result(run(config))
    except IsetHdrError as err:
        raise CompactHydraException(str(err)) from None
