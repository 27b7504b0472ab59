"""One winch by itself: its torque equation, identified from its own signals."""

from cspm_ident.winch.identification import WinchFit, identify_winch
from cspm_ident.winch.reconstruction import TorqueError, torque_error
from cspm_ident.winch.recording import WinchSignals, winch_signals

__all__ = [
    "TorqueError",
    "WinchFit",
    "WinchSignals",
    "identify_winch",
    "torque_error",
    "winch_signals",
]
