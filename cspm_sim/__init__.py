"""The simulated test-bed: plant, sensors and the effects catalogue."""

from cspm_model.kernel_cache import use_kernel_cache

# Before any kernel is defined, since that is when numba looks for its compiled form.
use_kernel_cache()
