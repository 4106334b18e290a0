"""
Online friction estimation during a grasp
=========================================

A gripper holds a part whose friction is known within a factor of 3. It lowers its grip
until the part slips by some tenths of a millimetre; from force, torque and slip
velocity an observer finds the friction, and the grip follows: through a tap after 2 s,
and a tilt of the hand that ends with the part below the grip.
"""

from planarfriction_studies.rig.demo import record_hold
from planarfriction_studies.rig.pictures import plot_grip

record = record_hold()
figure = plot_grip(record)

# %%
# Shaded: a slip. The cross is where the part was gripped at first.
# ``planarfriction_studies.rig.demo`` films it.
estimate, low, high = record.mu_c[-1]
truth = record.parts.mu_c[0]
print(f"mu_c {truth}: found {estimate:.3f}, within {low:.3f} to {high:.3f}")
assert low < truth < high
assert abs(estimate / truth - 1.0) < 0.05
