"""What an effect declares about itself. One file per effect; nothing else names one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, IntEnum

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.testbed import EffectEntry, Testbed
from cspm_msgs_py.testbed_keys.effect_table import EffectTable
from cspm_sim.kernels import hooks

Array = NDArray[np.float64]
Values = Mapping[str, float]


# By how much a machine may be larger or smaller than the thesis's.
WIDER = 1e6
_WITHOUT_SCALE = frozenset({"1", "s", "Hz", "rad"})


class Block(Enum):
    """The part of the test-bed that an effect belongs to."""

    WINCH = "winch"
    CABLE = "cable"
    BAR = "bar"
    FRAME = "frame"
    SENSOR = "sensor"


class Hook(IntEnum):
    """Where in the plant's rates a kernel takes part; see `cspm_sim.kernels.hooks`."""

    FRAME = hooks.FRAME
    CABLE = hooks.CABLE
    LOADED_CABLE = hooks.LOADED_CABLE
    LOADED_FRAME = hooks.LOADED_FRAME
    DRIVE = hooks.DRIVE
    WINCH = hooks.WINCH
    ATTACHMENT = hooks.ATTACHMENT
    BAR = hooks.BAR
    PENDANT = hooks.PENDANT


class Elements(Enum):
    """What an effect's `elements` name; none named means all."""

    CABLES = "cables"
    BAR = "bar"
    FRAME = "winch_frame"
    BODIES = "bodies"
    CELLS = "load_cells"


class Channel(Enum):
    """A residual: what was measured less what the model says of its block.

    Its value says what the residual's channels are; see `cspm_sim.effects.signals`.
    """

    SHAFT = "torque against positive motion that the winch equation misses [N·m]"
    DRIVE = "commanded less reported torque [N·m]"
    TENSION = "measured tension less that of the cable's law [N]"
    WRENCH = "wrench on the bar that its equation misses, six channels [N, N·m]"
    READING = "sensor's reading less what other sensors and the model say it should be"


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect, with the range in which it is plausible.

    Attributes:
        name: public name.
        unit: SI.
        minimum: least plausible value, on a machine of the thesis's size.
        maximum: largest plausible value, likewise.
        absent: the value at which the effect is not there; None for a number that only shapes it.
        meaning: what the number is, where the equation does not say it.
        default: what holds where a file leaves it out; None: it has to be given.
        usual: size of the error of a wrong number of the file, where laboratories make one.
    """

    name: str
    unit: str
    minimum: float
    maximum: float
    absent: float | None = 0.0
    meaning: str = ""
    default: float | None = None
    usual: float | None = None

    @property
    def allowed(self) -> tuple[float, float]:
        """Ends of what a file may say: of what has a dimension, whatever the machine's size."""
        if self.unit in _WITHOUT_SCALE:
            return self.minimum, self.maximum
        least = self.minimum / WIDER if self.minimum > 0.0 else self.minimum * WIDER
        return least, self.maximum * WIDER

    def is_open(self, low: float, high: float) -> bool:
        """Return whether an interval is all that is allowed, so that nothing bounds the number."""
        return low <= self.minimum and high >= self.maximum


@dataclass(frozen=True)
class Regression:
    """How an effect shows in one residual, as columns that are weighted and summed.

    Attributes:
        channel: the residual.
        columns: `columns(signals, **nonlinear)`: from the signals of `cspm_sim.effects.signals`,
            shape (samples, signals), and values of the nonlinear parameters, what one unit of each
            coefficient adds to the residual, shape (samples, channels, coefficients).
    """

    channel: Channel
    columns: Callable[..., Array]


@dataclass(frozen=True)
class Sense:
    """What an effect does to the readings of a sensor.

    Attributes:
        topics: names of the topics, `{}` standing for a body.
        reading: `reading(values, element, parameters)`: a copy of what the sensor takes in, changed
            before noise; of a pose x y z φ θ ψ, of joints by kind and cable.
        lateness: `lateness(time, parameters)`: by how much the reading is older than its stamp says
            [s].
        time_constant: `time_constant(parameters)`: of a low pass of first order that the quantities
            pass before anything else [s].
        added: `added(time, values, element, parameters)`: what the element's reading has too much
            at a time since the run's start [s] where the sensor's quantities are `values`.
        quantity: which of a joint's quantities it acts on, `torque`; empty: the first, or all.
        one_system: whether one system reads all elements, so that what it does to one it is likely
            to do to all.
    """

    topics: tuple[str, ...]
    reading: Callable[[Array, int, Array], Array] | None = None
    lateness: Callable[[float, Array], float] | None = None
    time_constant: Callable[[Array], float] | None = None
    added: Callable[[float, Array, int, Array], float] | None = None
    quantity: str = ""
    one_system: bool = False


