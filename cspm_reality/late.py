"""Physics that begins during a run."""

from __future__ import annotations

from cspm_mujoco.influence import Acting, Influence, Scene


class Late:
    """An influence that acts from its onset on; its memory begins then."""

    def __init__(self, influence: Influence, onset: float) -> None:
        """Take the onset [s]."""
        self._influence, self._onset = influence, onset

    def act(self, scene: Scene, acting: Acting) -> None:
        """Act if it has begun."""
        if scene.time >= self._onset:
            self._influence.act(scene, acting)

    def advance(self, scene: Scene, period: float) -> None:
        """Remember if it has begun."""
        if scene.time >= self._onset:
            self._influence.advance(scene, period)
