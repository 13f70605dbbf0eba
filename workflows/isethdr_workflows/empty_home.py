"""Empty home: a temporary folder for stores and kernels, and an empty cache of kernels."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from isethdr_optics.psf import kernels


@contextmanager
def empty_home() -> Iterator[str]:
    """Yield a temporary home folder; afterwards restore the earlier one and remove the folder."""
    earlier_home = os.environ.get("ISETHDR_HOME")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ISETHDR_HOME"] = folder
        kernels.forget()
        try:
            yield folder
        finally:
            kernels.forget()  # some kernels are memory maps of files in the folder
            os.environ.pop("ISETHDR_HOME")
            if earlier_home is not None:
                os.environ["ISETHDR_HOME"] = earlier_home
