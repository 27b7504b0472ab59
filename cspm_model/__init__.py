"""What has no state and no clock: kinematics, cable laws, rest, linear model, robust statistics."""

from cspm_model.kernel_cache import use_kernel_cache

# Before any kernel is defined, since that is when numba looks for its compiled form.
use_kernel_cache()
