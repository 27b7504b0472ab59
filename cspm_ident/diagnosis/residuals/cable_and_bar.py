"""Residuals of cables and bar: measured poses, angles and tensions against the model."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from cspm_ident.diagnosis.residuals.machine_signals import (
    BodyState,
    CableSpans,
    MachineSignals,
    body_state,
    cable_spans,
    end_velocities,
)
from cspm_ident.signals.cable_motion import damping_of
from cspm_model.elastic_law import elongation_at, law_at
from cspm_model.end_slopes import EndSlopes, end_slopes
from cspm_model.equilibrium import unstretched_lengths
from cspm_model.kernels.cable import (
    EXIT,
    GEAR_RATIO,
    HAS_CABLE,
    OFFSET_LENGTH,
    PARTS,
    PULLEY_AXIS,
    PULLEY_RADIUS,
    RADIUS,
    ROUTE,
)
from cspm_model.kernels.machine import PlantParameters
from cspm_model.kernels.route import STOP_COUNT
from cspm_model.pulley_slopes import UPWARDS, Span, pulley_slopes
from cspm_msgs_py.testbed import Testbed
from cspm_sim.effects.bar_motion import carried
from cspm_sim.effects.signals import BarSignal, CableSignal
from cspm_sim.kernels.memory import relaxed

Array = NDArray[np.float64]


# Widths of Gaussian windows for the damper force, and for elongations without reversals from noise;
# duration of a dashpot's unknown initial state.
_STEADY_S, _CALM_S, _START_S = 0.01, 0.03, 0.5


class Known(NamedTuple):
    """What is known of a stretch before anything is computed; None where it is not.

    Attributes:
        bar, frame: kinematics of both bodies.
        spans: the cables between them.
        needed: force and moment that the bar's motion needs beside its weight, (k, 6) [N, N·m].
        steady_damper: the dampers' forces without the poses' noise, (k, n) [N].
        near: elongations that nearly carry the tensions, from which they are searched, (k, n) [m].
    """

    bar: BodyState | None = None
    frame: BodyState | None = None
    spans: CableSpans | None = None
    needed: Array | None = None
    steady_damper: Array | None = None
    near: Array | None = None


class Suspension:
    """Bar and cables along one stretch of measured signals.

    Attributes:
        signals: measured signals.
        parameters: of the machine as described.
        start: unstretched lengths at the beginning, (n,) [m].
    """

    def __init__(
        self,
        signals: MachineSignals,
        testbed: Testbed,
        parameters: PlantParameters,
        start: Array | None = None,
        known: Known | None = None,
    ) -> None:
        """Take a stretch without gaps; without `start`, the first tensions give the lengths."""
        self.signals, self.parameters, self._testbed = signals, parameters, testbed
        self._known = Known() if known is None else known
        if start is None:
            tensions = np.maximum(signals.tensions[0], 0.0)
            start = unstretched_lengths(parameters, self._spans.lengths[0], tensions)
        self.start = start

    def with_poses(self, signals: MachineSignals) -> Suspension:
        """Return the same stretch with slightly changed poses and the same initial lengths.

        The elongation rates derived from tensions are kept. They depend on the poses only through
        the length of the cables.
        """
        bar, frame = signals.bar is self.signals.bar, signals.frame is self.signals.frame
        known = Known(
            bar=self.bar if bar else None,
            frame=self._frame if frame else None,
            needed=self.needed if bar else None,
            steady_damper=self._steady_damper,
            near=self._carrying,
        )
        return Suspension(signals, self._testbed, self.parameters, self.start, known)

    def of_cable(self, i: int) -> Suspension:
        """Return the same stretch with cable i only."""
        own = slice(i, i + 1)
        parts = self.parameters._replace(
            cables=self.parameters.cables[own], tables=self.parameters.tables[own]
        )
        before = self._known
        known = Known(
            bar=self.bar,
            frame=self._frame,
            spans=None if before.spans is None else before.spans.only(i),
            steady_damper=None if before.steady_damper is None else before.steady_damper[:, own],
            near=None if before.near is None else before.near[:, own],
        )
        signals, start = self.signals.of_cable(i), self.start[own]
        return Suspension(signals, self._testbed, parts, start, known)

    def with_joints(self, signals: MachineSignals) -> Suspension:
        """Return the same stretch with slightly changed angles, speeds and tensions."""
        known = Known(bar=self.bar, frame=self._frame, spans=self._spans, near=self._carrying)
        return Suspension(signals, self._testbed, self.parameters, self.start, known)

    @cached_property
    def bar(self) -> BodyState:
        """The bar's kinematics."""
        known = self._known.bar
        return body_state(self.signals.bar) if known is None else known

    @cached_property
    def _frame(self) -> BodyState:
        known = self._known.frame
        return body_state(self.signals.frame) if known is None else known

    @cached_property
    def _spans(self) -> CableSpans:
        if self._known.spans is not None:
            return self._known.spans
        return cable_spans(self.signals, self.bar, self._frame, self.parameters.cables)

    @cached_property
    def _wound(self) -> Array:
        """Unstretched lengths by thesis (2-16..2-18), from the first tensions on, (k, n) [m]."""
        lengths, cables = self._spans.lengths, self.parameters.cables
        turned = np.diff(self.signals.angles, axis=0) * cables[:, RADIUS]
        shrunk = np.cumsum(2.0 * turned / (lengths[1:] + lengths[:-1]), axis=0)
        return np.asarray(self.start * np.exp(-np.vstack([np.zeros(shrunk.shape[1]), shrunk])))

    @cached_property
    def _elastic_lengths(self) -> Array:
        return np.asarray(self._wound + self.parameters.cables[:, OFFSET_LENGTH])

    @cached_property
    def _rates(self) -> Array:
        """Elongation rates, (k, n) [m/s]."""
        wound = self._wound / self._spans.lengths * self.parameters.cables[:, RADIUS]
        return np.asarray(self._spans.rates + wound * self.signals.speeds)

    @cached_property
    def _damping(self) -> Array:
        return damping_of(self.parameters, self._wound)

    @cached_property
    def _stretched(self) -> Array:
        """Measured elongations, (k, n) [m]."""
        return np.asarray(self._spans.lengths - self._wound)

    @cached_property
    def _damper(self) -> Array:
        return self._damping * self._rates

    @cached_property
    def _steady_damper(self) -> Array:
        """Damper force without the poses' noise, about which the law is linearised.

        Otherwise the noise would enter both stiffness and residual. A stiffness error would then
        seem to explain the residual.
        """
        if self._known.steady_damper is not None:
            return self._known.steady_damper
        sigma, damper = _STEADY_S / self.signals.step, self._damping * self._rates_by_tension
        return np.asarray(gaussian_filter1d(damper, sigma, axis=0, mode="nearest"))

    @cached_property
    def _elongations_by_tension(self) -> Array:
        """Elongations from law and measured tension alone, (k, n) [m].

        For the regressors of effects: with a stiff cable, tensions give elongations far more
        precisely than poses. The poses' noise is in the residual already. In both it would appear
        as a wrong damper or as negative hysteresis. Law and damper share a tension as spring and
        dashpot do; solved by the implicit Euler method.
        """
        tensions, lengths = self.signals.tensions, self._elastic_lengths
        alone = elongation_at(self.parameters, tensions, lengths, self._known.near)
        stiffness = law_at(self.parameters, alone, lengths)[:, :, 1]
        inert = self._damping / self.signals.step
        reported = alone.copy()
        relaxed(alone, inert / np.maximum(stiffness + inert, 1e-300), reported)
        return np.asarray(reported)

    @cached_property
    def _rates_by_tension(self) -> Array:
        """Elongation rates from law and measured tension alone, (k, n) [m/s]."""
        rates = np.gradient(self._elongations_by_tension, self.signals.step, axis=0)
        # The dashpot's state before the first sample is unknown.
        start, sigma = round(_START_S / self.signals.step), _STEADY_S / self.signals.step
        rates[:start] = gaussian_filter1d(self._rates, sigma, axis=0, mode="nearest")[:start]
        return np.asarray(rates)

    @cached_property
    def _calm_elongations(self) -> Array:
        """Elongations without reversals caused by noise, (k, n) [m]."""
        sigma = _CALM_S / self.signals.step
        return np.asarray(
            gaussian_filter1d(self._elongations_by_tension, sigma, axis=0, mode="nearest")
        )

    @cached_property
    def _carrying(self) -> Array:
        """Elongations at which law and damper give the measured tension, (k, n) [m]."""
        elastic = self.signals.tensions - self._steady_damper
        return elongation_at(self.parameters, elastic, self._elastic_lengths, self._known.near)

    @cached_property
    def _law(self) -> Array:
        """Elastic tension and stiffness at the measured tension, (k, n, 2)."""
        return law_at(self.parameters, self._carrying, self._elastic_lengths)

    @cached_property
    def tension_residuals(self) -> Array:
        """Measured tensions less those of law and damper, (k, n) [N], thesis (2-19).

        Linearised about the measured tension, so that errors and noise of poses enter in
        proportion, whatever their size.
        """
        linear = self._law[:, :, 1] * (self._carrying - self._stretched)
        return np.asarray(linear - (self._damper - self._steady_damper))

    @cached_property
    def curvature(self) -> Array:
        """What linearising the law about the steady damper leaves out, (k, n) [N]: large in snaps.

        By law and measured tension alone, so that the poses' noise does not enter.
        """
        law = self._law
        force = self._steady_damper - self._damping * self._rates_by_tension
        apart = force / np.maximum(law[:, :, 1], 1e-9)
        there = law_at(self.parameters, self._carrying + apart, self._elastic_lengths)
        return np.asarray(there[:, :, 0] - law[:, :, 0] - force)

    @cached_property
    def _mass_in_world(self) -> tuple[Array, Array, Array]:
        """Centre of mass from the origin, inertia about it, and ω × Iω, in world axes.

        Shapes (k, 3) [m], (k, 3, 3) [kg·m²], (k, 3) [N·m].
        """
        bar, state = self._testbed.bar, self.bar
        assert bar is not None
        com = np.einsum("kij,j->ki", state.rotation, np.array(bar.com))
        turned = np.einsum("kij,jl,kml->kim", state.rotation, bar.inertia.matrix, state.rotation)
        spin = np.cross(state.omega, np.einsum("kij,kj->ki", turned, state.omega))
        return com, turned, spin

    @cached_property
    def needed(self) -> Array:
        """Force and moment for the bar's motion, its weight subtracted, (k, 6) [N, N·m]."""
        if self._known.needed is not None:
            return self._known.needed
        bar = self._testbed.bar
        assert bar is not None
        state, gravity = self.bar, np.array([0.0, 0.0, self._testbed.gravity])
        com, turned, spin = self._mass_in_world
        moved = state.acceleration + carried(state.omega, state.alpha, com)
        moment = np.einsum("kij,kj->ki", turned, state.alpha) + spin
        inertial = bar.mass * (moved - gravity)
        return np.hstack([inertial, moment + np.cross(com, inertial)])

    @cached_property
    def wrench_residuals(self) -> Array:
        """Residual of the bar's equation of motion (2-13), world axes, (k, 6) [N, N·m].

        Moments about the bar frame's origin.
        """
        return np.asarray(self.needed - self.cable_wrench)

    def pulled(self, i: int, tensions: Array) -> Array:
        """Return force and moment of cable i's tensions, (k,) [N], on the bar, (k, 6)."""
        pull = -tensions[:, None] * self._spans.directions[:, i]
        couple = tensions[:, None] * self._spans.couples[:, i]
        return np.hstack([pull, np.cross(self._spans.arms[:, i], pull) - couple])

    @cached_property
    def cable_wrench(self) -> Array:
        """Force and moment of the measured tensions on the bar, −Jᵀt of (2-13), (k, 6)."""
        tensions = self.signals.tensions
        return np.asarray(sum(self.pulled(i, tensions[:, i]) for i in range(tensions.shape[1])))

    @cached_property
    def _acceleration_by_tension(self) -> tuple[Array, Array]:
        """Acceleration of the bar's origin and α by (2-13) from the measured tensions, (k, 3) each.

        For the regressors of effects: the poses' noise, differentiated twice, is in the residual
        already. In both it would appear as a wrong mass.
        """
        bar, state = self._testbed.bar, self.bar
        assert bar is not None
        com, turned, spin = self._mass_in_world
        carried_com = np.cross(state.omega, np.cross(state.omega, com))
        weight = bar.mass * np.array([0.0, 0.0, self._testbed.gravity])
        force = self.cable_wrench[:, :3] + weight
        about_com = self.cable_wrench[:, 3:] - np.cross(com, self.cable_wrench[:, :3])
        alpha = np.linalg.solve(turned, (about_com - spin)[:, :, None])[:, :, 0]
        acceleration = force / bar.mass - np.cross(alpha, com) - carried_com
        return np.asarray(acceleration), np.asarray(alpha)

    def start_column(self, i: int) -> Array:
        """Return the residual's change by a longer unstretched length at the start, (k,) [N/m]."""
        return np.asarray(self._law[:, i, 1] * self._wound[:, i] / self._wound[0, i])

    @cached_property
    def _length_slopes(self) -> Array:
        """Derivative of the elastic tension by the elastic length, (k, n) [N/m]."""
        step = 1e-5
        longer = law_at(self.parameters, self._carrying, self._elastic_lengths + step)
        return np.asarray((longer - self._law)[:, :, 0] / step)

    def cable_rows(self, i: int) -> Array:
        """Return `CableSignal` columns of cable i."""
        count, cables = len(self.signals.times), self.parameters.cables
        # Column by column in memory, as they are read.
        rows = np.zeros((count, int(CableSignal.LENGTH_BY_PULLEY) + 1), order="F")
        lengths, wound = self._spans.lengths[:, i], self._wound[:, i]
        directions = self._spans.directions[:, i]
        for column, values in {
            CableSignal.TIME: self.signals.times,
            CableSignal.LENGTH: lengths,
            CableSignal.ELONGATION: self._calm_elongations[:, i],
            CableSignal.RATE: self._rates_by_tension[:, i],
            CableSignal.TENSION: self.signals.tensions[:, i],
            CableSignal.STIFFNESS: self._law[:, i, 1],
            CableSignal.LENGTH_SLOPE: self._length_slopes[:, i],
            CableSignal.DAMPER: self._damping[:, i] * self._rates_by_tension[:, i],
            CableSignal.DAMPING: self._damping[:, i],
            CableSignal.WOUND: wound / lengths,
            CableSignal.ANGLE: self.signals.angles[:, i],
            CableSignal.SPEED: self.signals.speeds[:, i],
            CableSignal.RADIUS: cables[i, RADIUS],
            CableSignal.GEAR: cables[i, GEAR_RATIO],
            CableSignal.HORIZONTAL: np.hypot(directions[:, 0], directions[:, 1]),
            CableSignal.DOWNWARD: directions[:, 2],
            CableSignal.GRAVITY: self._testbed.gravity,
        }.items():
            rows[:, column] = values
        rows[:, CableSignal.LENGTH_BY_EXIT : CableSignal.LENGTH_BY_PULLEY] = self._length_by_ends[
            :, i
        ]
        rows[:, CableSignal.LENGTH_BY_PULLEY], _ = self._pulley_slopes(i)
        return rows

    @cached_property
    def _length_by_ends(self) -> Array:
        """Slopes of the cables' lengths over their exits and attachments, (k, n, 6)."""
        slopes = [self._end_slopes(i) for i in range(len(self.parameters.cables))]
        lengths = ([s.exit_lengths, s.attachment_lengths] for s in slopes)
        return np.concatenate([np.concatenate(each, axis=2) for each in lengths], axis=1)

    def _end_slopes(self, i: int) -> EndSlopes:
        """Return slopes over cable i's ends; one cable at a time to save memory."""
        poses = self.signals.bar.poses, self.signals.frame.poses
        return end_slopes(self.parameters.cables[i : i + 1], *poses)

    def _pulley_slopes(self, i: int) -> tuple[Array, Array]:
        """Return slopes over the radius of a pulley at cable i's exit; zeros where it has none."""
        row, spans = self.parameters.cables[i], self._spans
        if row[ROUTE + STOP_COUNT] > 0.0 or row[PARTS] != 1.0 or not row[HAS_CABLE]:
            count = len(self.signals.times)
            return np.zeros(count), np.zeros((count, 6))
        radius = float(row[PULLEY_RADIUS])
        axis = row[PULLEY_AXIS : PULLEY_AXIS + 3] if radius else np.array(UPWARDS)
        ends = spans.directions[:, i], spans.arms[:, i], spans.lengths[:, i]
        return pulley_slopes(Span(*ends, self._frame.rotation @ axis, radius))

    def end_rows(self, i: int) -> Array:
        """Return `EndSignal` columns of cable i."""
        spans, place = self._spans.only(i), self.parameters.cables[i : i + 1, EXIT : EXIT + 3]
        apart, exits = end_velocities(spans, self.bar, self._frame, place)
        gravity = np.full((len(self.signals.times), 1), self._testbed.gravity)
        parts = (spans.directions[:, 0], apart[:, 0], spans.arms[:, 0], spans.lengths)
        slopes, count = self._end_slopes(i), len(gravity)
        wrenches = (slopes.exit_wrenches, slopes.attachment_wrenches)
        ends = (each.reshape(count, 18) for each in wrenches)
        own, (_, pulley) = self.signals.tensions[:, i, None], self._pulley_slopes(i)
        return np.hstack([*parts, gravity, exits[:, 0], own, *ends, pulley])

    @cached_property
    def bar_rows(self) -> Array:
        """`BarSignal` columns, with accelerations from the tensions."""
        bar, state = self._testbed.bar, self.bar
        assert bar is not None
        count = len(self.signals.times)
        # Column by column in memory, as they are read.
        rows = np.zeros((count, int(BarSignal.POSE) + 6), order="F")
        rows[:, :3], rows[:, 3:6] = state.velocity, state.omega
        rows[:, 6:9], rows[:, 9:12] = self._acceleration_by_tension
        rows[:, BarSignal.ROTATION : BarSignal.ROTATION + 9] = state.rotation.reshape(count, 9)
        rows[:, BarSignal.COM : BarSignal.COM + 3] = bar.com
        rows[:, BarSignal.MASS] = bar.mass
        rows[:, BarSignal.GRAVITY] = self._testbed.gravity
        rows[:, BarSignal.TIME] = self.signals.times
        rows[:, BarSignal.POSE :] = self.signals.bar.poses
        return rows

    @property
    def posed_bar_rows(self) -> Array:
        """`BarSignal` columns, with accelerations from the poses."""
        rows: Array = self.bar_rows.copy(order="F")
        rows[:, 6:9], rows[:, 9:12] = self.bar.acceleration, self.bar.alpha
        return rows

    def frame_rows(self, i: int) -> Array:
        """Return `FrameSignal` columns of cable i."""
        count = len(self.signals.times)
        exits = self.parameters.cables[i, EXIT : EXIT + 3]
        return np.column_stack(
            [
                self.signals.times,
                self._spans.directions[:, i],
                np.broadcast_to(exits, (count, 3)),
                self._frame.rotation.reshape(count, 9),
                -self.cable_wrench[:, :3],
                self._law[:, i, 1],
            ]
        )
