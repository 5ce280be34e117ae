"""The error that every bad input ends in."""

from __future__ import annotations


class InputError(ValueError):
    """Something the user gave cannot be used; the message is one sentence saying what, where and what else."""


class MissingFile(InputError):
    """A file to read is not there."""
