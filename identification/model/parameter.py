"""One number of a plant, and what it is called in columns and in words."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """One number of a plant.

    Parameters
    ----------
    kind
        ``gain``, ``zero`` or ``pole`` of a mode, ``real_zero``, ``real_pole`` or ``delay_s``.
    index
        From 1 among those of its kind.
    quantity
        ``omega`` or ``zeta`` of a mode, else empty.
    value
        In the units of :class:`identification.model.plant.PlantModel`.
    """

    kind: str
    index: int
    quantity: str
    value: float

    @property
    def name(self) -> str:
        """Of a column: gain, zero_omega_1, zero_zeta_1, ..., real_zero_1, ..., delay_s."""
        if self.kind in ("gain", "delay_s"):
            return self.kind
        return "_".join(part for part in (self.kind, self.quantity, str(self.index)) if part)

    @property
    def label(self) -> str:
        """In words, with the unit of what is no gain: zero mode 1, omega [rad/s]; real zero 2 [rad/s]; delay [s]."""
        if self.quantity:
            return f"{self.kind} mode {self.index}, {self.quantity}" + " [rad/s]" * (self.quantity == "omega")
        which = f" {self.index}" if self.index > 1 else ""
        root = f"{self.kind.replace('_', ' ')}{which} [rad/s]"
        return {"gain": "gain", "delay_s": "delay [s]"}.get(self.kind, root)
