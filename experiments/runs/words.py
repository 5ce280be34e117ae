"""Limits and sectors in words, for what draws or prints a run without making one."""

from __future__ import annotations


def limits_text(low: float, high: float) -> str:
    """Both limits in words, ``+-12`` or ``-3 to 12``."""
    return f"+-{high:.4g}" if low == -high else f"{low:.4g} to {high:.4g}"


def sector_text(sector: float, digits: int = 3) -> str:
    """A sector in so many digits, of its distance from 1 in one less where that is small."""
    return f"1 - {1 - sector:.{digits - 1}g}" if 0.9995 <= sector < 1 else f"{sector:.{digits}g}"
