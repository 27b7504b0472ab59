"""Build entry for colcon; everything that it says is in pyproject.toml."""

from setuptools import setup

setup()
