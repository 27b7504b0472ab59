"""Find the workspace of another cable robot, described in examples/robots/tower.yaml."""

from pathlib import Path

import cspm

tower = cspm.load_testbed(Path(__file__).parent / "robots" / "tower.yaml")
print(f"{tower.name}: {len(tower.cables)} cables, bar of {tower.description.bar.mass} kg")

pose, acceleration = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.5, 0.0, 0.0, 0.0]
found = cspm.analyze_workspace(testbed=tower, pose=pose, acceleration=acceleration, coarse=16)
for way, limits in found.limits.items():
    reach = ", ".join(f"{dof} {value}" for dof, value in limits.items())
    print(f"{way}: {reach} (m, rad)")
