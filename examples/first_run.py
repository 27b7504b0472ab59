"""Simulate a calm sea and read signals: the first script."""

import cspm

run = cspm.simulate("calm", duration=10)
print(run)
print("signals:", ", ".join(run.names))

heave = run.bar_pose["heave"]  # measured [m], z points down
tension = run.tension["sway_3"]  # measured [N]
print(f"at {run.time[-1]:.3f} s the bar is at z = {heave[-1]:.3f} m")
print(f"sway_3 carries {tension.min():.2f} to {tension.max():.2f} N")
for dof, error in run.errors.items():
    print(f"{dof:6} error: max {error['max']:.2e}, RMS {error['rms']:.2e} (m, rad)")

recording = run.save("calm_10")  # a rosbag2 folder; `cspm info calm_10` shows what is in it
print("identical when repeated:", recording.resimulate().difference is None)
