"""Empty home: a study's own folder for stores and kernels, with none at hand, in this process
neither.
"""

from __future__ import annotations

import os
import tempfile
from contextlib import contextmanager

from isethdr_optics.psf import kernels


@contextmanager
def empty_home():
    """Yield a new home folder; the one before is back afterwards, and the new one gone."""
    before = os.environ.get("ISETHDR_HOME")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["ISETHDR_HOME"] = folder
        kernels._cache.clear()
        try:
            yield folder
        finally:
            kernels._cache.clear()  # some are mapped from files that go with the folder
            os.environ.pop("ISETHDR_HOME")
            if before is not None:
                os.environ["ISETHDR_HOME"] = before
