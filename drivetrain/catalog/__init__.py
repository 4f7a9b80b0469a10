"""Catalogues of motors and gears: columns, reading, checking, importing."""
