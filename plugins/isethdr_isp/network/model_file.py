"""Model file: opens an ONNX file and identifies its layout by its inputs and metadata."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Protocol

import xarray as xr

from isethdr_core.errors import ConfigError
from isethdr_core.onnx_session import open_session
from isethdr_core.pipeline.early_checks import ShotForm

from ..spectra import Illuminant
from .contract import KEY, Contract
from .contract_model import ContractModel
from .fields import NetworkFields
from .published import PublishedModel, is_published

FEATURE = "isp=network"


class PictureModel(Protocol):
    """A model that develops captures."""

    def check_form(self, form: ShotForm) -> None:
        """Raise ConfigError unless the model is made for the captures and filters of a sensor."""

    def picture(self, captures: xr.Dataset, how: NetworkFields, balance: Illuminant) -> xr.Dataset:
        """Return the picture of captures with a known black level.

        Parameters
        ----------
        captures : captures Dataset with a known black level.
        how : the fields of `isp=network`.
        balance : light; views show its white as white.
        """


def needs_model(model: str) -> Path:
    """Return the path of a model file.

    Raises
    ------
    ConfigError : no file is set.
    """
    if not model or "\0" in model:
        raise ConfigError(
            f"isp.model is {model!r}; expected an ONNX file (docs/how-to/network_isp.md); type"
            " isp.model=FILE.onnx"
        )
    return Path(model).expanduser()


def opened(model: str) -> PictureModel:
    """Return the model of a file. A file that has not changed is opened only once.

    Raises
    ------
    ConfigError : the file does not exist, is damaged, is no ONNX model, or has an unknown layout;
        or onnxruntime is not installed.
    """
    path = needs_model(model)
    state = path.stat() if path.is_file() else None
    changed = (state.st_mtime_ns, state.st_size) if state else (0, 0)
    return _opened(path, changed)


@lru_cache(maxsize=2)
def _opened(path: Path, changed: tuple[int, int]) -> PictureModel:
    """Return the model of a file. `changed`, its time and size, is part of the key of the cache."""
    session = open_session(path, FEATURE)
    if is_published(session):
        return PublishedModel(session)
    stated = session.metadata.get(KEY)
    if stated is None:
        names = ", ".join(port.name for port in session.inputs)
        raise ConfigError(
            f"{path} has the inputs {names} and no property {KEY!r}; expected a model of the"
            " contract, or one input of 3 or 4 planes and as many outputs"
            " (docs/how-to/network_isp.md); export the model with these properties"
        )
    return ContractModel(session, Contract.from_json(stated, str(path)))
