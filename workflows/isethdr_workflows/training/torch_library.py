"""PyTorch, imported in this place alone: it is an extra, large, and slow to import.

A module that needs it is itself imported only when a training begins.
"""

from __future__ import annotations

from isethdr_core.extras import needed

with needed("training a network", extra="train"):
    import onnx
    import onnxscript  # noqa: F401 - torch.onnx needs it, and names no extra
    import torch
    from torch import nn
    from torch.nn import functional

__all__ = ["device_name", "functional", "hardware", "nn", "onnx", "torch"]


def device_name(wanted: str = "auto") -> str:
    """Return the device that a training runs on: "cpu" or "cuda".

    Parameters
    ----------
    wanted : "auto" takes a GPU where there is one.
    """
    if wanted != "auto":
        return wanted
    return "cuda" if torch.cuda.is_available() else "cpu"


def hardware(device: str) -> str:
    """Return the hardware of a training in words."""
    if device.startswith("cuda"):
        return f"one GPU, {torch.cuda.get_device_name(device)}"
    threads = torch.get_num_threads()
    return f"CPU with {torch.backends.cpu.get_cpu_capability()}, {threads} threads"
