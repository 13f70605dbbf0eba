"""PyTorch, imported in this place alone: it is an extra, large, and slow to import.

A module that needs it is itself imported only when a training begins.
"""

from __future__ import annotations

from isethdr_core.cli.terminal import number_of
from isethdr_core.extras import needed

with needed("training a network", extra="train"):
    import onnx
    import onnxscript  # noqa: F401 - torch.onnx needs it, and names no extra
    import torch
    from torch import nn
    from torch.nn import functional

__all__ = ["device_name", "functional", "hardware", "nn", "onnx", "torch"]


def device_name(wanted: str = "auto") -> str:
    """Return the device that a training runs on: "cpu" or "cuda", where float32 is float32.

    Parameters
    ----------
    wanted : "auto" takes a GPU where there is one.
    """
    device = wanted
    if wanted == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    if device.startswith("cuda"):
        # convolutions of float32 would be computed with 10 bits of mantissa
        torch.backends.cudnn.allow_tf32 = False
        # sums of gradients in the same order each time: a training that is resumed ends alike
        torch.backends.cudnn.deterministic = True
    return device


def hardware(device: str) -> str:
    """Return the hardware of a training in words."""
    if device.startswith("cuda"):
        return f"one GPU, {torch.cuda.get_device_name(device)}"
    threads = number_of(torch.get_num_threads(), "thread")
    return f"CPU with {torch.backends.cpu.get_cpu_capability()}, {threads}"
