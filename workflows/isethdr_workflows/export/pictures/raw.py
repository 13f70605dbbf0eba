"""Raw captures as DNG 1.4, one file for each capture of a camera."""

from __future__ import annotations

from isethdr_isp.raw_file import write_dng

from isethdr_core.errors import UnitError

from ..job import Job


def check(job: Job) -> None:
    """Accept all pictures, because every stored run has captures. Whether a DNG can hold them
    depends on their values, which are read later.
    """


def write(job: Job) -> None:
    """Write all captures.

    Raises
    ------
    UnitError : a DNG cannot hold a capture, for example one with six kinds of filters.
    """
    for item in job.each():
        captures = item.captures()
        for capture in map(str, captures["capture"].values):
            path = job.new_file(f"dng/{item.name}_{capture}.dng", "image/x-adobe-dng", item)
            try:
                write_dng(captures, path, capture)
            except UnitError as error:
                raise UnitError(f"run {item.key}, camera {item.camera}: {error}") from error
