"""The packages; all else is in pyproject.toml, which cannot find some and name others."""

from setuptools import find_packages, setup

DATA = ["iceslide_fem.cases", "iceslide_fem.meshes"]

setup(packages=[*find_packages(include=["iceslide_fem", "iceslide_fem.*"]), *DATA])
