"""The lockstep schedule in compiled code, with Python where a stage is the user's."""
