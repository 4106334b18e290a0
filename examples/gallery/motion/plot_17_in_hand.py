"""
A plate slips between two fingers
=================================

A plate hangs between two finger pads whose grip varies twice a second. At each weak
moment it slips and turns a little: two models side by side.
"""

import planarfriction as pf

patch = pf.ContactPatch.disc(0.01, cells=11)
law = pf.LuGre(
    mu_c=0.6, mu_s=0.7, sigma_0=1e5, sigma_1=3e2, sigma_2=0.1, elasto_plastic=0.9
)
grip = pf.Signal.sine(2.6, 1.3, 2.0, t_end=2.0)
solutions = {
    name: pf.simulate(pf.scenes.in_hand(model, normal_force=grip))
    for name, model in (
        ("distributed", pf.DistributedModel(patch, law)),
        ("reduced", pf.ReducedModel(patch, law)),
    )
}
figure = pf.plots.plot_histories(solutions)

# %%
# And the motion of the plate:
motion = pf.plots.plot_motion(solutions["distributed"])
# sphinx_gallery_thumbnail_number = 2

# %%
# Both models end at nearly the same height:
end = {name: 1e3 * float(solution.data.y[-1]) for name, solution in solutions.items()}
print({name: f"{y:.1f} mm" for name, y in end.items()})
assert abs(end["reduced"] / end["distributed"] - 1) < 0.1
