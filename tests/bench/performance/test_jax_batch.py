"""The plant's equations in JAX are the plant's: another road to the same states."""

import numpy as np
import pytest

pytest.importorskip("jax", reason="JAX is for one benchmark only")
from bench.performance.jax_batch import PlantVariants
from bench.performance.jax_plant import make_advance, make_rate


def test_variants_in_lanes_make_the_steps_of_the_plant():
    batch = PlantVariants(3)
    rate = make_rate(batch.plant.parameters, batch.frame_pose)
    advance = make_advance(rate, 1e-3, 200)
    found = np.asarray(advance(batch.states, np.tile(batch.torque, (3, 1))))
    own = batch.advance(200)
    np.testing.assert_allclose(found, own, rtol=0.0, atol=1e-10)
    assert np.abs(own - batch.states).max() > 1e-4
    assert np.abs(own[0] - own[1]).max() > 1e-4
