"""How the scenario describes its force controllers."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import PositiveFloat

from cspm_msgs_py.control_spec.per_cable import PerCable
from cspm_msgs_py.yaml_file import StrictModel

FORCE_BANDWIDTH = 800.0  # rad/s


class PiGains(StrictModel):
    """Gains of Kp·(e + ω_i·∫e), thesis (7-4); Kp in N·m/N at the motor shaft, ω_i in rad/s.

    `feedforward` is the share of the torque that balances the wanted tension which goes ahead.
    """

    kp: float
    integral_frequency: float
    feedforward: float = 0.0


class LoadCellBias(StrictModel):
    """Largest bias of a load cell that is corrected [N]."""

    largest: PositiveFloat = 2.0


class FrictionFeedforward(StrictModel):
    """Cable speed [m/s] about which the sign of dry friction turns: tanh(speed/smooth_below)."""

    smooth_below: PositiveFloat = 0.003


class WinchFeedforward(StrictModel):
    """Bandwidth [rad/s] up to which cables are wound by what wanted tensions stretch them."""

    stretch_bandwidth: PositiveFloat | None = None


class Dither(StrictModel):
    """A sine on the motor torques against sticking: amplitude [N·m] at the shaft, frequency [Hz].

    Each is one number for all cables, or by name or kind of cable; a cable without an amplitude has
    no dither.
    """

    amplitude: PerCable
    frequency: PerCable


class ForceControl(StrictModel):
    """Force controllers: closed-loop bandwidth [rad/s] to design for, or the gains per cable.

    The bandwidth is one for all cables, or by name or kind of cable, as section 7-2 of the thesis
    tunes hoists otherwise; a cable that is not named has the default.

    With `load_cell_bias` the biases of the load cells are estimated from torques and speeds of the
    winches, and taken off. With `friction_feedforward` the torque goes ahead of the friction that
    the test-bed's file describes, with `winch_feedforward` of what the wanted tensions and the
    references require of the winches. `dither` keeps the winches from sticking.
    """

    bandwidth: PerCable = FORCE_BANDWIDTH
    gains: dict[str, PiGains] | None = None
    load_cell_bias: LoadCellBias | None = None
    friction_feedforward: FrictionFeedforward | None = None
    winch_feedforward: WinchFeedforward | None = None
    dither: Dither | None = None

    def gains_of(self, names: Sequence[str]) -> list[PiGains]:
        """Return the gains of cables; a torque that `winch_feedforward` has is not there twice."""
        given = self.gains or {}
        ahead = {} if self.winch_feedforward is None else {"feedforward": 0.0}
        return [given[name].model_copy(update=ahead) for name in names]

    @property
    def looks_ahead(self) -> bool:
        """Whether torques depend on the references."""
        return bool(self.friction_feedforward or self.winch_feedforward)
