"""The model: kinematics, bar, cables, winches, sensors, effects, plant."""

from cspm_sim.kernel_cache import use_kernel_cache

# Before any kernel is defined, since that is when numba looks for its compiled form.
use_kernel_cache()
