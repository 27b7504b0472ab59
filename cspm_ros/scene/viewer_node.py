"""The viewer's node: frames, URDF and markers of whatever runs in its domain.

It reads what is published and sends to viewers only: no run waits for it, or notices it.
"""

from __future__ import annotations

from collections.abc import Callable

from cspm_model.scene.scene import Scene
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.ros.contract_node import ContractNode, ros_class
from cspm_msgs_py.ros.intake import Intake
from cspm_msgs_py.ros.local_name import local
from cspm_msgs_py.ros.qos import contract_qos
from cspm_msgs_py.ros_types import typestore
from cspm_msgs_py.testbed import Testbed
from cspm_msgs_py.topics import SCENE, Topic
from cspm_msgs_py.wire import WireReader
from cspm_ros.schema_types.schema_class import message_class_of

FRAMES_PER_SECOND = 20.0


class ViewerNode:
    """Draws what was last heard, 20 times a second, markers every other time.

    Attributes:
        drawn: how many times something was drawn.
    """

    def __init__(self, node: ContractNode, testbed: Testbed) -> None:
        """Connect to the topics of a machine."""
        self._node, self._scene = node, Scene(testbed, testbed.topics)
        self.drawn = 0
        # Only the newest message of each topic is of use.
        self._intake = Intake(node.node)
        self._heard = False
        for name in self._scene.sources:
            self._subscribe(testbed.topics[name])
        self._publish = {name: self._publisher(topic) for name, topic in SCENE.items()}
        for message in self._scene.lasting():
            self._publish[message.topic](message.payload)
        node.every(1.0 / FRAMES_PER_SECOND, self._draw)

    def _subscribe(self, topic: Topic) -> None:
        decode = WireReader(topic).decode

        def take(payload: bytes, *_: object) -> None:
            try:
                stamp_ns, row = decode(payload)
            except InputError as err:
                self._node.complain(topic.name, str(err))
                return
            self._heard = True
            self._scene.take(topic.name, stamp_ns, row)

        message_class = ros_class(topic.ros_type)
        self._intake.subscribe(
            topic, message_class, take, numbered=False, reliability="best_effort", depth=1
        )

    def _publisher(self, topic: Topic) -> Callable[[bytes], None]:
        message_class = message_class_of(topic.ros_type, typestore())
        qos = contract_qos(1, latched=topic.latched)
        made = self._node.node.create_publisher(message_class, local(topic.name), qos)
        publish: Callable[[bytes], None] = made.handle.publish_raw
        return publish

    def _draw(self) -> None:
        self._heard = False
        self._intake.take()
        if not self._heard:
            return
        for message in self._scene.moving(markers=self.drawn % 2 == 0):
            self._publish[message.topic](message.payload)
        self.drawn += 1
