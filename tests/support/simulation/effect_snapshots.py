"""A machine at random instants, as a recording would show it, and the residuals of its blocks.

The residuals are those of the nominal machine, written down here once more with numpy: what was
measured on a machine with effects, put into the equations of one without.
"""

import numpy as np

from cspm_model.kernels.cable import (
    INERTIA,
    LENGTH,
    OFFSET_LENGTH,
    RADIUS,
    RATE,
    TENSION,
    elastic_tension,
    law_scale,
)
from cspm_model.kernels.machine import frame_placement
from cspm_model.kernels.pulley import around_pulley
from cspm_model.kinematics import rotation
from cspm_sim.effects.signals import BarSignal, CableSignal, EndSignal, FrameSignal, WinchSignal
from cspm_sim.kernels.plant import make_scratch, plant_rate, state_count
from cspm_sim.parameters import plant_parameters


def wrench_slopes(line, arm, base, turn):
    """Wrench per newton of a cable by its exit and its attachment, (6, 3) each."""
    length, pull = np.linalg.norm(line), line / np.linalg.norm(line)
    across = (np.eye(3) - np.outer(pull, pull)) / length
    of_exit, of_attachment = across @ base, -across @ turn
    moments = [np.cross(arm, of_exit.T).T, np.cross(arm, of_attachment.T).T]
    moments[1] -= np.cross(turn.T, pull).T
    return np.vstack([of_exit, moments[0]]), np.vstack([of_attachment, moments[1]])


def by_pulley(line, base):
    """Length and direction of a cable per radius of a pulley that it enters upwards."""
    up, step = tuple(-base[:, 2]), 1e-6
    (length, pull), (longer, turned) = (around_pulley(tuple(line), up, r) for r in (0.0, step))
    return (longer - length) / step, (np.array(turned) - pull) / step


