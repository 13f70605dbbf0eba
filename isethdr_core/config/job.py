"""One job: the run of a composed config, and its summary for people."""

from __future__ import annotations

from omegaconf import DictConfig

from ..cli.summary_tables import print_result
from ..runs.run import run


def run_and_print(config: DictConfig) -> None:
    """Compute one run of a composed config and print its summary."""
    print_result(run(config))
