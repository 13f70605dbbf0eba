"""Where Hydra meets a run: single runs, sweeps (`-m`) and launchers."""

from __future__ import annotations

import sys

from .composition import CONFIG_MODULE, compose, register_with_hydra, with_choices


def run_with_hydra(arguments: list[str]) -> None:
    """Run once, or sweep with `-m`; Hydra reads the arguments as if they were the command line."""
    import hydra

    register_with_hydra()
    if not any(a.startswith("-") for a in arguments):
        compose(arguments)      # a mistake in a single run gets our own message, with the nearest valid name
    sys.argv = ["isethdr run", *arguments]
    hydra.main(version_base="1.3", config_path=f"pkg://{CONFIG_MODULE}", config_name="config")(task)()


def task(config) -> None:
    """Compute one run of a composed config and print its summary; a user's mistake is one line.

    In a sweep the line is Hydra's to print, with the overrides of the job, after the other jobs have run.
    """
    from hydra.core.hydra_config import HydraConfig
    from hydra.errors import CompactHydraException
    from hydra.types import RunMode

    from .errors import IsetHdrError
    from .runs import run
    from .summary import print_result

    hydra_config = HydraConfig.get()
    try:
        print_result(run(with_choices(config.copy(), hydra_config.runtime.choices)))
    except IsetHdrError as err:
        if hydra_config.mode == RunMode.MULTIRUN:
            raise CompactHydraException(str(err)) from None
        print(f"error: {err}", file=sys.stderr)
        sys.exit(2)
