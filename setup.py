"""What pyproject.toml cannot say: a build starts from an empty folder, so that no module that is gone gets in."""

from tempfile import TemporaryDirectory

from setuptools import setup

folder = TemporaryDirectory()
setup(options={"build": {"build_base": folder.name}})
