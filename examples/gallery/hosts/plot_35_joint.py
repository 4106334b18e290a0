"""
Friction of a motor from its torque
===================================

A motor turns to and fro against Coulomb and viscous friction, and its torque is
measured with noise. The spread of the estimates comes from leaving out a quarter of the
log at a time.
"""

import numpy as np

from planarfriction.joints import JointLog, Plant, identify_joint

t = 2e-3 * np.arange(3000)
q = np.sin(3.0 * t) + 0.2 * np.sin(11.0 * t)
ideal = JointLog(t, q, torque=np.zeros(len(t)))
friction = 0.05 * np.tanh(ideal.speed / 1e-3) + 0.02 * ideal.speed
noise = np.random.default_rng(0).normal(0.0, 1e-3, len(t))
log = JointLog(
    t, q, torque=0.01 * ideal.acceleration + friction + noise, name="to and fro"
)

# %%
# Terms beside Coulomb and viscous friction are not asked for (`terms=()`).
fit = identify_joint(log, Plant(inertia=0.01), terms=())
print(fit.table())
figure = fit.plot()

# %%
# Both numbers come back within 1 %.
assert abs(fit.friction.mu_c / 0.05 - 1.0) < 0.01
assert abs(fit.friction.sigma_2 / 0.02 - 1.0) < 0.01