class Snapshots:
    """`count` instants of a machine with a bar, `effects` added; all arrays by instant."""

    def __init__(self, testbed, effects=(), count=10, seed=3, stretch=0.03, frame_moves=1.0):
        self.nominal = testbed.model_copy(update={"effects": ()})
        self.testbed = testbed.model_copy(update={"effects": tuple(effects)})
        self.p0, self.p = plant_parameters(self.nominal), plant_parameters(self.testbed)
        rng = np.random.default_rng(seed)
        n = len(testbed.cables)
        self.n, size = n, state_count(self.p)
        self.states, self.torques, self.frames = [], [], []
        self.rates, self.spans = [], []
        for _ in range(count):
            pose = rng.uniform(-1, 1, 6) * [0.1, 0.1, 0.1, 0.2, 0.2, 0.2] + [0, 0, 2, 0, 0, 0]
            rates = frame_moves * rng.uniform(-0.02, 0.02, 12)
            frame = np.concatenate([rng.uniform(-0.05, 0.05, 6), rates])
            state = np.zeros(size)
            state[:12] = np.concatenate([pose, rng.uniform(-0.05, 0.05, 6)])
            state[12 + n : 12 + 3 * n] = rng.uniform(-1.0, 1.0, 2 * n)
            torque = rng.uniform(-0.5, 0.5, n)
            state[12 : 12 + n] = 1.0
            _, spans = self._rate(self.p0, state[: 12 + 3 * n], torque, frame)
            stretched = rng.uniform(0.5, 1.0, n) * stretch
            state[12 : 12 + n] = spans[:, LENGTH] - stretched
            _, spans = self._rate(self.p0, state[: 12 + 3 * n], torque, frame)
            rate, loaded = self._rate(self.p, state, torque, frame)
            assert (loaded[:, TENSION] > 0.0).all()
            # What a recording shows: the nominal geometry of measured poses, true tensions.
            spans[:, TENSION] = loaded[:, TENSION]
            for kept, value in (
                (self.states, state),
                (self.torques, torque),
                (self.frames, frame),
                (self.rates, rate),
                (self.spans, spans),
            ):
                kept.append(value)
        self.states, self.rates = np.array(self.states), np.array(self.rates)
        self.torques, self.spans = np.array(self.torques), np.array(self.spans)
        self.frames = np.array(self.frames)

    def _rate(self, p, state, torque, frame):
        scratch, out = make_scratch(len(state), self.n), np.zeros(len(state))
        placement = frame_placement(frame)
        plant_rate(state, torque, placement, False, 1e-6, *p, scratch.spans, scratch.signals, out)
        return out, scratch.spans.copy()

    def angles(self, i):
        return self.states[:, 12 + self.n + i]

    def winch(self, i):
        """Signals of winch i."""
        out = np.zeros((len(self.states), len(WinchSignal)))
        out[:, WinchSignal.ANGLE] = self.angles(i)
        out[:, WinchSignal.SPEED] = self.states[:, 12 + 2 * self.n + i]
        out[:, WinchSignal.TENSION] = self.spans[:, i, TENSION]
        out[:, WinchSignal.RADIUS] = self.p0.cables[i, RADIUS]
        out[:, WinchSignal.ACCELERATION] = self.rates[:, 12 + 2 * self.n + i]
        out[:, WinchSignal.TORQUE] = self.torques[:, i]
        out[:, WinchSignal.GEAR] = self.nominal.cables[i].gear_ratio
        return out

    def shaft_residual(self, i):
        """τ − (r/n)·t − J·q̈, (count, 1)."""
        signals, row = self.winch(i), self.p0.cables[i]
        load = row[RADIUS] * signals[:, WinchSignal.TENSION]
        inertial = row[INERTIA] * signals[:, WinchSignal.ACCELERATION]
        return (signals[:, WinchSignal.TORQUE] - load - inertial)[:, None]

    def _law(self, i, elongation, elastic):
        p = self.p0
        scale = law_scale(elastic, p.cables, i)
        return np.array(elastic_tension(elongation, elastic, scale, p.cables, p.tables, i))

    def cable(self, i):
        """Signals of cable i."""
        out = np.zeros((len(self.states), CableSignal.LENGTH_BY_PULLEY + 1))
        row, damping = self.p0.cables[i], self.nominal.cables[i].damping
        for k, state in enumerate(self.states):
            unstretched, span = state[12 + i], self.spans[k, i]
            elastic, length = unstretched + row[OFFSET_LENGTH], span[LENGTH]
            elongation, step = length - unstretched, 1e-6
            slope = self._law(i, elongation, elastic + step) - self._law(
                i, elongation, elastic - step
            )
            speed = state[12 + 2 * self.n + i]
            rate = span[RATE] + unstretched / length * row[RADIUS] * speed
            damper = damping.factor * (damping.constant - damping.slope * elastic)
            tension, stiffness = self._law(i, elongation, elastic)
            assert tension > row[10]
            out[k, CableSignal.LENGTH], out[k, CableSignal.ELONGATION] = length, elongation
            out[k, CableSignal.RATE], out[k, CableSignal.TENSION] = rate, span[TENSION]
            out[k, CableSignal.STIFFNESS] = stiffness
            out[k, CableSignal.LENGTH_SLOPE] = slope[0] / (2 * step)
            out[k, CableSignal.DAMPER], out[k, CableSignal.WOUND] = (
                damper * rate,
                unstretched / length,
            )
            out[k, CableSignal.SPEED], out[k, CableSignal.DAMPING] = speed, damper
            out[k, CableSignal.HORIZONTAL] = np.hypot(span[0], span[1])
            out[k, CableSignal.DOWNWARD] = span[2]
            base, turn = rotation(self.frames[k][:6]), rotation(state[:6])
            out[k, CableSignal.LENGTH_BY_EXIT :][:3] = -span[:3] @ base
            out[k, CableSignal.LENGTH_BY_ATTACHMENT :][:3] = span[:3] @ turn
            out[k, CableSignal.LENGTH_BY_PULLEY], _ = by_pulley(span[:3] * length, base)
        out[:, CableSignal.GRAVITY] = self.nominal.gravity
        out[:, CableSignal.ANGLE] = self.angles(i)
        out[:, CableSignal.RADIUS], out[:, CableSignal.GEAR] = (
            row[RADIUS],
            self.nominal.cables[i].gear_ratio,
        )
        return out

    def tension_residual(self, i):
        """Measured tension less law and damper, (count, 1)."""
        signals, offset = self.cable(i), self.p0.cables[i, OFFSET_LENGTH]
        elastic = self.states[:, 12 + i] + offset
        law = [
            self._law(i, elongation, length)[0]
            for elongation, length in zip(signals[:, CableSignal.ELONGATION], elastic, strict=True)
        ]
        model = np.array(law) + signals[:, CableSignal.DAMPER]
        return (signals[:, CableSignal.TENSION] - model)[:, None]

    def bar(self):
        """Signals of the bar."""
        out = np.zeros((len(self.states), BarSignal.POSE + 6))
        out[:, BarSignal.POSE :] = self.states[:, :6]
        bar = self.nominal.bar
        for k, (state, rate) in enumerate(zip(self.states, self.rates, strict=True)):
            turn = rotation(state[:6])
            out[k, :3], out[k, 3:6] = state[6:9], turn @ state[9:12]
            out[k, 6:9], out[k, 9:12] = rate[6:9], turn @ rate[9:12]
            out[k, BarSignal.ROTATION : BarSignal.ROTATION + 9] = turn.ravel()
        out[:, BarSignal.COM : BarSignal.COM + 3] = bar.com
        out[:, BarSignal.MASS], out[:, BarSignal.GRAVITY] = bar.mass, self.nominal.gravity
        return out

    def ends(self, i):
        """Signals of cable i's end at the bar."""
        out = np.zeros((len(self.states), EndSignal.WRENCH_BY_PULLEY + 6))
        cable = self.nominal.cables[i]
        for k, (state, frame) in enumerate(zip(self.states, self.frames, strict=True)):
            turn, base = rotation(state[:6]), rotation(frame[:6])
            arm, exit_arm = turn @ cable.attachment, base @ cable.exit
            # The frame's angular velocity by a difference of its rotation.
            step = 1e-6
            later, before = frame[:6] + step * frame[6:12], frame[:6] - step * frame[6:12]
            exit_velocity = frame[6:9] + (rotation(later) - rotation(before)) @ cable.exit / (
                2 * step
            )
            velocity = state[6:9] + np.cross(turn @ state[9:12], arm)
            line = state[:3] + arm - frame[:3] - exit_arm
            out[k, :3], out[k, 3:6] = line / np.linalg.norm(line), velocity - exit_velocity
            out[k, 6:9], out[k, EndSignal.LENGTH] = arm, np.linalg.norm(line)
            out[k, EndSignal.EXIT_VELOCITY :][:3] = exit_velocity
            by_exit, by_attachment = wrench_slopes(line, arm, base, turn)
            out[k, EndSignal.WRENCH_BY_EXIT :][:18] = by_exit.ravel()
            out[k, EndSignal.WRENCH_BY_ATTACHMENT :][:18] = by_attachment.ravel()
            _, turned = by_pulley(line, base)
            out[k, EndSignal.WRENCH_BY_PULLEY :] = -np.hstack([turned, np.cross(arm, turned)])
        out[:, EndSignal.GRAVITY] = self.nominal.gravity
        out[:, EndSignal.TENSION] = self.spans[:, i, TENSION]
        return out

    def wrench_residual(self):
        """Newton and Euler less cables and gravity, about the bar frame's origin, (count, 6)."""
        bar, found = self.nominal.bar, []
        inertia, com = bar.inertia.matrix, np.array(bar.com)
        for state, rate, spans in zip(self.states, self.rates, self.spans, strict=True):
            turn = rotation(state[:6])
            omega, alpha = state[9:12], rate[9:12]
            swung = turn @ (np.cross(alpha, com) + np.cross(omega, np.cross(omega, com)))
            force = bar.mass * (rate[6:9] + swung - [0.0, 0.0, self.nominal.gravity])
            moment = turn @ (inertia @ alpha + np.cross(omega, inertia @ omega))
            moment = moment + np.cross(turn @ com, force)
            for cable, span in zip(self.nominal.cables, spans, strict=True):
                pull = -span[TENSION] * span[:3]
                force, moment = force - pull, moment - np.cross(turn @ cable.attachment, pull)
            found.append(np.concatenate([force, moment]))
        return np.array(found)

    def frame(self, i):
        """Signals of cable i's exit, before anything has moved."""
        out = np.zeros((len(self.states), FrameSignal.STIFFNESS + 1))
        stiffness = self.cable(i)[:, CableSignal.STIFFNESS]
        for k, (state, frame) in enumerate(zip(self.states, self.frames, strict=True)):
            base, cable = rotation(frame[:6]), self.nominal.cables[i]
            line = (
                state[:3] + rotation(state[:6]) @ cable.attachment - frame[:3] - base @ cable.exit
            )
            out[k, FrameSignal.DIRECTION : FrameSignal.DIRECTION + 3] = line / np.linalg.norm(line)
            out[k, FrameSignal.EXIT : FrameSignal.EXIT + 3] = cable.exit
            out[k, FrameSignal.ROTATION : FrameSignal.ROTATION + 9] = base.ravel()
        out[:, FrameSignal.STIFFNESS] = stiffness
        return out
