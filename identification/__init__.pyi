from identification.base.errors import InputError
from identification.fit_model import fit
from identification.model.additive_bound import AdditiveBound
from identification.model.model_file import IdentifiedModel, read_model
from identification.model.modes import Mode
from identification.model.plant import PlantModel
from identification.model.signals import Signals
from identification.sweeps.read_sweeps import read_sweeps
from identification.sweeps.response import FrequencyResponse, alias_free

__all__ = [
    "AdditiveBound",
    "FrequencyResponse",
    "IdentifiedModel",
    "InputError",
    "Mode",
    "PlantModel",
    "Signals",
    "alias_free",
    "fit",
    "read_model",
    "read_sweeps",
]
