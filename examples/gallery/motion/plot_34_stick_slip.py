"""
Classics: stick-slip of a mass on a spring
==========================================

A mass is pulled over a table by a spring whose end moves at a constant speed. It sticks
until the spring overcomes static friction, slips, and is caught again: the classic of
every lecture on friction, with the numbers of the LuGre paper.
"""

import matplotlib.pyplot as plt

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

law = pf.LuGre(mu_c=1.0, mu_s=1.5, v_s=1e-3, sigma_0=1e5, sigma_1=1e5**0.5, sigma_2=0.4)
model = pf.DistributedModel(pf.ContactPatch.points([[0.0, 0.0]]), law)
table = pf.Contact(model, 1.0, mounted_on="body")
# The end of the spring moves at 0.1 m/s along x.
end = pf.Signal([0.0, 30.0], [[0.0, 0.0], [3.0, 0.0]], "linear")
body = pf.Body(1.0, 1.0, gravity=(0.0, 0.0))
scene = pf.Scene(
    body, table, t_end=30.0, springs=pf.Spring(2.0, anchor=end), rtol=1e-7, atol=1e-6
)

# %%
# Half a minute of it:
data = pf.simulate(scene).data
figure, (place, force) = plt.subplots(
    2, 1, sharex=True, figsize=(6.0, 4.4), layout="constrained"
)
place.plot(data.time, data.x, label="mass")
place.plot(data.time, end(data.time.values)[:, 0], "k:", label="end of the spring")
place.set(ylabel="displacement [m]")
place.legend()
force.plot(data.time, -data.fx[:, 0])
force.set(xlabel="time [s]", ylabel="friction [N]")

# %%
# `planarfriction reproduce --only classics` has the paper's other experiments:
# presliding, break-away, friction lag. The mass has moved 2.5451 m after 30 s, as an
# integration of the equations in one dimension without this library has it.
print(f"{float(data.x[-1]):.6f} m")
assert abs(float(data.x[-1]) - 2.5451019) < 1e-6
