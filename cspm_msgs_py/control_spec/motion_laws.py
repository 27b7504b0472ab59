"""Names of the motion controllers, which help lists without loading their models."""

MOTION_LAWS = ("pid", "computed_wrench", "pd_plus", "lqr")
