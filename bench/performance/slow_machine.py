"""The thesis's machine at rates that an ordinary computer keeps in real time."""

from __future__ import annotations

PERIOD_S = 0.005
RATES = (
    "rates={plant: 200, winches: 200, load_cells: 200, motion_capture: 100, wave_trajectory: 100,"
    " motion_controller: 100, tension_distribution: 100, force_controller: 200}"
)
CABLES = {"hoist": 2, "surge": 2, "sway": 4}
# Far below what is designed for 1 kHz: stable at 200 Hz even where commands are 0.15 s late.
FORCE_GAINS = {"hoist": (0.0006, 12.0), "surge": (0.007, 12.0), "sway": (0.015, 6.0)}
MOTION_GAINS = {
    "surge": (17.0, 1.4, 13.0),
    "sway": (12.0, 0.9, 12.0),
    "heave": (39.0, 3.3, 30.0),
    "pitch": (5.0, 0.4, 3.9),
    "yaw": (1.0, 0.07, 1.0),
}


def slow_overrides() -> tuple[str, str]:
    """Return what is put over a scenario: rates, and gains that are stable at them."""
    force = ", ".join(
        f"{kind}_{i + 1}: {{kp: {kp}, integral_frequency: {frequency}}}"
        for kind, (kp, frequency) in FORCE_GAINS.items()
        for i in range(CABLES[kind])
    )
    motion = ", ".join(
        f"{dof}: {{kp: {kp}, ki: {ki}, kd: {kd}}}" for dof, (kp, ki, kd) in MOTION_GAINS.items()
    )
    gains = f"force: {{gains: {{{force}}}}}, motion: {{gains: {{{motion}}}}}"
    method = "tension_distribution: {method: pseudo_inverse}"
    return RATES, f"control={{mode: closed_loop, {gains}, {method}}}"