@dataclass(frozen=True)
class Physics:
    """What an effect does in the plant: kernels, another machine, or a sensor's fault.

    Attributes:
        kernels: by hook `kernel(parameters, signals)`, with memory `kernel(parameters, signals,
            states, rates)`, compiled when used. They read the hook's signals and add to them.
        states: how many numbers its memory holds, which follow the plant's own states.
        rest: `rest(parameters, signals)`: its states in a machine at rest, shape (states,), from
            the signals of its first hook; None: zeros.
        alter: `alter(testbed, element, values)`: the test-bed with other parameters, for an effect
            that is no more than that.
        sense: what it does to a sensor's readings.
        plausible: whether parameters within their bounds go together; None: always.
        constants: numbers that the kernels take ahead of the parameters, such as a table's knots.
        nearest: `nearest(testbed, values, errors)`: of the values that a machine can have those
            nearest to `values`, in units of their errors; None: any values will do.
    """

    kernels: Mapping[Hook, Callable[..., None]] = field(default_factory=dict)
    states: int = 0
    rest: Callable[[Array, Array], Sequence[float]] | None = None
    alter: Callable[[Testbed, int, Values], Testbed] | None = None
    sense: Sense | None = None
    plausible: Callable[[Values], bool] | None = None
    constants: tuple[float, ...] = ()
    nearest: Callable[[Testbed, Values, Values], Values] | None = None


@dataclass(frozen=True)
class Signature:
    """How a regression recognises an effect in a recording.

    Attributes:
        regression: how it shows in its main residual.
        partners: how the same coefficients show in further residuals at the same time.
        nonlinear: coarse grids, by name, of the parameters on which the columns depend otherwise
            than as a factor.
        whole: of these the whole numbers, which are not refined between the grid's points.
        spectrum: of these the time constant of which a machine has many, its other number being a
            share of theirs in all: the interval of that is reported for their sum; empty: it has
            one.
        saturates: whether its columns lie between −1 and 1, where all of it acts.
        coefficients: from all parameters to the columns' weights; None: the parameters that are
            not nonlinear, in order, each less its absent value.
        from_coefficients: from weights and nonlinear values to all parameters; None: the inverse of
            the default above.
        tied: whether its columns' weights depend on one another, so that weights that were fitted
            freely need not be those of any parameters.
        rescales: whether it multiplies the quantity that its main residual compares. Its column is
            then that quantity as the model has it, in the unit that was measured: no gain can
            shrink the residual by which it is judged.
        shares_noise: whether its columns are readings from which its residual is made as well, so
            that their noise alone correlates both.
        negligible: how far below and above where the effect is absent parameters, by name, may lie
            in a healthy machine; less is taken into account and not reported.
    """

    regression: Regression
    partners: tuple[Regression, ...] = ()
    nonlinear: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    whole: tuple[str, ...] = ()
    spectrum: str = ""
    saturates: bool = False
    coefficients: Callable[[Values], Sequence[float]] | None = None
    from_coefficients: Callable[[Sequence[float], Values], dict[str, float]] | None = None
    tied: bool = False
    rescales: bool = False
    shares_noise: bool = False
    negligible: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Description:
    """An effect in words, for the pages, verdicts and plans of experiments.

    Attributes:
        equation: the effect in one line.
        shows: how it looks in the residual.
        confounded_with: ids of effects that look alike in most recordings.
        separating_experiment: which experiment separates it from them.
        reference: where the equation comes from.
        noun: what an element has, or of an `alter` has another of, as a verdict calls it.
    """

    equation: str
    shows: str
    confounded_with: tuple[str, ...]
    separating_experiment: str
    reference: str
    noun: str = ""


