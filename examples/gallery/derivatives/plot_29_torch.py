"""
Friction learnt with PyTorch
============================

The models are PyTorch modules. Here friction coefficients are learnt from measured
wrenches by gradient descent; the backward pass goes through every step of the rollout.
For PyTorch on the processor alone, `pip install torch --index-url
https://download.pytorch.org/whl/cpu`.
"""

import matplotlib.pyplot as plt
import torch

import planarfriction as pf
from planarfriction.torch import ReducedModel, rollout, tracking_loss

plt.style.use("planarfriction.plots.print")

torch.set_default_dtype(torch.float64)
patch = pf.ContactPatch.disc(0.01, cells=11)
truth = ReducedModel(
    patch, pf.LuGre(mu_c=0.8, mu_s=1.0, v_s=8e-3, sigma_0=1e5, sigma_1=30.0)
)
t = torch.linspace(0.0, 1.0, 400)
twists = torch.stack(
    [0.01 * torch.sin(12 * t), 0.005 * torch.cos(9 * t), 2.0 * torch.sin(7 * t)], -1
)
measured = rollout(truth, None, twists, 2.0, 1e-3).wrenches.detach()

# %%
# Gradient descent from half of the true values:
start = pf.LuGre(mu_c=0.4, mu_s=0.5, v_s=8e-3, sigma_0=1e5, sigma_1=30.0)
model = ReducedModel(patch, start, trainable=("mu_c", "mu_s"))
optimiser = torch.optim.Adam(model.parameters(), lr=0.05)
losses, guesses = [], []
for _ in range(100):
    optimiser.zero_grad()
    loss = tracking_loss(model, None, twists, 2.0, 1e-3, measured)
    loss.backward()
    optimiser.step()
    losses.append(loss.item())
    guesses.append((model.law().mu_c, model.law().mu_s))

# %%
# The loss falls, and both coefficients reach the truth (dotted):
figure, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.4), layout="constrained")
left.semilogy(losses)
left.set(xlabel="step", ylabel="mean squared error per load [-]")
right.plot(guesses, label=("mu_c", "mu_s"))
for value in (0.8, 1.0):
    right.axhline(value, color="k", linestyle=":", linewidth=0.8)
right.set(xlabel="step", ylabel="friction coefficient [-]")
right.legend()

# %%
# The law that was learnt:
print(model.law())
assert abs(model.law().mu_c - 0.8) < 0.02 and abs(model.law().mu_s - 1.0) < 0.05
