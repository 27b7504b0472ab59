"""Read a recording into pandas; any rosbag2 folder or MCAP file of the contract's topics."""

import cspm

cspm.simulate("calm", duration=5).save("calm_5")  # in place of your recording

recording = cspm.open("calm_5")
print(recording, "signals:", ", ".join(recording.names))
table = recording.to_pandas("tension", "bar_pose")  # a row per stamp, the time [s] as index
print(table.describe().loc[["mean", "std", "min", "max"]].round(3).T)
table.to_csv("calm_5.csv")
