"""
Information about parameters over time, with JAX
================================================

In JAX the models are pytrees and rollouts are functions like any other. Forward
derivatives of a whole rollout say when each parameter of the law shows in the torque of
a disc that is spun up from rest.
"""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
import planarfriction.jax as pj

plt.style.use("planarfriction.plots.print")

jax.config.update("jax_enable_x64", True)
model = pj.ReducedModel(
    pf.ContactPatch.disc(0.01),
    pf.LuGre(mu_c=0.6, mu_s=0.8, sigma_0=1e5, elasto_plastic=0.9),
)
dt, steps = 2e-5, 1000
twists = jnp.tile(jnp.array([0.0, 0.0, 0.1]), (steps, 1))


# %%
# The torque as a function of the parameters, and its forward derivative in the
# direction of one of them:
def torque(parameters):
    """Torque at 1 N over time [T]."""
    path = pj.rollout(model, None, twists, 1.0, dt, parameters=parameters)
    return -path.wrenches[:, 2]


def change(name):
    """The change of the torque over time with 1 % more of a parameter [T]."""
    zero = jax.tree.map(jnp.zeros_like, model.parameters)
    tangent = zero._replace(**{name: 0.01 * getattr(model.parameters, name)})
    return jax.jvp(torque, (model.parameters,), (tangent,))[1]


# %%
# The torque of the spin, and what 1 % more of each parameter changes in it:
time = 1e3 * dt * np.arange(1, steps + 1)
figure, (upper, lower) = plt.subplots(
    2, 1, figsize=(6.4, 4.8), layout="constrained", sharex=True
)
upper.plot(time, 1e3 * torque(model.parameters))
upper.set(ylabel="torque [N mm]")
for name in ("sigma_0", "sigma_1", "mu_s", "mu_c"):
    lower.plot(time, 1e6 * change(name), label=name)
lower.set(xlabel="time [ms]", ylabel="change with 1 % more [µN m]")
lower.legend()

# %%
# The same for the static coefficient by a difference:
more = torque(model.parameters._replace(mu_s=model.parameters.mu_s * 1.0001))
difference = 100.0 * (more - torque(model.parameters))
print(
    f"{1e6 * float(difference[-1]):.4f} and {1e6 * float(change('mu_s')[-1]):.4f} µN m"
)
assert abs(difference - change("mu_s"))[-1] < 1e-3 * abs(difference[-1])
