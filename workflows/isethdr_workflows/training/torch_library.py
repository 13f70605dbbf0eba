"""PyTorch, which only this module imports, because it is an optional, large and slow dependency.

Modules that need it are themselves imported only when a training begins.
"""

from __future__ import annotations

from isethdr_core.cli.terminal import number_of
from isethdr_core.errors import ConfigError
from isethdr_core.extras import needed

with needed("training a network", extra="train"):
    import onnx
    import onnxscript  # noqa: F401 - torch.onnx needs it, and names no extra
    import torch
    from torch import nn
    from torch.nn import functional

__all__ = ["device_name", "functional", "hardware", "nn", "onnx", "torch"]


def device_name(wanted: str = "auto") -> str:
    """Return the device that a training runs on, "cpu" or "cuda", and set it to full float32
    precision.

    Parameters
    ----------
    wanted : name of a device; "auto" takes a GPU if there is one.

    Raises
    ------
    ConfigError : a GPU is wanted, and PyTorch finds none.
    """
    device = wanted
    if wanted == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    if device.startswith("cuda") and not torch.cuda.is_available():
        raise ConfigError(
            f"device is {wanted}, but PyTorch finds no GPU; expected a GPU with its driver; type"
            " device=auto to use the CPU"
        )
    if device.startswith("cuda"):
        # otherwise convolutions of float32 would be computed with 10 bits of mantissa
        torch.backends.cudnn.allow_tf32 = False
        # sums of gradients always have the same order, so that a resumed training ends the same
        torch.backends.cudnn.deterministic = True
    return device


def hardware(device: str) -> str:
    """Return a description of the hardware of a training."""
    if device.startswith("cuda"):
        return f"one GPU, {torch.cuda.get_device_name(device)}"
    threads = number_of(torch.get_num_threads(), "thread")
    return f"CPU with {torch.backends.cpu.get_cpu_capability()}, {threads}"
