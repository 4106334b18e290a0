"""Arrays with a mask that masks nothing are plain numbers."""

import numpy as np

import planarfriction as pf


def test_a_mask_that_masks_nothing_is_left_out(front):
    law = pf.LuGre(mu_c=0.3, mu_s=0.4)
    model = front.model(pf.ContactPatch.disc(0.02), law, "ReducedModel")
    twist = np.array([0.01, 0.0, 1.0])
    load = np.array(2.0)
    _, plain = model.step(model.rest(), twist, load, 1e-3)
    _, masked = model.step(model.rest(), np.ma.array(twist), np.ma.array(load), 1e-3)
    assert masked.tolist() == plain.tolist()
