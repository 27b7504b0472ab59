"""Prescribed motions of winch frame and target: seas, vessels, recorded files, moves."""
