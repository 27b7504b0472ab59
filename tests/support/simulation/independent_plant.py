"""The machine's equations written a second time, on another road than the plant's kernels.

The bar is held as its centre of mass, rotation matrix, momentum and angular momentum in world axes
(no Euler angles, no velocity of a body frame, no gyroscopic term); the stiffness law (3-7) is
integrated in closed form (no table); the winch frame's motion is scipy's Bernstein polynomials.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import BPoly
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import hyp2f1


def matrix(angles):
    """R = Rz(ψ)Ry(θ)Rx(φ)."""
    return Rotation.from_euler("ZYX", angles[::-1]).as_matrix()


def world_rate(angles, rates):
    """Add the three turns: yaw about z, pitch about the yawed y, roll about the bar's own x."""
    yawed, pitched = matrix([0, 0, angles[2]]), matrix([0, angles[1], angles[2]])
    return rates[2] * np.array([0, 0, 1.0]) + rates[1] * yawed[:, 1] + rates[0] * pitched[:, 0]


def antiderivative(law, tension):
    """∫ dt / (e^{ct} − e^{dt}), a hypergeometric function of e^{−(c−d)t}; needs c > 0."""
    p = law.c / (law.c - law.d)
    x = np.exp(-(law.c - law.d) * tension)
    return -np.exp(-law.c * tension) / law.c * hyp2f1(1.0, p, 1.0 + p, x)


def slope(law, tension):
    return np.exp(law.c * tension) - np.exp(law.d * tension)


def scaled_elongation(law, tension):
    """s at a tension from the floor upwards."""
    floor = law.floor_tension
    start = floor / slope(law, floor) - antiderivative(law, floor)
    return start + antiderivative(law, tension)


def cap_point(law, length):
    """Tension and elongation at which the law meets the material's stiffness E·A/l."""
    scale = law.a / length**law.b
    cap = law.axial_rigidity / length
    tension = brentq(lambda t: scale * slope(law, t) - cap, law.floor_tension, 1e4, xtol=1e-14)
    return tension, scaled_elongation(law, tension) / scale


def uncapped_tension(law, scaled, steepest):
    """Tension at s = (a/l^b)·elongation: a line below the floor, then s(t) solved by Newton.

    None where the slope passes `steepest`: the iteration only climbs, so it passes before its end.
    """
    first = slope(law, law.floor_tension)
    if scaled <= law.floor_tension / first:
        return first * scaled
    tension = law.floor_tension
    for _ in range(80):
        step = (scaled - scaled_elongation(law, tension)) * slope(law, tension)
        tension += step
        if slope(law, tension) > steepest:
            return None
        if abs(step) < 1e-14 * max(tension, 1.0):
            break
    return tension


def elastic_tension(law, elongation, length):
    """Tension of an elastic length at an elongation: thesis (3-7) under the cap (3-10)."""
    if elongation <= 0.0:
        return 0.0
    cap = law.axial_rigidity / length
    if law.law == "linear":
        return cap * elongation
    scale = law.a / length**law.b
    tension = uncapped_tension(law, scale * elongation, cap / scale)
    if tension is None:
        top, meets = cap_point(law, length)
        return top + cap * (elongation - meets)
    return tension


