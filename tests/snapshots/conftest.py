"""Gives every snapshot test the one strict fixture."""

from strict import strict_snapshot

__all__ = ["strict_snapshot"]
