"""Steer bevel-tip needles, and identify unmodelled physics from recorded insertions.

Units are mm, s and rad. Positions are in frame {A}: right-handed, origin at the entry point, z into the tissue.
docs/python.md is a short how-to.
"""
from bevel._core import *  # noqa: F403