class IndependentPlant:
    """State: centre of mass 3, R 9, momentum 3, angular momentum 3; then l0, q, q̇ per cable."""

    def __init__(self, testbed, motion):
        self.testbed, self.bar, self.cables = testbed, testbed.bar, testbed.cables
        self.exits = np.array([c.exit for c in self.cables])
        self.attachments = np.array([c.attachment for c in self.cables])
        self.offsets = np.array([c.offset_length for c in self.cables])
        self.radii = np.array([c.drum_radius / c.gear_ratio for c in self.cables])
        self.inertias = np.array([c.rotor_inertia for c in self.cables])
        self.limits = np.array([c.torque_limit for c in self.cables])
        self.first = 18 if self.bar else 0
        self.n = len(self.cables)
        self.motion = motion
        self._path = self._polynomials(motion)

    @staticmethod
    def _polynomials(motion):
        if len(motion.knots) == 1:
            return lambda _: (motion.knots[0, :6], np.zeros(6))
        times = np.arange(len(motion.knots)) * motion.spacing
        derivatives = motion.knots.reshape(-1, 3, 6)
        poly = [BPoly.from_derivatives(times, derivatives[:, :, d]) for d in range(6)]
        rate = [p.derivative() for p in poly]
        return lambda t: (np.array([p(t) for p in poly]), np.array([p(t) for p in rate]))

    def import_state(self, state):
        """From the plant's state (position, Euler angles, v, ω in bar axes, …) to this one's."""
        if not self.bar:
            return np.array(state)
        r = matrix(state[3:6])
        arm, rate = r @ self.bar.com, r @ state[9:12]
        spin = r @ self.bar.inertia.matrix @ state[9:12]
        momentum = self.bar.mass * (state[6:9] + np.cross(rate, arm))
        return np.concatenate([state[:3] + arm, r.ravel(), momentum, spin, state[12:]])

    def export_state(self, y):
        """From this state to the plant's."""
        if not self.bar:
            return np.array(y)
        centre, r, velocity, rate = self._bar(y)
        arm = r @ self.bar.com
        angles = Rotation.from_matrix(r).as_euler("ZYX")[::-1]
        return np.concatenate(
            [centre - arm, angles, velocity - np.cross(rate, arm), r.T @ rate, y[18:]]
        )

    def _bar(self, y):
        r = y[3:12].reshape(3, 3)
        rate = r @ np.linalg.solve(self.bar.inertia.matrix, r.T @ y[15:18])
        return y[:3], r, y[12:15] / self.bar.mass, rate

    def ends(self, t, y):
        """Both ends of the cables, exits and attachments, and their velocities, each (n, 3)."""
        pose, pose_rate = self._path(t)
        exits = self.exits @ matrix(pose[3:]).T
        turn = world_rate(pose[3:], pose_rate[3:])
        start, start_rate = pose[:3] + exits, pose_rate[:3] + np.cross(turn, exits)
        if not self.bar:
            return start, start_rate, self.attachments, np.zeros((self.n, 3))
        centre, r, velocity, rate = self._bar(y)
        arms = (self.attachments - self.bar.com) @ r.T
        return start, start_rate, centre + arms, velocity + np.cross(rate, arms)

    def tensions(self, t, y):
        """Tension, elastic tension, l̇, l̇0 and unit vector from exit to attachment."""
        start, start_rate, end, end_rate = self.ends(t, y)
        lengths = np.linalg.norm(end - start, axis=1)
        unit = (end - start) / lengths[:, None]
        rates = np.sum(unit * (end_rate - start_rate), axis=1)
        unstretched, speeds = y[self.first : self.first + self.n], y[self.first + 2 * self.n :]
        wound = -unstretched / lengths * self.radii * speeds
        elastic, tension = np.empty(self.n), np.empty(self.n)
        for i, cable in enumerate(self.cables):
            length = unstretched[i] + self.offsets[i]
            law, damping = cable.stiffness, cable.damping
            elastic[i] = elastic_tension(law, lengths[i] - unstretched[i], length)
            b = damping.factor * (damping.constant - damping.slope * length)
            b *= min(1.0, elastic[i] / law.floor_tension)
            tension[i] = max(0.0, elastic[i] + b * (rates[i] - wound[i]))
        return tension, elastic, rates, wound, unit

    def rate(self, t, y, torque):
        tension, _, _, wound, unit = self.tensions(t, y)
        out = np.zeros_like(y)
        n, first = self.n, self.first
        out[first : first + n] = wound
        out[first + n : first + 2 * n] = y[first + 2 * n :]
        net = np.clip(torque, -self.limits, self.limits) - self.radii * tension
        out[first + 2 * n :] = net / self.inertias
        if self.bar:
            centre, r, velocity, rate = self._bar(y)
            _, _, end, _ = self.ends(t, y)
            forces = -tension[:, None] * unit
            out[:3] = velocity
            out[3:12] = np.cross(rate, r.T).T.ravel()
            out[12:15] = forces.sum(axis=0)
            out[14] += self.bar.mass * self.testbed.gravity
            out[15:18] = np.cross(end - centre, forces).sum(axis=0)
        return out

    def rate_of_plant_state(self, t, state, torque, step=1e-5):
        """The plant's state derivative, by differences along this plant's own."""
        y = self.import_state(state)
        rate = self.rate(t, y, torque)
        ahead, behind = (self.export_state(y + side * step * rate) for side in (1, -1))
        return (ahead - behind) / (2 * step)

    def run(self, state, torques, hold):
        """The plant's state after holding each row of `torques` for `hold` seconds."""
        y = self.import_state(state)
        for k, torque in enumerate(torques):
            y = solve_ivp(
                self.rate,
                (k * hold, (k + 1) * hold),
                y,
                args=(torque,),
                method="DOP853",
                rtol=1e-11,
                atol=1e-13,
            ).y[:, -1]
        return self.export_state(y)
