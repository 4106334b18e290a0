"""The array namespace of PyTorch."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import torch
from torch import Tensor

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.tensors.namespace import Namespace


class TorchNamespace(Namespace):
    """Operations on tensors; values are read on the processor, outside of `torch.compile` and `vmap`."""

    def broadcast_arrays(self, *arrays: Any) -> Any:
        """Return the tensors with one common shape."""
        return torch.broadcast_tensors(*arrays)

    def stop_gradient(self, x: Tensor) -> Tensor:
        """Return the value as a constant for differentiation."""
        return x.detach()

    def integers(self, x: Tensor) -> Tensor:
        """Return the numbers rounded towards zero."""
        return x.long()

    def real(self, name: str, value: Any, like: Tensor | None = None) -> Tensor:
        """Return `value` as a tensor of real numbers; a tensor keeps its precision and its device."""
        dtype, device = (torch.float64, None) if like is None else (like.dtype, like.device)
        if isinstance(value, Tensor):
            if value.is_floating_point():
                return value
            if value.is_complex() or value.dtype == torch.bool:
                raise InvalidValueError(name, "be a tensor of real numbers", f"one of {value.dtype}")
            return value.to(dtype)
        plain = value if type(value) is float else validation.numbers(name, value)
        if isinstance(plain, np.ndarray) and min(plain.strides, default=0) < 0:  # which tensors do not support
            plain = plain.copy()
        return torch.as_tensor(plain, dtype=dtype, device=device)

    def extremes(self, name: str, value: Tensor) -> tuple[float, float] | None:
        """Return the smallest and the largest number, or None if there is none to read without waiting."""
        if torch.compiler.is_compiling() or value.device.type != "cpu" or not value.numel():
            return None
        try:
            low, high = (each.item() for each in torch.aminmax(value.detach()))
        except RuntimeError:  # inside vmap
            return None
        validation.within_range(name, low, high)
        return low, high

    def to_numpy(self, value: Any) -> Any:
        """Return a tensor as a NumPy array, anything else unchanged."""
        return value.detach().cpu().numpy() if isinstance(value, Tensor) else value

    def from_numpy(self, array: np.ndarray, like: Tensor) -> Tensor:
        """Return a copy of a NumPy array, with the number type and the device of `like`."""
        return torch.tensor(array, dtype=like.dtype, device=like.device)

    def widened(self, x: Tensor) -> Tensor:
        """Return the numbers of a step in double precision, and with them all that follows, if the device has it.

        In steady sliding the rate of a bristle is the difference of two large numbers; sigma_1 times its rounding in
        single precision would be 1e-4 of the load at 1 m/s.
        """
        return x if x.device.type == "mps" else x.double()

    def narrowed(self, result: Tensor, *inputs: Tensor) -> Tensor:
        """Return the result of a step in the precision of its inputs."""
        return result.to(functools.reduce(torch.promote_types, (each.dtype for each in inputs)))


xp = TorchNamespace(torch)
