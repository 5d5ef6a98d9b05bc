"""The base of every option that a scenario file can hold: strict, frozen, documented."""

from pydantic import BaseModel, ConfigDict


class Options(BaseModel):
    """A group of options, defined beside the thing that it configures.

    Unknown keys are refused, values are not changed after reading, and the docstring under each field is
    its help in the JSON Schema, in editors and in the documentation.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True)
