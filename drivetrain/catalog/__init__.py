"""Catalogues of motors, gears and other parts: columns, reading, checking, importing."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.catalog.linting import lint
    from drivetrain.catalog.price import Price
    from drivetrain.catalog.read import Catalog, read_catalog

__getattr__, __dir__ = shown(__name__)
