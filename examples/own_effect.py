"""Simulate physics of one's own, declared in examples/effects/winch_churning.py."""

from pathlib import Path

import cspm

cspm.use_effects(Path(__file__).parent / "effects")
churning = cspm.effects()["winch_churning"]
print(churning.description.equation, [p.unit for p in churning.parameters])

dry = cspm.load_testbed("one_winch")
oily = dry.with_effect("winch_churning", "surge", coefficient=0.01)
for testbed in (dry, oily):
    run = cspm.simulate("one_winch", testbed=testbed, duration=5)
    print(f"fastest: {abs(run.truth.winch_speed['surge']).max():.3f} rad/s")