@dataclass(frozen=True)
class Effect:
    """Physics that can be added to the test-bed and recognised in a recording.

    Attributes:
        id: the public name.
        block: the part that it belongs to.
        parameters: its numbers, in the kernels' order.
        physics: what it does in the plant.
        signature: how it is recognised in a recording.
        description: what people read about it.
        elements: what it can act on; None: that which its block says.
        table: the table whose values are its parameters; None for an effect with a name.
    """

    id: str
    block: Block
    parameters: tuple[EffectParameter, ...]
    physics: Physics
    signature: Signature
    description: Description
    elements: Elements | None = None
    table: EffectTable | None = None

    @property
    def key(self) -> str:
        """What tells it from other effects of the same id, which only tables share."""
        return self.id if self.table is None else f"{self.id} {self.table.key}"

    def entry(self, elements: Sequence[str], values: Values) -> EffectEntry:
        """Return its entry in a test-bed file.

        Args:
            elements: that it acts on; none: all.
            values: of all parameters, by name.
        """
        if self.table is None:
            return EffectEntry(effect=self.id, elements=tuple(elements), parameters=dict(values))
        numbers = tuple(float(values[p.name]) for p in self.parameters)
        table = self.table.model_copy(update={"values": numbers})
        return EffectEntry(effect=self.id, elements=tuple(elements), parameters=table)

    @property
    def words(self) -> str:
        """What it is, for a sentence; made from its id where it does not say."""
        plain = self.id.removeprefix(f"{self.block.value}_").replace("_", " ")
        return self.description.noun or plain

    @property
    def is_correction(self) -> bool:
        """Whether it corrects a number of the file or readings, and adds no physics."""
        return self.physics.alter is not None or self.physics.sense is not None

    @property
    def acts_on(self) -> Elements:
        """What its `elements` name."""
        return self.elements or _ELEMENTS[self.block]

    def with_grid(self, nonlinear: Mapping[str, tuple[float, ...]]) -> Effect:
        """Return the effect with other grids of its nonlinear parameters, by name."""
        return replace(self, signature=replace(self.signature, nonlinear=nonlinear))

    def regressors(self, signals: Array, **nonlinear: float) -> Array:
        """Return the columns of its main residual, shape (samples, channels, coefficients)."""
        return self.signature.regression.columns(signals, **nonlinear)

    def weights(self, values: Values) -> Array:
        """Return what the columns are to be multiplied with for these parameters."""
        coefficients = self.signature.coefficients
        if coefficients:
            return np.asarray(coefficients(values), dtype=float)
        return np.array([values[p.name] - (p.absent or 0.0) for p in self.linear])

    def values(self, weights: Sequence[float], **nonlinear: float) -> dict[str, float]:
        """Return all parameters for weights that a regression found."""
        if self.signature.from_coefficients:
            return self.signature.from_coefficients(weights, nonlinear)
        found = {
            p.name: float(weight) + (p.absent or 0.0)
            for p, weight in zip(self.linear, weights, strict=True)
        }
        return {p.name: {**nonlinear, **found}[p.name] for p in self.parameters}

    def is_plausible(self, values: Values) -> bool:
        """Return whether values are such as the catalogue allows."""
        within = all(p.minimum <= values[p.name] <= p.maximum for p in self.parameters)
        return within and (self.physics.plausible is None or self.physics.plausible(values))

    def is_negligible(self, values: Values) -> bool:
        """Return whether values are such as a healthy machine has as well."""
        limits = self.signature.negligible
        return bool(limits) and all(
            limits[p.name][0] <= values[p.name] - (p.absent or 0.0) <= limits[p.name][1]
            for p in self.parameters
            if p.name in limits
        )

    def is_absent(self, values: Values) -> bool:
        """Return whether the effect does nothing with these parameters."""
        acting = [p for p in self.parameters if p.absent is not None]
        return bool(acting) and all(values[p.name] == p.absent for p in acting)

    @property
    def linear(self) -> tuple[EffectParameter, ...]:
        """The parameters that are not searched on a grid."""
        return tuple(p for p in self.parameters if p.name not in self.signature.nonlinear)


_ELEMENTS = {
    Block.WINCH: Elements.CABLES,
    Block.CABLE: Elements.CABLES,
    Block.BAR: Elements.BAR,
    Block.FRAME: Elements.FRAME,
    Block.SENSOR: Elements.CABLES,
}
