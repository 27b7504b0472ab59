"""Where effects take part in the plant's rates, and how they are called there.

The rows of `PlantParameters.effects` are in the order of the hooks, and within a hook in the order
of the elements, so that a cursor that only moves on finds each element's effects. `check_order`
refuses any other order, in which a kernel would pass over effects without an error.
"""

from numba import njit
from numpy import float64, int64
from numpy.typing import NDArray

from cspm_model.kernels.machine import EFFECT_COLUMNS
from cspm_sim.kernels.effect_call import call_kernel, call_kernel_with_states

Array = NDArray[float64]
Rows = NDArray[int64]

# Hooks: those of cables and winch frame, of winches, of the bar.
FRAME = 0  # before the geometry: the winch frame is shifted
CABLE = 1  # per cable, before its tension is known
LOADED_CABLE = 2  # per cable, when its elastic tension is known
LOADED_FRAME = 3  # when all tensions are known
DRIVE = 4  # per winch, from the commanded to the reported torque
WINCH = 5  # per winch, at the motor shaft
ATTACHMENT = 6  # per cable, force on the bar
BAR = 7  # wrench on the bar
PENDANT = 8  # what hangs on the bar, when all else that acts on it is known

# Columns of an effect's row.
HOOK = 0
ELEMENT = 1
ADDRESS = 2
FIRST_STATE = 3  # index in the plant's state, -1 without memory
STATES = 4  # how many
# The same in all rows: addresses of `affected_cables` and `effects_on_bar`, 0 where none needs it.
AFFECTED = 5
ON_BAR = 6
ROW_COLUMNS = EFFECT_COLUMNS


def check_order(effects: Rows) -> None:
    """Check that effects' rows (m, ROW_COLUMNS) ascend by hook, within a hook by element.

    Raises:
        ValueError: they do not, so that kernels would pass over some of them.
    """
    keys = [(int(row[HOOK]), int(row[ELEMENT])) for row in effects]
    if keys != sorted(keys):
        raise ValueError(
            f"effects: rows of hook and element {keys}, allowed: ascending, as `hook_rows` gives"
        )


@njit(cache=True, error_model="numpy", _nrt=False)
def first_effect(hook: int, effects: Rows) -> int:
    """Return the first row of a hook or of one after it."""
    e = 0
    while e < effects.shape[0] and effects[e, HOOK] < hook:
        e += 1
    return e


@njit(cache=True, error_model="numpy", inline="always")
def acts_on(hook: int, element: int, row: int, effects: Rows) -> bool:
    """Return whether an effect's row is for this element at this hook."""
    return effects[row, HOOK] == hook and effects[row, ELEMENT] == element


@njit(cache=True, error_model="numpy", inline="always")
def run_effects(
    hook: int,
    element: int,
    cursor: int,
    effects: Rows,
    effect_parameters: Array,
    signals: Array,
    state: Array,
    out: Array,
) -> int:
    """Call an element's effects at a hook; return the row after them.

    `cursor` is the first row not called yet at this hook; `state` and `out` are the plant's state
    and its rate.
    """
    e = cursor
    while e < effects.shape[0] and acts_on(hook, element, e, effects):
        if effects[e, FIRST_STATE] < 0:
            call_kernel(effects[e, ADDRESS], effect_parameters[e], signals)
        else:
            call_kernel_with_states(
                effects[e, ADDRESS],
                effect_parameters[e],
                signals,
                state,
                out,
                effects[e, FIRST_STATE],
            )
        e += 1
    return e
