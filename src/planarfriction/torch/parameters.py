"""Physical parameters as trainable numbers without a scale, which cannot leave their valid range.

An optimiser moves a raw number `w`; the physical value follows from it:

    positive            p = p_0 exp(w), from w = 0         sigma_0, mu_c, v_s, gamma, contact_radius, second_moment
    zero or more        p = scale |w|                      sigma_1, sigma_2
    mu_s >= mu_c        mu_s = mu_c (1 + |w|)
    breakaway in [0, 1) s = 1 - exp(-|w|)
    free                p = p_0 + r w, from w = 0          centre_x, centre_y

A step of `w` is a relative change, so that one learning rate suits all. `|w|` has the slope 1 at 0, to leave the bound.

What is not trained stays as it is. So mu_c trained beside a fixed mu_s has `mu_s = mu_c (1 + |w|)` as its rule too, the
other way about: it cannot exceed mu_s, and a warning says when it is there (where values can be read).
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping

import torch
from torch import Tensor, nn

from planarfriction._support import validation
from planarfriction.derivatives.parameters import POSITIVE
from planarfriction.laws import ElastoPlastic, LuGre
from planarfriction.tensors.steps import LAW
from planarfriction.torch.namespace import xp

_GROWING = {*POSITIVE, "second_moment"} - {"mu_s"}
"""Parameters that are `p_0 exp(w)`; a mu_c below a fixed mu_s has a separate rule."""

_AT_MU_S = "mu_c has been trained up to mu_s, which is fixed and which it cannot exceed: name mu_s in trainable too"
_LARGEST_EXPONENT = 30.0
"""A positive value stays within a factor e^30 = 1e13 of where it started, so that none overflows or becomes zero."""


class PhysicalParameters(nn.Module):
    """Named physical values: those in `trainable` are `nn.Parameter`s in `raw`, the rest are fixed."""

    values: Tensor
    """The values as last set, `[P]`."""
    scale: Tensor
    """Physical size of a raw step of 1, where it has one, `[P]`."""

    def __init__(self, values: Mapping[str, float], trainable: Iterable[str], **kind):
        super().__init__()
        self.names = tuple(values)
        chosen = dict.fromkeys(
            validation.choice("trainable", name, self.names) for name in trainable
        )
        self.register_buffer("values", torch.zeros(len(self.names), **kind))
        self.register_buffer("scale", torch.ones(len(self.names), **kind))
        self.raw = nn.ParameterDict(
            {name: nn.Parameter(torch.zeros((), **kind)) for name in chosen}
        )
        self.set(values)

    @torch.no_grad()
    def set(self, values: Mapping[str, float]) -> None:
        """Set physical values by name; raises InvalidValueError for one out of its range."""
        for name in values:
            validation.choice("parameter", name, self.names)
        new = {
            **dict(zip(self.names, self._physical().tolist(), strict=True)),
            **values,
        }
        _check(new)
        for i, name in enumerate(self.names):
            scale, raw = _raw(name, new, fixed_static="mu_s" not in self.raw)
            self.values[i] = new[name]
            self.scale[i] = scale
            if name in self.raw:
                self.raw[name].fill_(raw)

    def forward(self) -> Tensor:
        """Return the physical values `[P]`, in the order of `names`."""
        if "mu_c" in self.raw and "mu_s" not in self.raw:
            seen = xp.extremes("mu_c", self.raw["mu_c"])
            if seen is not None and seen[0] <= 0.0:  # beyond 0 it goes down again
                warnings.warn(_AT_MU_S, stacklevel=4)
        return self._physical()

    def _physical(self) -> Tensor:
        return torch.stack(list(self._named().values())) if self.raw else self.values

    def _named(self) -> dict[str, Tensor]:
        """Return the physical values by name; trained ones follow from their raw numbers."""
        now = dict(zip(self.names, self.values.unbind(), strict=True))
        raws = dict(self.raw.items())
        # Mu_c comes before mu_s.
        for name, scale in zip(self.names, self.scale.unbind(), strict=True):
            if name not in raws:
                continue
            raw = raws[name]
            bounded = name == "mu_c" and "mu_s" not in raws  # below the fixed mu_s
            if name in _GROWING and not bounded:
                now[name] = now[name] * torch.exp(
                    raw.clamp(-_LARGEST_EXPONENT, _LARGEST_EXPONENT)
                )
                continue
            if name.startswith("centre"):
                now[name] = now[name] + scale * raw
                continue
            # |w|, with the slope 1 at 0.
            size = scale * nn.functional.leaky_relu(-raw, -1.0)
            if bounded:
                now[name] = now["mu_s"] / (1.0 + size)
            elif name == "mu_s":
                now[name] = now["mu_c"] * (1.0 + size)
            elif name == "breakaway_ratio":
                now[name] = (1.0 - torch.exp(-size)).clamp(
                    max=1.0 - 16.0 * torch.finfo(size.dtype).eps
                )
            else:
                now[name] = size
        return now


def _raw(
    name: str, values: Mapping[str, float], *, fixed_static: bool
) -> tuple[float, float]:
    """Return scale and raw number of a value; a value of zero takes a natural size as its scale."""
    value = values[name]
    mu_c = values["mu_c"]
    if name == "mu_s" or (name == "mu_c" and fixed_static):
        excess = (values["mu_s"] - mu_c) / mu_c
        return 1.0 + excess, excess / (1.0 + excess)
    if name in _GROWING:
        return 1.0, 0.0
    if name == "breakaway_ratio":
        return 1.0, -float(torch.log1p(torch.tensor(-value, dtype=torch.float64)))
    if name.startswith("centre"):
        return values["contact_radius"], 0.0
    # Of mu_c at the Stribeck speed, or at 1 m/s.
    natural = mu_c / values["v_s"] if name == "sigma_1" else mu_c
    return (value, 1.0) if value > 0.0 else (natural, 0.0)


def _check(values: Mapping[str, float]) -> None:
    """Raise for values that no law, or no patch, may have."""
    LuGre(**{name: values[name] for name in LAW[:-1]})
    ElastoPlastic(values["breakaway_ratio"])
    for name in values.keys() - set(LAW):
        (validation.number if name.startswith("centre") else validation.positive)(
            name, values[name]
        )
