"""Lets the node that commands winches hear all measured topics until the drivers are proved."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.intake import Intake
from cspm_msgs_py.testbed import Testbed

if TYPE_CHECKING:
    from cspm_ros.check_drivers.driver_proof import DriverProof

Array = NDArray[np.float64]


class ProofPort:
    """A driver proof with subscriptions of its own; see `cspm_msgs_py.stepping.proof`."""

    def __init__(self, node: ContractNode, testbed: Testbed, proof: DriverProof) -> None:
        """Subscribe `node` to the topics that the proof hears."""
        self._proof, self._intake = proof, Intake(node.node)
        for name in proof.topics:
            topic = testbed.topics[name]
            self._intake.subscribe(topic, ros_class(topic.ros_type), partial(self._hear, name))

    @property
    def passed(self) -> bool:
        """Whether the drivers have shown that they are right."""
        return self._proof.passed

    @property
    def under_way(self) -> bool:
        """Whether it commands winches: from its first command on."""
        return self._proof.under_way

    def restart(self) -> None:
        """Take note that a driver is missing."""
        self._intake.take()
        self._proof.restart()

    def command(self, now_ns: int) -> tuple[int, Array] | None:
        """Return the stamp [ns] of the state answered and what drives are to obey, or None.

        Raises:
            InputError: the drivers are wrong, in one line.
        """
        self._intake.take()
        return self._proof.command(now_ns)

    def close(self) -> None:
        """Leave the topics."""
        self._intake.close()

    def _hear(self, topic: str, payload: bytes, _: int, __: int | None) -> None:
        self._proof.hear(topic, payload)
